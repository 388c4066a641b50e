"""The operator's loop is as short as the documentation claims, and creates no object itself."""

import ast
import inspect
from importlib import import_module
from pathlib import Path

import palaestra.operator
from palaestra.operator.controller import Controller

MOST_LINES = 60
SOURCES = sorted(Path(palaestra.operator.__file__).parent.glob("*.py"))


def test_the_loop_is_read_in_one_screen():
    """A cluster administrator must be able to predict the operator's next action from one screen of code."""
    assert len(inspect.getsource(Controller.reconcile).splitlines()) <= MOST_LINES


def test_the_operator_makes_no_object():
    """Only the package `plan` builds objects.

    If the operator built some too, two packages would have to agree.
    """
    taken = {
        (node.module, each.name)
        for source in SOURCES
        for node in ast.walk(ast.parse(source.read_text()))
        if isinstance(node, ast.ImportFrom) and node.module.startswith("palaestra.plan")
        for each in node.names
    }

    assert taken
    assert [name for module, name in taken if inspect.isfunction(getattr(import_module(module), name))] == []


def test_a_look_observes_once():
    """A reconcile that read all objects of a job again for each decision cost three times as much."""
    calls = [
        (source.name, ast.unparse(node.func))
        for source in SOURCES
        for node in ast.walk(ast.parse(source.read_text()))
        if isinstance(node, ast.Call)
    ]

    assert [call for call in calls if call[1] in {"observe", "self._looking.look"}] == [
        ("controller.py", "self._looking.look"),
        ("observer.py", "observe"),
    ]


def test_the_loop_writes_the_status_in_one_place():
    """A second write would need rules of its own about conflicts and about the events after it."""
    assert inspect.getsource(Controller).count("self._reporting.report(") == 1
