"""The tree of the models: the fields of each model, and the models of these fields."""

from collections.abc import Iterator
from types import UnionType
from typing import Annotated, Any, Union, get_args, get_origin

from pydantic.fields import FieldInfo

from palaestra.api.model import ApiModel
from palaestra.api.paths import Path


def model_in(annotation: Any) -> type[ApiModel] | None:
    """Return the model in a field's annotation, also inside a list or a union; None without a model."""
    if isinstance(annotation, type) and issubclass(annotation, ApiModel):
        return annotation
    if get_origin(annotation) in {Annotated, Union, UnionType, tuple, dict}:
        found = (model_in(part) for part in get_args(annotation))
        return next((model for model in found if model), None)
    return None


def fields_of(model: type[ApiModel]) -> dict[str, FieldInfo]:
    """Return the fields of `model` by their names in YAML."""
    return {field.alias or name: field for name, field in model.model_fields.items()}


def model_at(root: type[ApiModel], path: Path) -> type[ApiModel] | None:
    """Return the model of the object at `path` below `root`, or None."""
    model: type[ApiModel] | None = root
    for piece in path:
        if isinstance(piece, int) or model is None:
            continue
        field = fields_of(model).get(piece)
        model = model_in(field.annotation) if field else None
    return model


def walk(root: type[ApiModel], path: Path = ()) -> Iterator[tuple[Path, type[ApiModel]]]:
    """Yield `root` and every model below it, each with the path of the field that contains it."""
    yield path, root
    for name, field in fields_of(root).items():
        if inner := model_in(field.annotation):
            yield from walk(inner, (*path, name))


def objects(root: ApiModel, path: Path = ()) -> Iterator[tuple[Path, ApiModel]]:
    """Yield `root` and every object below it, each with its path, including indices."""
    yield path, root
    for name, field in type(root).model_fields.items():
        value = getattr(root, name)
        below = (*path, field.alias or name)
        if isinstance(value, ApiModel):
            yield from objects(value, below)
        elif isinstance(value, tuple):
            for index, item in enumerate(value):
                if isinstance(item, ApiModel):
                    yield from objects(item, (*below, index))
