"""The programs of a simulator's container: worlds, the sidecar, the stub simulator."""
