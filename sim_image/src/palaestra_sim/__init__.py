"""What runs in a simulator's container: worlds, the sidecar, the stub simulator."""
