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
from palaestra_sim.world.checks import CHECKS, CHECKS_WITHOUT_FILE, Candidate
from palaestra_sim.world.edits import edited
from palaestra_sim.world.names import RunIdentity, ros_name
from palaestra_sim.world.reader import parse
from palaestra_sim.world.robots import robot_name, ros_robots
from palaestra_sim.world.source import Source


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
    simulator of a ROS master. `name` is what errors call the world. `relative_addresses`: the
    world stays beside the files that it names, so they need no full address.

    Raises:
        WorldError: the world can't be read, repeats a robot or a robot's name, has arguments that
            are no strings or overrule its name, or has a relative address where none may be.
    """
    text = Source(data=source, name=name)
    world = parse(source, name)
    robots = ros_robots(world)
    candidate = Candidate(source=text, world=world, robots=robots)
    for check in CHECKS if relative_addresses else CHECKS_WITHOUT_FILE:
        if error := check(candidate):
            raise error
    timekeeper = next(filter(asks_for_clock, robots), None) if clock else None
    edits = [
        edit
        for robot in robots
        for edit in argument_edits(
            world, robot, ros_name(identity, robot_name(robot)), clock=robot is timekeeper
        )
    ]
    return edited(text, world.tokens, sorted(edits, key=lambda edit: edit.start))
