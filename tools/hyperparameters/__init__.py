"""docs/reference/trainingjob.md: the table of default hyperparameters, which is made from the code."""
