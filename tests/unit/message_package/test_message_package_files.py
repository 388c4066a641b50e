"""The content of the ROS package webots_ros: the md5 sums of its types, and its Python modules."""

import ast
from pathlib import Path

import genmsg.gentools
import genmsg.msg_loader
import pytest

from palaestra_protocol.ros.definitions import type_names
from palaestra_protocol.ros.rostypes import message_type, service_type
from palaestra_sim.message_package.files import package_files
from tests.tables import for_each

FILES = dict(package_files())
MESSAGES, SERVICES = ([name for name in names if name.startswith("webots_ros/")] for names in type_names())
# The messages of Debian's package ros-sensor-msgs and of its dependencies.
INSTALLED = {name: [f"/usr/share/{name}/msg"] for name in ("std_msgs", "geometry_msgs", "sensor_msgs")}


@pytest.fixture
def definitions(tmp_path):
    """Return the folders in which genmsg searches for messages: this project's and the installed ones."""
    for name, text in FILES.items():
        if name.endswith(".msg"):
            (tmp_path / Path(name).name).write_text(text)
    return {**INSTALLED, "webots_ros": [str(tmp_path)]}


def md5_of(spec, context, definitions):
    """Return the md5 sum that ROS's tools compute from the definition files."""
    genmsg.msg_loader.load_depends(context, spec, definitions)
    return genmsg.gentools.compute_md5(context, spec)


@for_each("name", MESSAGES)
def test_the_file_of_every_message_has_the_md5_of_the_wire(name, definitions):
    """With another md5 sum, a simulator would refuse the connection of a tool that reads the file."""
    context = genmsg.MsgContext.create_default()
    text = FILES[f"msg/{name.removeprefix('webots_ros/')}.msg"]

    spec = genmsg.msg_loader.load_msg_from_string(context, text, name)

    assert md5_of(spec, context, definitions) == message_type(name).md5


@for_each("name", SERVICES)
def test_the_file_of_every_service_has_the_md5_of_the_wire(name, definitions):
    """The md5 sum of a service covers its request and its response."""
    context = genmsg.MsgContext.create_default()
    text = FILES[f"srv/{name.removeprefix('webots_ros/')}.srv"]

    spec = genmsg.msg_loader.load_srv_from_string(context, text, name)

    assert md5_of(spec, context, definitions) == service_type(name).md5


def test_the_modules_of_a_kind_are_the_types_of_that_kind():
    """If `webots_ros.srv` lacked a service, the import would fail only in a user's program."""
    for kind, names in (("msg", MESSAGES), ("srv", SERVICES)):
        imports = ast.parse(FILES[f"src/webots_ros/{kind}/__init__.py"]).body

        assert [f"webots_ros/{each.module.removeprefix('_')}" for each in imports] == names
        assert {f"src/webots_ros/{kind}/{each.module}.py" for each in imports} <= set(FILES)


def test_no_file_makes_the_package_a_regular_one():
    """A regular package that comes first on `sys.path` would hide an installed webots_ros."""
    assert "src/webots_ros/__init__.py" not in FILES
