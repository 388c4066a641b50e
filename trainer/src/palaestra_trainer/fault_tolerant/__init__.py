"""Environments for training loops of other libraries, which tolerate faults of simulators.

Such a loop cannot skip a row, so it never gets an invalid one: a fault ends the episode as truncated, and the
next reset waits until the simulator is restarted.
"""
