"""The connection for an address."""

import re

import pytest

from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.real_robots.connect import link_to
from palaestra_trainer.real_robots.rest import RestLink
from palaestra_trainer.real_robots.robot_clock import RobotClock
from palaestra_trainer.real_robots.ros1 import Ros1Link
from palaestra_trainer.real_robots.sensor_layout import SensorLayout


def linked(address):
    """Return the connection for an address; it is not open."""
    return link_to(address, SensorLayout(), RobotClock())


@pytest.mark.parametrize(
    ("address", "kind"),
    [
        ("http://192.168.0.1", RestLink),
        ("ros1://192.168.0.1:11311", Ros1Link),
        ("ros1://robot:11311/lab/first/", Ros1Link),
    ],
)
def test_the_scheme_of_an_address_chooses_the_connection(address, kind):
    """One option of the program names robot and protocol."""
    link = linked(address)
    link.close()

    assert type(link) is kind
    assert link.address == address


@pytest.mark.parametrize(
    ("address", "message"),
    [
        ("ftp://192.168.0.1", "robot: 'ftp://192.168.0.1' has an unknown scheme; begin it with http:// or"),
        ("192.168.0.1", "robot: '192.168.0.1' has an unknown scheme; begin it with http:// or ros1://"),
        ("http://", "robot: 'http://' is not an address such as http://192.168.0.1"),
        (
            "ros1://192.168.0.1",
            "robot: 'ros1://192.168.0.1' is not an address such as ros1://192.168.0.1:11311",
        ),
        ("ros1://robot:x", "robot: 'ros1://robot:x' is not an address such as"),
        ("ros1://robot:11311/2nd", "'ros1://robot:11311/2nd' is not an address such as"),
        ("ros1://robot:11311/?x", "'ros1://robot:11311/?x' is not an address such as"),
    ],
)
def test_an_address_that_cannot_be_used_is_refused(address, message):
    """The sentence names the option, the fact and the remedy."""
    with pytest.raises(ConfigurationError, match=re.escape(message)):
        linked(address)
