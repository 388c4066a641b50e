"""What the command line makes of namespaces; that they are followed is tested with a real API server."""

import argparse

import pytest

from palaestra.cli import operator


@pytest.mark.parametrize(
    ("typed", "namespaces"),
    [([], []), (["--namespace=a"], ["a"]), (["--namespace=a", "--namespace", "b"], ["a", "b"])],
)
def test_the_namespaces_may_be_named_one_by_one(typed, namespaces):
    """None means all of them."""
    parser = argparse.ArgumentParser()
    operator.add(parser.add_subparsers())

    assert parser.parse_args(["operator", *typed]).namespaces == namespaces
