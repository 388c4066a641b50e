"""Import Stable-Baselines3 without libraries that most programs never use; this saves a third of their start.

The modules of Stable-Baselines3 import pandas, Matplotlib and rich for functions that no training calls. They
import TensorBoard's writer even if the program does not write event files. While Python executes these
modules, a stand-in module replaces each library. A stand-in imports its library at the first use, so every
function of the library still works. When other modules import a library, they get the library itself. A
library that is already imported is not replaced.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from importlib import import_module
from importlib.abc import MetaPathFinder
from importlib.machinery import ModuleSpec, PathFinder, SourceFileLoader
from importlib.util import spec_from_file_location
from types import MappingProxyType, ModuleType
from typing import Any

# Each tuple holds a library and those of its submodules that Stable-Baselines3 imports by name.
_MATPLOTLIB = ("matplotlib", "matplotlib.figure")
_PANDAS = ("pandas",)
_PROGRESS_BAR = ("tqdm.rich",)
_TENSORBOARD = ("torch.utils.tensorboard", "torch.utils.tensorboard.summary")
IMPORTERS: Mapping[str, tuple[tuple[str, ...], ...]] = MappingProxyType(
    {
        "stable_baselines3.common.callbacks": (_PROGRESS_BAR,),
        "stable_baselines3.common.logger": (_MATPLOTLIB, _PANDAS, _TENSORBOARD),
        "stable_baselines3.common.monitor": (_PANDAS,),
        "stable_baselines3.common.utils": (_TENSORBOARD,),
    }
)


def defer_unused_imports() -> None:
    """Defer the import of these libraries from now on; further calls have no effect."""
    if not any(isinstance(finder, _Finder) for finder in sys.meta_path):
        sys.meta_path.insert(0, _Finder())


class _Finder(MetaPathFinder):
    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """Return the spec of a module in `IMPORTERS`, with our loader; for other modules return None."""
        if fullname not in IMPORTERS:
            return None
        found = PathFinder.find_spec(fullname, path, target)
        if found is None or found.origin is None or type(found.loader) is not SourceFileLoader:
            return None
        loader = _LoaderWithStandIns(fullname, found.origin)
        return spec_from_file_location(fullname, found.origin, loader=loader)


class _LoaderWithStandIns(SourceFileLoader):
    def exec_module(self, module: ModuleType) -> None:
        with _stand_ins(IMPORTERS[self.name]):
            super().exec_module(module)


class _StandIn(ModuleType):
    """A stand-in for a module; its attributes are stand-ins too while an importer is executed."""

    def __getattr__(self, name: str) -> Any:
        if sys.modules.get(self.__name__) is self:
            return _Later(self, name)
        return getattr(import_module(self.__name__), name)


class _Later:
    """A stand-in for a class or function; an importer uses it in an annotation, or calls it later."""

    def __init__(self, home: _StandIn, name: str) -> None:
        self._home, self._name = home, name

    def __call__(self, *arguments: Any, **options: Any) -> Any:
        return getattr(self._home, self._name)(*arguments, **options)

    def __getattr__(self, name: str) -> Any:
        return getattr(getattr(self._home, self._name), name)


@contextmanager
def _stand_ins(libraries: Sequence[tuple[str, ...]]) -> Iterator[None]:
    made = {
        name: _StandIn(name) for library in libraries if library[0] not in sys.modules for name in library
    }
    for name, stand_in in made.items():
        whole, _, part = name.rpartition(".")
        if whole in made:
            setattr(made[whole], part, stand_in)
    sys.modules.update(made)
    try:
        yield
    finally:
        for name in made:
            del sys.modules[name]
