"""The contents of a world: robots with their devices, frames, nodes and fields, and the steps of time.

Callers drive it: it contains no wire protocol. `devices` is the table of devices; `tree` is the view of a
supervisor.
"""
