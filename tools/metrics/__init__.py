"""docs/reference/metrics.md: the tables, which are made from the code."""
