"""Python expressions in a file of RL-Baselines3-Zoo, such as `dict(net_arch=[64], activation_fn=nn.ReLU)`.

Zoo evaluates such expressions. This module only parses the expressions. It reads only literals, `dict(...)`
and names of classes, so an untrusted file cannot run code. A class becomes text for a TrainingJob: `ReLU` or
`module:Class`.
"""

import ast
from collections.abc import Iterator, Mapping
from typing import Any

# A TrainingJob uses PyTorch's short names for these classes. A test compares this table with the trainer's.
SHORT: Mapping[str, frozenset[str]] = {
    "torch.nn": frozenset(
        {"ELU", "GELU", "LeakyReLU", "Mish", "ReLU", "SELU", "SiLU", "Softplus", "Tanh"},
    ),
    "torch.optim": frozenset({"Adam", "AdamW", "NAdam", "RAdam", "RMSprop", "SGD"}),
}
# Zoo's own modules import these modules under shorter names.
_ROOTS: Mapping[str, str] = {
    "gym": "gymnasium",
    "nn": "torch.nn",
    "sb3": "stable_baselines3",
    "th": "torch",
}
_IMPORTED: Mapping[str, str] = {
    "HerReplayBuffer": "HerReplayBuffer",
    "RMSpropTFLike": "stable_baselines3.common.sb2_compat.rmsprop_tf_like:RMSpropTFLike",
}


class NotPlain(ValueError):
    """An expression is neither a literal nor a class; the message is a fact about the expression."""


def entries(text: str) -> Iterator[tuple[str, Any]]:
    """Yield the name and the value of each entry of the mapping in `text`.

    If a value cannot be read, yield a `NotPlain` with the reason in its place.

    Raises:
        NotPlain: the text is not a mapping with text as its keys.
    """
    for name, node in _pairs(_parsed(text)):
        try:
            yield name, _value(node)
        except NotPlain as error:
            yield name, error


def value(text: str) -> Any:
    """Return the value in `text`.

    Raises:
        NotPlain: the text is neither a literal, nor `dict(...)`, nor the name of a class.
    """
    return _value(_parsed(text))


def _parsed(text: str) -> ast.expr:
    try:
        return ast.parse(text.strip(), mode="eval").body
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        raise NotPlain("is not a Python expression, or is nested too deeply") from None


def _pairs(node: ast.expr) -> Iterator[tuple[str, ast.expr]]:
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "dict":
        if node.args or any(keyword.arg is None for keyword in node.keywords):
            raise NotPlain(f"{ast.unparse(node)} is not a plain dict(name=value)")
        yield from ((str(keyword.arg), keyword.value) for keyword in node.keywords)
    elif isinstance(node, ast.Dict):
        for key, item in zip(node.keys, node.values, strict=True):
            if not (isinstance(key, ast.Constant) and isinstance(key.value, str)):
                raise NotPlain(f"{ast.unparse(node)} has a key that is not a string")
            yield key.value, item
    else:
        raise NotPlain(f"{ast.unparse(node)} is not a mapping")


def _value(node: ast.expr) -> Any:
    match node:
        case ast.Constant(value=str() | int() | float() | None):
            return node.value
        case ast.UnaryOp(op=ast.USub() | ast.UAdd(), operand=ast.Constant(value=int() | float())):
            return ast.literal_eval(node)
        case ast.List() | ast.Tuple():
            return [_value(item) for item in node.elts]
        case ast.Dict() | ast.Call(func=ast.Name(id="dict")):
            return {name: _value(item) for name, item in _pairs(node)}
        case ast.Name() | ast.Attribute():
            return _class(ast.unparse(node))
    raise NotPlain(f"{ast.unparse(node)} is neither a literal nor the name of a class")


def _class(name: str) -> str:
    """Return the name of a class for a TrainingJob."""
    if name in _IMPORTED:
        return _IMPORTED[name]
    module, _, last = name.rpartition(".")
    if not (module and all(part.isidentifier() for part in name.split("."))):
        raise NotPlain(f"{name} does not name a module")
    first, _, rest = module.partition(".")
    module = ".".join(filter(None, (_ROOTS.get(first, first), rest)))
    return last if last in SHORT.get(module, ()) else f"{module}:{last}"
