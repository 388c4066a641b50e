"""Faster imports: without an optional dependency, and without garbage collection."""

from __future__ import annotations

import gc
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module


def import_without(dependency: str, module: str) -> None:
    """Import a module as if its optional dependency were not installed; later imports find the dependency.

    This has no effect if the module or the dependency is already imported.
    """
    if dependency not in sys.modules and module not in sys.modules:
        sys.modules[dependency] = None  # type: ignore[assignment]  # Python's way to forbid an import
        try:
            import_module(module)
        finally:
            del sys.modules[dependency]


@contextmanager
def without_collections() -> Iterator[None]:
    """Collect no garbage while the block imports modules, and exclude these objects from later collections.

    Imports create hundreds of thousands of permanent objects. If the collector scans them repeatedly, that
    takes a sixth of the time to import PyTorch. If the block imports nothing new, later collections are as
    before.
    """
    imported = len(sys.modules)
    gc.disable()
    try:
        yield
    finally:
        if len(sys.modules) > imported:
            gc.freeze()
        gc.enable()
