"""The types of a TrainingJob's values; each type has a maximum size.

An API server estimates the cost of a rule from the largest object that the schema allows. The API server
refuses rules over strings, lists or maps without a maximum size. Two regular expression engines read the
patterns: Rust's in pydantic, and Go's in the API server. So the patterns use only plain ASCII classes.
"""

import json
from typing import Annotated, Any, Protocol, TypeVar

from pydantic import (
    AfterValidator,
    BeforeValidator,
    Field,
    ValidationError,
    ValidatorFunctionWrapHandler,
    WithJsonSchema,
    WrapValidator,
)
from pydantic_core import PydanticCustomError

T = TypeVar("T")

# This mark in a field's JSON schema means that users may change the field in an existing job.
MAY_CHANGE = "x-may-change"

LABEL = "^[a-z]([-a-z0-9]*[a-z0-9])?$"
DIGIT_LABEL = "^[a-z0-9]([-a-z0-9]*[a-z0-9])?$"
SUBDOMAIN = "^[a-z0-9]([-a-z0-9]*[a-z0-9])?([.][a-z0-9]([-a-z0-9]*[a-z0-9])?)*$"
QUALIFIED = "^[a-z0-9]([-a-z0-9.]*[a-z0-9])?/[A-Za-z0-9]([-A-Za-z0-9_.]*[A-Za-z0-9])?$"
FILE_KEY = "^[-._a-zA-Z0-9]+$"
VARIABLE = "^[A-Za-z_][A-Za-z0-9_]*$"
IMAGE = "^[A-Za-z0-9][-A-Za-z0-9._:/@]*$"
LABEL_VALUE = "^([A-Za-z0-9]([-A-Za-z0-9_.]*[A-Za-z0-9])?)?$"
QUANTITY = "^[0-9]+([.][0-9]+)?(m|k|M|G|T|P|Ki|Mi|Gi|Ti|Pi)?$"
MEMORY = "^[1-9][0-9]*(M|G|T|Mi|Gi|Ti)$"
FOLDER = "^[A-Za-z0-9][-A-Za-z0-9._]*$"
WORLD_FILE = "^/.+[.](wbt|xml)$"
ABSOLUTE_FOLDER = "^(/[^/]+)+$"
ALGORITHMS = (
    "DQN",
    "PPO",
    "A2C",
    "SAC",
    "TD3",
    "DDPG",
    "QRDQN",
    "TQC",
    "TRPO",
    "CrossQ",
    "RecurrentPPO",
    "MaskablePPO",
    "REINFORCE",
)
ROBOTS = ("Robotino", "TurtleBot3Burger", "EPuck")
CLASS = "[A-Za-z_][A-Za-z0-9_.]*:[A-Za-z_][A-Za-z0-9_]*"
ALGORITHM = f"^({'|'.join(ALGORITHMS)}|{CLASS})$"
POLICY = f"^([A-Za-z_][A-Za-z0-9_]*|{CLASS})$"
CLASS_NAME = f"^{CLASS}$"
ROBOT = f"^({'|'.join(ROBOTS)}|{CLASS})$"
POLICY_FILE = "^(/.+|[A-Za-z0-9_][-A-Za-z0-9._]*(/[A-Za-z0-9_][-A-Za-z0-9._]*)*)[.]zip$"
ENVIRONMENT_ID = "^([A-Za-z0-9_.]+:)?([-A-Za-z0-9_.]+/)?[-A-Za-z0-9_.]+$"  # the version -vN may be missing

