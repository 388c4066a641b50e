"""The types of ROS's common packages equal the files that ROS installs."""

from pathlib import Path

import genmsg
import genmsg.gentools
import genmsg.msg_loader
import pytest

from palaestra_protocol.ros import definitions
from palaestra_protocol.ros.rostypes import message_type, service_type
from tests.tables import for_each

SHARE = Path("/usr/share")
PACKAGES = ("std_msgs", "geometry_msgs", "sensor_msgs", "nav_msgs", "actionlib_msgs")
SEARCH = {package: [str(SHARE / package / "msg")] for package in PACKAGES}
INSTALLED = [
    f"{package}/{file.stem}" for package in PACKAGES for file in (SHARE / package / "msg").glob("*.msg")
]
SERVICES = [file for package in (*PACKAGES, "std_srvs") for file in (SHARE / package / "srv").glob("*.srv")]


def test_ros_is_installed():
    """Without its files, the other tests would compare nothing."""
    assert all((SHARE / package / "msg").is_dir() for package in PACKAGES)
    assert (SHARE / "std_srvs" / "srv").is_dir()


@for_each("name", sorted(INSTALLED))
def test_every_installed_message_is_known_with_its_md5(name):
    """A publisher refuses a subscriber whose md5 sum differs."""
    context = genmsg.MsgContext.create_default()
    spec = genmsg.msg_loader.load_msg_by_type(context, name, SEARCH)
    genmsg.msg_loader.load_depends(context, spec, SEARCH)

    assert message_type(name).md5 == genmsg.gentools.compute_md5(context, spec)


@for_each("file", sorted(SERVICES))
def test_every_installed_service_is_known_with_its_md5(file):
    """A server refuses a client whose md5 sum differs."""
    name = f"{file.parents[1].name}/{file.stem}"
    context = genmsg.MsgContext.create_default()
    spec = genmsg.msg_loader.load_srv_from_string(context, file.read_text(), name)
    for side in (spec.request, spec.response):
        genmsg.msg_loader.load_depends(context, side, SEARCH)

    assert service_type(name).md5 == genmsg.gentools.compute_md5(context, spec)


def test_no_type_is_defined_twice():
    """Two definitions of one type could differ."""
    ours, common = definitions.type_names(), definitions.common_type_names()

    assert {*ours[0], *ours[1]} & {*common[0], *common[1]} == set()


@pytest.mark.parametrize("name", ["my_msgs/Own", "std_msgs", "std_srvs/Empty"])
def test_an_unknown_message_is_a_key_error(name):
    """A misspelled name, a package's name or the type of a service must not be taken for a message type."""
    with pytest.raises((KeyError, ValueError)):
        message_type(name)
