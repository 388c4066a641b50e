"""Make the world of one simulator: its source world with ROS names of its own.

What changes is the `controllerArgs` of every robot whose controller is "ros", and in there only

    --name=          the robot's ROS name; added if there is none, and never two
    --synchronize    added, so that the simulation waits for its client to step it
    --clock          never added. `clock` says whether this simulator may keep one: then the first
                     of the world stays and the rest go, else all go. Two on one ROS master would
                     publish two times on one topic.

All else stays as it is, byte for byte. A world made this way is made of itself again.
"""

from palaestra_sim.world.arguments import argument_edits, asks_for_clock
from palaestra_sim.world.checks import candidate
from palaestra_sim.world.edits import edited
from palaestra_sim.world.names import RunIdentity, ros_name
from palaestra_sim.world.robots import robot_name


def generate(
    source: bytes,
    identity: RunIdentity,
    *,
    clock: bool,
    name: str = "world",
    relative_addresses: bool = False,
) -> bytes:
    """Return the world of one simulator, made of the world `source`.

    `clock`: this simulator may publish `/clock`, if its world asks for it; true for at most one
    simulator of a ROS master. `name` and `relative_addresses` are as for `check`.

    Raises:
        WorldError: as `check` does.
    """
    found = candidate(source, name, relative_addresses=relative_addresses)
    timekeeper = next(filter(asks_for_clock, found.robots), None) if clock else None
    edits = [
        edit
        for robot in found.robots
        for edit in argument_edits(
            found.world, robot, ros_name(identity, robot_name(robot)), clock=robot is timekeeper
        )
    ]
    return edited(found.source, found.world.tokens, sorted(edits, key=lambda edit: edit.start))