# For each pattern, the two texts of the message about a value that does not match the pattern. The message is
# "<value> is not <first text>; <second text>".
PATTERNS: dict[str, tuple[str, str]] = {
    LABEL: ("a name", "use a-z first, then a-z, 0-9 and '-', no '-' at the end"),
    DIGIT_LABEL: ("a namespace", "use a-z, 0-9 and '-', no '-' at the beginning or the end"),
    SUBDOMAIN: ("the name of an object", "use a-z, 0-9, '-' and '.'"),
    QUALIFIED: ("a name with a domain", "write it as example.com/name"),
    FILE_KEY: ("a key", "use letters, digits, '-', '_' and '.'"),
    VARIABLE: ("the name of a variable", "use letters, digits and '_', no digit first"),
    IMAGE: ("an image", "write it as registry/name:tag"),
    QUANTITY: ("a quantity", "write a number and a unit, as 500m, 2, 512Mi or 1Gi"),
    MEMORY: ("an amount of memory", "write a whole number and a unit, as 400Mi or 2Gi"),
    LABEL_VALUE: ("the value of a label", "use letters, digits, '-', '_' and '.'"),
    FOLDER: ("the name of a folder", "use letters, digits, '-', '_' and '.', no '/'"),
    WORLD_FILE: ("the path of a world", "give the absolute path of a .wbt or .xml file"),
    ABSOLUTE_FOLDER: ("the path of a folder", "give an absolute path without a / at its end"),
    ALGORITHM: ("an algorithm", f"use {', '.join(ALGORITHMS)} or module:Class"),
    POLICY: ("a policy", "write MlpPolicy, CnnPolicy, MultiInputPolicy or module:Class"),
    CLASS_NAME: ("the name of a class", "write it as module:Class"),
    POLICY_FILE: (
        "the path of a model.zip",
        "give an absolute path; with a claim, give a path on the claim, without hidden folders and `..`",
    ),
    ENVIRONMENT_ID: (
        "the id of an environment",
        "write it as in gymnasium's registry, such as MoveToTargetEnv-v0",
    ),
    ROBOT: ("a robot", f"use {', '.join(ROBOTS)} or module:Class"),
}

# The name of a pod is the name of its job and a suffix, and must be a DNS label of at most 63 characters.
JobName = Annotated[str, Field(min_length=1, max_length=48, pattern=LABEL)]
GroupName = Annotated[str, Field(min_length=1, max_length=20, pattern=LABEL)]
# The name of a job becomes part of the names of Services and ROS nodes, which must begin with a letter. The
# name of a namespace may begin with a digit. Source: RFC 1123
Namespace = Annotated[str, Field(min_length=1, max_length=63, pattern=DIGIT_LABEL)]
ObjectName = Annotated[str, Field(min_length=1, max_length=253, pattern=SUBDOMAIN)]
FileKey = Annotated[str, Field(min_length=1, max_length=253, pattern=FILE_KEY)]
Image = Annotated[str, Field(min_length=1, max_length=512, pattern=IMAGE)]
Text = Annotated[str, Field(max_length=1024)]
Word = Annotated[str, Field(min_length=1, max_length=256)]
Sentence = Annotated[str, Field(max_length=4096)]
Seconds = Annotated[int, Field(ge=1, le=31_536_000)]
Fraction = Annotated[float, Field(ge=0, le=1)]
Minutes = Annotated[int, Field(ge=1, le=525_600)]
Count = Annotated[int, Field(ge=0, le=2_000_000_000)]
Memory = Annotated[str, Field(max_length=32, pattern=MEMORY)]

# Lists in YAML become tuples, so that a job is immutable.
Listed = Annotated[tuple[T, ...], Field(strict=False)]
Words = Annotated[Listed[Word], Field(max_length=64)]


def _without_unknown_items(items: Any, read: ValidatorFunctionWrapHandler) -> Any:
    """Return the items that `read` validated, without items that have an unknown enum value."""
    try:
        return read(items)
    except ValidationError as error:
        unknown = {
            problem["loc"][0] for problem in error.errors(include_url=False) if problem["type"] == "enum"
        }
        if not unknown:
            raise
        return read([item for place, item in enumerate(items) if place not in unknown])


# A newer release may write items of a kind that this release does not know. This validator drops such items.
# A list in a status may have this validator only if programs only display the list, or if each reconcile
# builds the list again.
KNOWN_ITEMS = WrapValidator(_without_unknown_items)


