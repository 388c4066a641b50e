"""The ROS names of a simulator's robots.

    <job>_r<replica>_<group>_<index><slot>_<robot>_<hash>
    move_to_target_r0_collect_1a_robotino_8c31f2

The readable part is for people. It may be cut, and some characters may be replaced. The hash covers the
original values, so two names with the same readable part still differ. A name is valid in ROS 1 (a letter
first, then `[A-Za-z0-9_]`). A name has at most 63 bytes, because the `ros` controller copies it into a buffer
of 64 bytes without a check.
"""

import hashlib
import json
import re
from dataclasses import astuple, dataclass

MAX_NAME_BYTES = 63
HASH_DIGITS = 6
# At least 15 of the 63 bytes are for the robot, so that people can distinguish robots.
_MAX_PREFIX = 40
_MAX_GROUP = 16
_ILLEGAL = re.compile(r"[^A-Za-z0-9_]")


@dataclass(frozen=True, slots=True, kw_only=True)
class RunIdentity:
    """The identity of one simulator: its job, its replica, its group, and its index in the group.

    `uid` is the job's UID, or "" outside a cluster. `slot` is "a", or "b" for the standby.
    """

    job: str
    replica: int
    group: str
    index: int
    namespace: str = "default"
    uid: str = ""
    slot: str = "a"


def name_prefix(identity: RunIdentity) -> str:
    """Return the readable part before the robot, such as `move_to_target_r0_collect_1a`.

    All robots of a simulator share this prefix. The prefix has at most 40 bytes; a long job name is cut
    first. The prefix is not unique by itself.
    """
    group = _legal(identity.group)[:_MAX_GROUP]
    place = _legal(f"_r{identity.replica}_{group}_{identity.index}{identity.slot}")
    job = _legal(identity.job)
    if not job[:1].isalpha():
        job = "j" + job
    return (job[: max(1, _MAX_PREFIX - len(place))] + place)[:_MAX_PREFIX]


def ros_name(identity: RunIdentity, robot: str) -> str:
    """Return the ROS name of the robot whose `Robot.name` is `robot`."""
    readable = f"{name_prefix(identity)}_{_legal(robot)}"
    return f"{readable[: MAX_NAME_BYTES - HASH_DIGITS - 1]}_{_hash(identity, robot)}"


def _legal(text: str) -> str:
    """Return `text` with an underscore for every character that ROS does not allow."""
    return _ILLEGAL.sub("_", text)


def _hash(identity: RunIdentity, robot: str) -> str:
    """Return 6 hex digits of a hash over everything that distinguishes a robot.

    JSON separates the parts, so no text in one part can look like the beginning of the next.
    """
    parts = (*astuple(identity), robot)
    return hashlib.sha256(json.dumps(parts).encode()).hexdigest()[:HASH_DIGITS]
