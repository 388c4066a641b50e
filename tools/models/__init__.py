"""The count of other projects' models of MuJoCo that start without changes."""
