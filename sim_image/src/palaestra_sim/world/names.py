"""The ROS names of a simulator's robots.

    <job>_r<replica>_<group>_<index><slot>_<robot>_<hash>
    move_to_target_r0_collect_1a_robotino_8c31f2

The words are for people, and may be cut or have characters replaced; the hash is taken over
the words as they were, so two names that look alike still differ. A name is legal in ROS 1
(a letter first, then `[A-Za-z0-9_]`) and at most 63 bytes long: the `ros` controller copies it
into a buffer of 64 without looking.
"""

import hashlib
import json
import re
from dataclasses import astuple, dataclass

MAX_NAME_BYTES = 63
HASH_DIGITS = 6
# What is left of 63 bytes for a robot is at least 15, so that people can tell robots apart.
_MAX_PREFIX = 40
_MAX_GROUP = 16
_ILLEGAL = re.compile(r"[^A-Za-z0-9_]")


@dataclass(frozen=True, slots=True, kw_only=True)
class RunIdentity:
    """Which simulator a world is for: one of a group, of a replica, of a job.

    `uid` is the job's UID, "" outside a cluster. `slot` is "a", or "b" for a standby beside it.
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

    All robots of a simulator share it. At most 40 bytes: a long job gives way first. It isn't
    unique by itself.
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
    """Return `text` with every character that ROS doesn't allow as an underscore."""
    return _ILLEGAL.sub("_", text)


def _hash(identity: RunIdentity, robot: str) -> str:
    """Return 6 hex digits over all that makes a name one robot's own.

    JSON keeps the parts apart: no text in one can look like the border to the next.
    """
    parts = (*astuple(identity), robot)
    return hashlib.sha256(json.dumps(parts).encode()).hexdigest()[:HASH_DIGITS]
