"""The contents of a world: robots with their devices, frames, nodes and fields, and the steps of time.

This package contains no wire protocol: other packages call it to step the world and to read sensors.
`devices` lists the device types. `tree` contains the nodes and fields that a supervisor reads and writes.
"""
