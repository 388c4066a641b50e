"""The programs of a simulator's container: worlds, the sidecar, the stub and MuJoCo simulators."""

from palaestra_protocol.shadowing import settle_imports

settle_imports()
