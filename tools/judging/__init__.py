"""docs/explain/judging.md: the list of checks on a replica, which is made from the code."""
