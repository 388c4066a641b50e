"""Import PyTorch's compiler only where something is compiled: a second of a processor at each start.

The first optimizer of a program imports `torch._dynamo`, and SymPy with it, to call `disable` and
`graph_break`, which have no effect where nothing is compiled. Here a stand-in has these two. It gives way to
the compiler itself as soon as a program uses any other part of it, as `torch.compile` does.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from importlib import import_module
from importlib.abc import Loader, MetaPathFinder
from importlib.machinery import ModuleSpec, PathFinder, SourceFileLoader
from importlib.util import spec_from_file_location
from types import ModuleType
from typing import Any

NAME = "torch._dynamo"
_ANSWER = "__dynamo_disable"  # where PyTorch keeps the answer of `disable` for a function

_OF_PYTORCH = {"disable": "torch._compile", "graph_break": "torch.optim.optimizer"}  # and who calls them


def defer_compiler() -> None:
    """Defer the compiler from now on, unless it is imported already; safe to repeat."""
    if NAME not in sys.modules and not any(isinstance(finder, _Finder) for finder in sys.meta_path):
        sys.meta_path.insert(0, _Finder())


class _StandIn(ModuleType):
    def __init__(self, name: str) -> None:
        super().__init__(name)
        self._asked_about: list[Callable[..., Any]] = []

    def _graph_break(self) -> None:
        pass  # without a compiler there is no graph

    def _disable(self, fn: Callable[..., Any], *_: Any, **_options: Any) -> Callable[..., Any]:
        self._asked_about.append(fn)
        return fn

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):  # asked of every module by programs that look through all of them
            raise AttributeError(name)
        # A function of a user that is disabled here must stay so when another one is compiled.
        asks = sys._getframe(1).f_globals.get("__name__")  # noqa: SLF001 - inspect.stack reads source files
        if asks == _OF_PYTORCH.get(name):
            return getattr(self, f"_{name}")
        return getattr(self.give_way(), name)

    def give_way(self) -> ModuleType:
        """Import the compiler in this place; it will be asked again about each function."""
        if sys.modules.get(NAME) is self:
            sys.meta_path[:] = [finder for finder in sys.meta_path if not isinstance(finder, _Finder)]
            del sys.modules[NAME]
            for function in self._asked_about:
                vars(function).pop(_ANSWER, None)
        return import_module(NAME)


class _Finder(MetaPathFinder):
    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """Return the spec of the stand-in; for a part of the compiler, of the part once it is imported."""
        standing = sys.modules.get(NAME)
        if fullname.startswith(f"{NAME}.") and isinstance(standing, _StandIn):
            standing.give_way()
            return ModuleSpec(fullname, _Imported()) if fullname in sys.modules else None
        found = PathFinder.find_spec(fullname, path, target) if fullname == NAME else None
        if found is None or found.origin is None:
            return None
        return spec_from_file_location(
            fullname,
            found.origin,
            loader=_LoaderOfStandIn(fullname, found.origin),
            submodule_search_locations=found.submodule_search_locations,
        )


class _LoaderOfStandIn(SourceFileLoader):
    def create_module(self, spec: ModuleSpec) -> ModuleType:
        return _StandIn(spec.name)

    def exec_module(self, module: ModuleType) -> None:
        """Do nothing: the compiler is not imported."""


class _Imported(Loader):
    """Returns a module that was imported while it was looked for."""

    def create_module(self, spec: ModuleSpec) -> ModuleType:
        return sys.modules[spec.name]

    def exec_module(self, module: ModuleType) -> None:
        """Do nothing: it has been executed."""
