"""The programs of a simulator's container: the sidecar, the stub, the MuJoCo simulator, and worlds."""

from palaestra_protocol.shadowing import settle_imports

settle_imports()
