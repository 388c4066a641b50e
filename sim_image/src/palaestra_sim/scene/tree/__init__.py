"""The scene as a supervisor sees it: nodes, their fields, and the writes that have an effect."""
