"""The base class of all models of a TrainingJob, and the rules that check several fields together.

A `Rule` has a Python check, a CEL expression and a message. So `palaestra` and an API server refuse the same
job with the same message. All broken rules are collected and reported at once.
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

# With this validation context, the models skip their rules. `palaestra.api.loading` then checks the rules
# itself, even if some fields are wrong.
FIELDS_ONLY: Final = {"rules": "later"}


@dataclass(frozen=True, slots=True, kw_only=True)
class Rule:
    """One condition on several fields of an object.

    `message` is "<fact>; <remedy>". `field` is the path of the reported field below the object, in camelCase
    with dots; it is empty for the object itself. In `cel`, `self` is the object with its defaults, and the
    expression names every field that `holds` reads. An API server cannot read free objects such as options.
    So a rule about free objects has no `cel`, and `reads` names the fields.
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
    """An object breaks one or more rules; `rules` lists all of them."""

    def __init__(self, rules: tuple[Rule, ...]) -> None:
        super().__init__(" ".join(rule.message for rule in rules))
        self.rules = rules


class ApiModel(BaseModel):
    """One immutable object of the API: camelCase in YAML, snake_case in Python; unknown fields are errors.

    Every program that reads a job checks the `rules` of its objects. The `guards` apply only to new jobs of a
    cluster. The API server checks the guards when a job is created, and the operator checks them until it
    accepts the job. A rule that a later release adds is a guard, so that jobs of an earlier release stay
    accepted.
    """

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
    guards: ClassVar[tuple[Rule, ...]] = ()

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
        rules = [rule.validation() for rule in (*cls.rules, *cls.guards) if rule.cel]
        if rules:
            handler.resolve_ref_schema(schema)["x-kubernetes-validations"] = rules
        return schema


class StatusModel(ApiModel):
    """One object of a status; unlike other objects, it may have unknown fields, which are ignored.

    A newer release may have written the status with more fields. Only models of the status inherit from this
    class; a spec with an unknown field is an error.
    """

    model_config = ConfigDict(extra="ignore")
