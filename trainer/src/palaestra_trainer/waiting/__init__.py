"""Waiting with a deadline: turns of threads, what was waited, how long is left, and signals that end it."""
