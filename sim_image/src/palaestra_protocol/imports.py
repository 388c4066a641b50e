"""Make imports faster: skip an optional dependency, and pause garbage collection."""

from __future__ import annotations

import gc
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module


def import_without(dependency: str, module: str) -> None:
    """Import `module` as if its optional `dependency` were not installed.

    Later imports find the dependency. If the module or the dependency is already imported, this function does
    nothing.
    """
    if dependency not in sys.modules and module not in sys.modules:
        sys.modules[dependency] = None  # type: ignore[assignment]  # Python's way to forbid an import
        try:
            import_module(module)
        finally:
            del sys.modules[dependency]


@contextmanager
def without_collections() -> Iterator[None]:
    """Pause garbage collection while the block imports modules; later collections skip the new objects.

    Imports create hundreds of thousands of permanent objects. Without the pause, the collector scans them
    repeatedly, which takes a sixth of the time to import PyTorch. If the block imports no new module, later
    collections still scan all objects.
    """
    imported = len(sys.modules)
    gc.disable()
    try:
        yield
    finally:
        if len(sys.modules) > imported:
            gc.freeze()
        gc.enable()
