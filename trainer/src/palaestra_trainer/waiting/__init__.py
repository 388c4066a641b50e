"""Waiting with a deadline: turns in one thread, time waited, time left, and signals that end a wait."""
