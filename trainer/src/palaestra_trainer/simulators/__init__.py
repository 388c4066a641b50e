"""Start the simulators of a run through their sidecars, and restart them after faults."""
