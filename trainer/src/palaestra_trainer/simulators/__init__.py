"""Which simulators there are, started behind a sidecar, and kept going through faults."""
