"""Which simulators there are: started behind a sidecar or as a process here, and kept going through faults."""
