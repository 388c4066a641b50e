"""The bundled descriptions of Webots' robots and sensors, with the default of each field filled in."""

import re
from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple

import palaestra_sim.world
from palaestra_sim.world import Node, World, parse, parse_proto

PROTOS = Path(palaestra_sim.world.__file__).parent / "protos"
ROBOTS = ("E-puck", "Pioneer3at", "Pioneer3dx", "Robotino3", "TurtleBot3Burger")
CARS = ("BmwX5", "TeslaModel3")
ROVERS = ("Moose", "Rosbot", "RosbotXl")
ARMS = ("UR3e", "UR5e", "UR10e")
LIDARS = {
    "HokuyoUrg04lx": (240, 667, 0.06, 4.095),
    "HokuyoUrg04lxug01": (240, 667, 0.2, 5.6),
    "HokuyoUtm30lx": (270, 1080, 0.1, 30),
    "RpLidarA2": (89.954, 800, 0.2, 12),
    "SickLms291": (180, 180, None, 80),
    "SickS300": (270, 540, None, 30),
    "VelodynePuck": (360, 3600, 1, 100),
    "VelodyneVLP-16": (360, 3600, 1, 100),
    "VelodyneHDL-32E": (90, 4500, 1, 70),
    "VelodyneHDL-64E": (90, 4500, 0.8, 120),
}
# The range in meters by the data sheet, and the volts at both ends of the range.
INFRARED = {
    "SharpGP2D120": ((0.04, 2.72), (0.3, 0.42)),
    "SharpGP2Y0A02YK0F": ((0.2, 2.51), (1.5, 0.45)),
    "SharpGP2Y0A41SK0F": ((0.04, 2.72), (0.3, 0.42)),
    "SharpGP2Y0A710K0F": ((1.0, 2.5), (5.5, 1.37)),
}
PARTS = (
    "Astra",
    "CharacterSkin",
    "E-puckGroundSensors",
    "Kinect",
    "Robotino3Platform",
    "Robotino3Webcam",
    "Robotino3Wheel",
    "RobotisLds01",
    *LIDARS,
    *INFRARED,
)

GEOMETRIES = ("Rectangle", "TexturedBox")

_FILE = re.compile(r"PROTO (?P<name>\S+) \[\n(?P<fields>.*?)\n\]\n\{\n(?P<body>.*)\}\n\Z", re.DOTALL)
_FIELD = re.compile(
    r"field\s+\w+(?:\{[^}]*\})?\s+(?P<name>\w+)\s+(?P<default>[^\n]*?)(?:\s{2}#[^\n]*)?$", re.MULTILINE
)
_IS = re.compile(r"\bIS (\w+)")
_IN_TEMPLATE = re.compile(r"\bfields\.(\w+)\.value\b")


class Description(NamedTuple):
    """A PROTO file: its name, its fields with their defaults, and its body with these defaults filled in."""

    name: str
    defaults: dict[str, str]
    used: set[str]
    body: World


def described(name: str) -> Description:
    """Return a description, in whose body each `IS` and output is replaced by the default of the field."""
    path = PROTOS / f"{name}.proto"
    written = path.read_text()
    text = parse_proto(path.read_bytes(), path.name).source.data.decode()  # without its template
    header, _, _ = text.partition("\n")
    found = _FILE.search(text)
    assert found, name
    defaults = {it["name"]: it["default"] for it in _FIELD.finditer(found["fields"])}
    body = _IS.sub(lambda match: defaults[match[1]], found["body"])
    return Description(
        name=found["name"],
        defaults=defaults,
        used={*_IS.findall(found["body"]), *_IN_TEMPLATE.findall(written)},
        body=parse(f"{header}\n{body}".encode(), name),
    )


def of_type(nodes: Iterable[Node], *types: str) -> list[Node]:
    """Return the nodes of these types, in source order."""
    return [node for node in nodes if node.type_name in types]


def numbers(node: Node, field: str) -> tuple[float, ...]:
    """Return the numbers of a field; it is an error if the node does not have the field."""
    found = node.numbers(field)
    assert found is not None, f"{node.type_name} without {field}"
    return found
