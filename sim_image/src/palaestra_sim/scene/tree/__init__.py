"""The scene as a supervisor sees it: nodes, their fields, and the writes that take effect."""
