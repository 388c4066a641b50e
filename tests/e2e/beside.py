"""Tests that mostly wait run in threads of their own, at the same time as other tests.

A test with the mark `beside` starts early, in its own namespace: it starts when the first test of its group
begins (tests/e2e/conftest.py). When pytest calls the test later, the call waits for the thread and raises its
error. The test may request `namespace`, `job` and `tmp_path`, and its own parameters.
"""

import threading
from collections.abc import Callable, Iterable
from concurrent.futures import Future
from functools import partial
from inspect import signature
from pathlib import Path
from typing import Any, Generic, Self, TypeVar

import pytest

from tests.e2e.cluster import Cluster
from tests.e2e.jobs import tiny_job
from tests.e2e.namespace import Namespace, unique

T = TypeVar("T")

BESIDE = "beside"  # the name of the mark
AT_ONCE = 12  # so many small pods can start at the same time, next to two trainings on two processors
END_S = 1200.0


class Beside(Generic[T]):
    """Calls `act` in a thread; the thread is a daemon, so it ends with this process at the latest."""

    def __init__(self, act: Callable[[], T]) -> None:
        self._result: Future[T] = Future()
        threading.Thread(target=self._tell, args=(act,), daemon=True).start()

    def result(self) -> T:
        """Wait for the result of `act` and return it, or raise its error."""
        return self._result.result(END_S)

    def _tell(self, act: Callable[[], T]) -> None:
        try:
            self._result.set_result(act())
        except BaseException as error:  # noqa: BLE001 - `result` raises the error in its caller
            self._result.set_exception(error)


class Stories:
    """The tests with the mark `beside`, each with a namespace.

    `__exit__` deletes the namespaces of tests that have started but that pytest never called.
    """

    def __init__(self, cluster: Cluster, folders: pytest.TempPathFactory) -> None:
        self._cluster = cluster
        self._folders = folders
        self._begun: dict[str, Beside[object]] = {}
        self._namespaces: dict[str, Namespace] = {}
        self._room = threading.BoundedSemaphore(AT_ONCE)

    def __enter__(self) -> Self:
        """Return the tests; `begin` starts them."""
        return self

    def __exit__(self, *_: object) -> None:
        """Delete the namespaces that no caller has taken, with everything that runs in them."""
        for namespace in self._namespaces.values():
            namespace.delete()

    def begin(self, items: Iterable[pytest.Item]) -> None:
        """Start those of these tests that have the mark and have not started."""
        for item in items:
            if item.get_closest_marker(BESIDE) and item.nodeid not in self._begun:
                assert isinstance(item, pytest.Function)
                namespace = Namespace(self._cluster, unique(item.name))
                self._namespaces[item.nodeid] = namespace
                # `mktemp` is called here, because two threads that call it first create two roots, which is
                # an error.
                folder = self._folders.mktemp(BESIDE)
                self._begun[item.nodeid] = Beside(partial(self._call, item, namespace, folder))

    def take(self, item: pytest.Item) -> Namespace | None:
        """Return the namespace of a test that has started, or None; the caller must delete the namespace."""
        return self._namespaces.pop(item.nodeid, None)

    def end(self, item: pytest.Item) -> bool:
        """Wait for the end of a test and raise its error; return False if the test has not started."""
        story = self._begun.get(item.nodeid)
        if story:
            story.result()
        return story is not None

    def _call(self, item: pytest.Function, namespace: Namespace, folder: Path) -> None:
        with self._room:
            known: dict[str, Any] = {
                "namespace": namespace,
                "job": tiny_job,
                "tmp_path": folder,
                **getattr(getattr(item, "callspec", None), "params", {}),
            }
            item.obj(**{name: known[name] for name in signature(item.obj).parameters})
