"""The count of other projects' worlds of Webots that start without changes."""
