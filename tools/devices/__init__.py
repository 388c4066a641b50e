"""docs/reference/simulators.md: the table of devices, which is made from the code."""
