"""Starting a program sooner: importing without optional dependencies and without garbage collections."""

from __future__ import annotations

import gc
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module


def import_without(dependency: str, module: str) -> None:
    """Import a module as if its optional dependency were not installed; later imports find it again.

    It has no effect if one of the two is imported already.
    """
    if dependency not in sys.modules and module not in sys.modules:
        sys.modules[dependency] = None  # type: ignore[assignment]  # so Python documents how to forbid an import
        try:
            import_module(module)
        finally:
            del sys.modules[dependency]


@contextmanager
def without_collections() -> Iterator[None]:
    """Collect no garbage while the block imports modules, and leave them out of all later collections.

    Imports make hundreds of thousands of objects that stay. Looking through them again and again takes a
    sixth of the time to import PyTorch. If the block imports nothing new, later collections are as before.
    """
    imported = len(sys.modules)
    gc.disable()
    try:
        yield
    finally:
        if len(sys.modules) > imported:
            gc.freeze()
        gc.enable()
