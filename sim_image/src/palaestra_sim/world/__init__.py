"""Worlds: read `.wbt`, `.proto` and MJCF files, and generate a world for each simulator, with its own names.

Pure: bytes in, bytes out. This package uses no clock and no network. It reads only built-in files and the
files that a world names.

    parse(source)                              the tree of a `.wbt` world
    check(source)                              raises unless a world can be generated for every simulator
    generate(source, identity, clock=False)    the world of one simulator
    rename(source, "_2")                       the world of one more simulator on the same ROS master
    robots(source)                             the robots of a world whose controller is "ros"
    own_controllers(source)                    the robots whose controllers are programs of their project
    root_of(path, source)                      the folder that holds a world and all files that it names
    suffix(source)                             the suffix of a world's file name: ".wbt" or ".xml"
    ros_name(identity, "robotino")             the generated ROS name of a robot
    builtin("arena")                           a built-in world
    builtin_protos()                           built-in descriptions of robots
    parse_proto(data, "Stool.proto")           the declaration of a node type
    local_protos(path, world)                  the PROTOs whose files belong to a world
    shipped_stand_ins()                        shapes for PROTOs whose files are not read
    expand(stand_in, values)                   the boxes, cylinders, spheres and planes of a stand-in
"""

from palaestra_sim.errors import StandInError, UnknownWorldError, WorldError
from palaestra_sim.world.builtin import builtin, builtin_path, builtin_protos
from palaestra_sim.world.extern_proto import Protos, local_protos
from palaestra_sim.world.formats import (
    MJCF,
    WBT,
    check,
    generate,
    own_controllers,
    rename,
    robots,
    suffix,
)
from palaestra_sim.world.names import RunIdentity, name_prefix, ros_name
from palaestra_sim.world.parts import ShapePart
from palaestra_sim.world.proto import Proto, ProtoField, parse_proto
from palaestra_sim.world.reader import parse, parse_nodes
from palaestra_sim.world.robots import WorldRobot
from palaestra_sim.world.root import placed, root_of
from palaestra_sim.world.stand_ins import StandIn, expand, load_stand_ins
from palaestra_sim.world.stand_ins import shipped as shipped_stand_ins
from palaestra_sim.world.tree import Is, Item, Node, Value, World

__all__ = [
    "MJCF",
    "WBT",
    "Is",
    "Item",
    "Node",
    "Proto",
    "ProtoField",
    "Protos",
    "RunIdentity",
    "ShapePart",
    "StandIn",
    "StandInError",
    "UnknownWorldError",
    "Value",
    "World",
    "WorldError",
    "WorldRobot",
    "builtin",
    "builtin_path",
    "builtin_protos",
    "check",
    "expand",
    "generate",
    "load_stand_ins",
    "local_protos",
    "name_prefix",
    "own_controllers",
    "parse",
    "parse_nodes",
    "parse_proto",
    "placed",
    "rename",
    "robots",
    "root_of",
    "ros_name",
    "shipped_stand_ins",
    "suffix",
]
