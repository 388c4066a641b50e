"""What every part of a TrainingJob has in common: its configuration and its rules.

A rule is a sentence about several fields at once. Its Python check, its CEL expression and its
message are in one `Rule`, so that a laptop and an API server refuse the same job with the same message.
Broken rules are collected, so that all mistakes are reported at once.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar, Final, Self

from pydantic import (
    BaseModel,
    ConfigDict,
    GetJsonSchemaHandler,
    ValidationInfo,
    model_validator,
)
from pydantic.alias_generators import to_camel
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema

# A validation context: look at each field, leave the rules to `palaestra.api.loading`, which
# judges them even where some fields are wrong.
FIELDS_ONLY: Final = {"rules": "later"}


@dataclass(frozen=True, slots=True, kw_only=True)
class Rule:
    """One claim about an object that several of its fields must hold together.

    `message` is "<fact>; <remedy>". `field` is the path of the reported field below the object, in camelCase
    with dots; empty for the object itself. In `cel`, `self` is the object with its defaults; the expression
    names every field that `holds` reads. An API server cannot read free objects such as options. A rule about
    them has no `cel`, and `reads` names the fields.
    """

    holds: Callable[[Any], bool]
    cel: str = ""
    reads: tuple[str, ...] = ()
    message: str
    field: str = ""

    def validation(self) -> dict[str, str]:
        """Return the rule as an entry of `x-kubernetes-validations`."""
        entry = {"rule": self.cel, "message": self.message}
        return entry | {"fieldPath": f".{self.field}"} if self.field else entry


class RulesBroken(ValueError):
    """The rules that one object breaks, together."""

    def __init__(self, rules: tuple[Rule, ...]) -> None:
        super().__init__(" ".join(rule.message for rule in rules))
        self.rules = rules


class ApiModel(BaseModel):
    """One object of the API: camelCase outside, snake_case inside, frozen, nothing unknown."""

    model_config = ConfigDict(
        alias_generator=to_camel,
        extra="forbid",
        frozen=True,
        strict=True,
        use_attribute_docstrings=True,
        validate_by_alias=True,
        validate_by_name=True,
    )

    rules: ClassVar[tuple[Rule, ...]] = ()

    @model_validator(mode="after")
    def _follow_the_rules(self, info: ValidationInfo) -> Self:
        if info.context is FIELDS_ONLY:
            return self
        if broken := tuple(rule for rule in self.rules if not rule.holds(self)):
            raise RulesBroken(broken)
        return self

    @classmethod
    def __get_pydantic_json_schema__(
        cls, core_schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> JsonSchemaValue:
        schema = handler(core_schema)
        if cls.rules:
            handler.resolve_ref_schema(schema)["x-kubernetes-validations"] = [
                rule.validation() for rule in cls.rules if rule.cel
            ]
        return schema


class Reported(ApiModel):
    """One object of a status: as every other, but fields that it does not have are ignored.

    A program reads statuses that another release wrote. A newer one may report more, and what a
    person writes is never read through here.
    """

    model_config = ConfigDict(extra="ignore")
