"""The contents of a world: robots with their devices, places, nodes and fields, and the steps of time.

Driven from outside: it knows no wire. `devices` is the table of devices; `tree` is the view of a supervisor.
"""
