"""The count of other people's worlds of Webots that start as they are."""
