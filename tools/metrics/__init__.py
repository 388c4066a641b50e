"""docs/reference/metrics.md: the part of it that is made from the code."""
