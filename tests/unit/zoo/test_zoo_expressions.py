"""Python expressions are parsed as data and never evaluated."""

import pytest

from palaestra.zoo.expressions import NotPlain, entries, value


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("[1, -2.5, 'a', None, True]", [1, -2.5, "a", None, True]),
        ("(1, {'a': [dict(b=2)]})", [1, {"a": [{"b": 2}]}]),
        (" dict() ", {}),
        ("nn.Tanh", "Tanh"),
        ("torch.nn.Hardtanh", "torch.nn:Hardtanh"),
        ("th.optim.Adam", "Adam"),
        ("my_lab.nets.Own", "my_lab.nets:Own"),
        ("RMSpropTFLike", "stable_baselines3.common.sb2_compat.rmsprop_tf_like:RMSpropTFLike"),
    ],
)
def test_literals_and_classes_are_read(text, expected):
    """Zoo's own files contain only literals and names of classes."""
    assert value(text) == expected


@pytest.mark.parametrize(
    "text",
    [
        "__import__('os').system('true')",
        "dict(*a)",
        "dict(**a)",
        "{1: 2}",
        "{**a}",
        "64 * 2",
        "-'a'",
        "not True",
        "b'bytes'",
        "1j",
        "...",
        "lambda: 1",
        "a[0].b",
        "Own",
        "1 +",
        "\0",
        "(" * 500,
    ],
)
def test_anything_else_is_refused(text):
    """Any person may have written the file, and an evaluated expression could run code."""
    with pytest.raises(NotPlain):
        value(text)


def test_an_entry_that_cannot_be_read_does_not_hide_the_others():
    """The other entries keep their values; the unreadable entry has the error in place of a value."""
    read = dict(entries("dict(a=1, b=f(), c={'d': 2})"))

    assert (read["a"], read["c"]) == (1, {"d": 2})
    assert str(read["b"]) == "f() is neither a literal nor the name of a class"
