"""The namespaces of the command line; a test with a real API server shows that they are watched."""

import argparse

import pytest

from palaestra.cli import operator


@pytest.mark.parametrize(
    ("typed", "namespaces"),
    [([], []), (["--namespace=a"], ["a"]), (["--namespace=a", "--namespace", "b"], ["a", "b"])],
)
def test_the_namespaces_may_be_named_one_by_one(typed, namespaces):
    """An empty list means all namespaces."""
    parser = argparse.ArgumentParser()
    operator.add(parser.add_subparsers())

    assert parser.parse_args(["operator", *typed]).namespaces == namespaces
