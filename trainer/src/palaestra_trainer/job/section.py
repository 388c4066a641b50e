"""The base of all sections of training.yaml."""

from __future__ import annotations

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field
from pydantic.alias_generators import to_camel

Positive = Annotated[int, Field(ge=1)]


class ConfigurationSection(BaseModel):
    """An immutable section of the file, with camelCase names in YAML.

    `configuration.parse` handles unknown fields.
    """

    model_config = ConfigDict(
        alias_generator=to_camel,
        populate_by_name=True,
        extra="forbid",
        frozen=True,
    )