class Named(Protocol):
    """An item of a list whose items have unique names."""

    @property
    def name(self) -> str:
        """The unique name of the item."""
        ...


N = TypeVar("N", bound=Named)


def _uniquely_named(items: tuple[N, ...]) -> tuple[N, ...]:
    """Return `items` if their names are unique."""
    names = [item.name for item in items]
    if twice := sorted({name for name in names if names.count(name) > 1}):
        raise PydanticCustomError(
            "twice",
            "{name} is the name of two entries; make the names unique",
            {"name": json.dumps(twice[0])},
        )
    return items


# These keywords of the schema make the API server refuse a list in which two items have the same name.
NamedList = Annotated[
    Listed[N],
    AfterValidator(_uniquely_named),
    Field(
        json_schema_extra={
            "x-kubernetes-list-type": "map",
            "x-kubernetes-list-map-keys": ["name"],
        }
    ),
]
TextMap = Annotated[dict[Annotated[str, Field(max_length=317)], Text], Field(max_length=32)]
LabelMap = Annotated[
    dict[
        Annotated[str, Field(max_length=317)],
        Annotated[str, Field(max_length=63, pattern=LABEL_VALUE)],
    ],
    Field(max_length=32),
]


def _as_text(value: object) -> object:
    """Return a whole number as text and any other value unchanged; authors must quote fractions."""
    if isinstance(value, int) and not isinstance(value, bool):
        return str(value)
    return value


Quantity = Annotated[
    str,
    Field(max_length=32, pattern=QUANTITY),
    BeforeValidator(_as_text),
    WithJsonSchema(
        {"x-kubernetes-int-or-string": True, "maxLength": 32, "pattern": QUANTITY},
    ),
]
Quantities = Annotated[dict[Annotated[str, Field(max_length=317)], Quantity], Field(max_length=16)]

_DEEPEST = 16  # levels; the affinity of a pod has 9
_LONGEST_TEXT = 4096
_MOST_VALUES = 1000


def _plain(value: object, depth: int) -> int:
    """Return the number of values in `value`; raise an error for a value that JSON cannot represent."""
    if depth > _DEEPEST:
        raise PydanticCustomError(
            "free", "is nested deeper than {most} levels; flatten it", {"most": _DEEPEST}
        )
    if isinstance(value, dict):
        if not all(isinstance(key, str) for key in value):
            raise PydanticCustomError("free", "has a key that is not text; quote it")
        return 1 + sum(_plain(item, depth + 1) for item in value.values())
    if isinstance(value, list):
        return 1 + sum(_plain(item, depth + 1) for item in value)
    if isinstance(value, str) and len(value) > _LONGEST_TEXT:
        raise PydanticCustomError("free", "contains a text over 4096 characters; shorten it")
    if isinstance(value, float) and not (abs(value) < float("inf")):
        raise PydanticCustomError("free", "contains a number that is not finite; use a finite one")
    if value is not None and not isinstance(value, str | int | float):
        raise PydanticCustomError("free", "contains a value that JSON cannot represent; use text and numbers")
    return 1


def _free(value: dict[str, Any]) -> dict[str, Any]:
    """Return `value` if it is plain, finite and small."""
    if _plain(value, 0) > _MOST_VALUES:
        raise PydanticCustomError("free", "contains more than 1000 values; shorten it")
    return value


# The schema is a map to values of any type, not an object with unknown fields. If an API server compares two
# objects with unknown fields, it does not notice a renamed key. Then users could change a frozen field.
FreeObject = Annotated[
    dict[str, Any],
    Field(max_length=64),
    AfterValidator(_free),
    WithJsonSchema(
        {
            "type": "object",
            "maxProperties": 64,
            "additionalProperties": {"x-kubernetes-preserve-unknown-fields": True, "nullable": True},
        },
    ),
]
