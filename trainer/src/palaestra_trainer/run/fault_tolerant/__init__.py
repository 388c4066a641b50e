"""Environments that tolerate faults of simulators, for training loops of other libraries.

Such a loop cannot skip a row, so the environments never return an invalid row. A fault truncates the episode,
and the next reset waits until the simulator is restarted.
"""
