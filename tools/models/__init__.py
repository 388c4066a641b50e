"""The count of other people's models of MuJoCo that start as they are."""
