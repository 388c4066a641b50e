"""The simulators of a run: started through their sidecars, and restarted after faults."""
