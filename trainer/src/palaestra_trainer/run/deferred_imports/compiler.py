"""Import PyTorch's compiler only if a program compiles; this saves a second of processor time per start.

The first optimizer of a program imports `torch._dynamo` to call its functions `disable` and `graph_break`.
That import also loads SymPy. Without compiled code these two functions have no effect, so a stand-in module
provides them. When a program uses any other attribute of the compiler, as `torch.compile` does, the compiler
itself replaces the stand-in.
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
# PyTorch stores the result of `disable(function)` in this attribute of the function.
_ANSWER = "__dynamo_disable"

# The functions of the stand-in, each with the module of PyTorch that calls it.
_OF_PYTORCH = {"disable": "torch._compile", "graph_break": "torch.optim.optimizer"}


def defer_compiler() -> None:
    """Defer the import of the compiler, unless it is already imported; further calls have no effect."""
    if NAME not in sys.modules and not any(isinstance(finder, _Finder) for finder in sys.meta_path):
        sys.meta_path.insert(0, _Finder())


class _StandIn(ModuleType):
    def __init__(self, name: str) -> None:
        super().__init__(name)
        self._asked_about: list[Callable[..., Any]] = []

    def _graph_break(self) -> None:
        pass  # without a compiler, a program has no graph to break

    def _disable(self, fn: Callable[..., Any], *_: Any, **_options: Any) -> Callable[..., Any]:
        self._asked_about.append(fn)
        return fn

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):  # programs that inspect all modules read such attributes
            raise AttributeError(name)
        # A function that a user's program passes to `disable` must stay disabled when another function is
        # compiled. So only PyTorch's own calls of `disable` get the stand-in.
        asks = sys._getframe(1).f_globals.get("__name__")  # noqa: SLF001 - inspect.stack is slow
        if asks == _OF_PYTORCH.get(name):
            return getattr(self, f"_{name}")
        return getattr(self.give_way(), name)

    def give_way(self) -> ModuleType:
        """Import the compiler instead of this stand-in; PyTorch then calls the real `disable` again."""
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
        """Return the spec of the stand-in, or the spec of a submodule after the compiler was imported."""
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
        """Do nothing, so that the compiler is not imported."""


class _Imported(Loader):
    """A loader for a module that was imported while Python searched for its spec."""

    def create_module(self, spec: ModuleSpec) -> ModuleType:
        return sys.modules[spec.name]

    def exec_module(self, module: ModuleType) -> None:
        """Do nothing, because the module has been executed already."""
