"""docs/reference/algorithms.md: the table of algorithms, observations and actions, made from the code."""

from tools.algorithms.page import PAGE, page, refusal

__all__ = ["PAGE", "page", "refusal"]
