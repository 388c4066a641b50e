"""What goes on beside the tests, in threads of its own: it waits, and they need not wait for it.

A test that is marked `beside` is called before its turn, when the first test of its place in the order has
its own (tests/e2e/conftest.py), in a namespace of its own. Its turn waits for the end, and what came of it is
what came of the test. It may ask for `namespace`, `job` and `tmp_path`, and for what it is parametrized with.
"""

import threading
from collections.abc import Callable, Iterable
from concurrent.futures import Future
from functools import partial
from inspect import signature
from typing import Any, Generic, Self, TypeVar

import pytest

from tests.e2e.cluster import Cluster
from tests.e2e.jobs import make_job
from tests.e2e.namespace import Namespace, unique

T = TypeVar("T")

BESIDE = "beside"  # the mark
AT_ONCE = 12  # small pods that begin beside two trainings, on two processors
END_S = 1200.0


class Beside(Generic[T]):
    """Calls `act` in a thread, which ends with this process at the latest."""

    def __init__(self, act: Callable[[], T]) -> None:
        self._result: Future[T] = Future()
        threading.Thread(target=self._tell, args=(act,), daemon=True).start()

    def result(self) -> T:
        """Return what it returns, once it does; raise what it raises."""
        return self._result.result(END_S)

    def _tell(self, act: Callable[[], T]) -> None:
        try:
            self._result.set_result(act())
        except BaseException as error:  # noqa: BLE001 - whoever asks for the result gets it
            self._result.set_exception(error)


class Stories:
    """The tests that are marked `beside`, each with a namespace, deleted here if its turn never comes."""

    def __init__(self, cluster: Cluster, folders: pytest.TempPathFactory) -> None:
        self._cluster = cluster
        self._folders = folders
        self._begun: dict[str, Beside[object]] = {}
        self._namespaces: dict[str, Namespace] = {}
        self._room = threading.BoundedSemaphore(AT_ONCE)

    def __enter__(self) -> Self:
        """Begin nothing yet."""
        return self

    def __exit__(self, *_: object) -> None:
        """Delete the namespaces that no test has taken, with everything that runs in them."""
        for namespace in self._namespaces.values():
            namespace.delete()

    def begin(self, items: Iterable[pytest.Item]) -> None:
        """Call those of these tests that are marked and have not begun."""
        for item in items:
            if item.get_closest_marker(BESIDE) and item.nodeid not in self._begun:
                assert isinstance(item, pytest.Function)
                namespace = Namespace(self._cluster, unique(item.name))
                self._namespaces[item.nodeid] = namespace
                self._begun[item.nodeid] = Beside(partial(self._call, item, namespace))

    def take(self, item: pytest.Item) -> Namespace | None:
        """Return the namespace of a test that has begun, for its taker to delete; None: it has not."""
        return self._namespaces.pop(item.nodeid, None)

    def end(self, item: pytest.Item) -> bool:
        """Wait for the end of a test and raise what it has raised; return False if it has not begun."""
        story = self._begun.get(item.nodeid)
        if story:
            story.result()
        return story is not None

    def _call(self, item: pytest.Function, namespace: Namespace) -> None:
        with self._room:
            known: dict[str, Any] = {
                "namespace": namespace,
                "job": make_job,
                "tmp_path": self._folders.mktemp(BESIDE, numbered=True),
                **getattr(getattr(item, "callspec", None), "params", {}),
            }
            item.obj(**{name: known[name] for name in signature(item.obj).parameters})
