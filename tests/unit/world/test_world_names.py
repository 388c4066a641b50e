"""The ROS names of robots: valid, short, readable and unique."""

import re
from dataclasses import replace
from itertools import product

from hypothesis import given
from hypothesis import strategies as st

from palaestra_sim.world import RunIdentity, name_prefix, ros_name

LEGAL = re.compile(r"[A-Za-z][A-Za-z0-9_]*")

identities = st.builds(
    RunIdentity,
    job=st.text(),
    namespace=st.text(),
    uid=st.text(),
    replica=st.integers(),
    group=st.text(),
    index=st.integers(),
    slot=st.text(max_size=3),
)


def test_a_name_says_whose_it_is(identity: RunIdentity) -> None:
    """A person who reads `rosnode list` sees the job, the replica, the simulator and the robot."""
    name = ros_name(identity, "robotino")

    assert re.fullmatch("move_to_target_r0_collect_1a_robotino_[0-9a-f]{6}", name)


def test_the_robots_of_a_simulator_share_a_prefix(identity: RunIdentity) -> None:
    """A person searches for the prefix where several simulators log at once."""
    assert name_prefix(identity) == "move_to_target_r0_collect_1a"
    assert ros_name(identity, "supervisor").startswith("move_to_target_r0_collect_1a_supervisor_")


def test_a_name_never_changes(identity: RunIdentity) -> None:
    """A simulator that restarts after an upgrade must have the name that is in the logs of its run."""
    assert ros_name(identity, "robotino") == "move_to_target_r0_collect_1a_robotino_682bd3"


def test_a_job_that_begins_with_a_digit_gets_a_letter_in_front(identity: RunIdentity) -> None:
    """Kubernetes allows names that begin with a digit, but ROS does not."""
    assert name_prefix(replace(identity, job="3d")).startswith("j3d_r0_")


def test_a_long_job_gives_way_to_what_tells_simulators_apart(identity: RunIdentity) -> None:
    """A job's name alone may have 63 characters, which is the limit for the whole ROS name."""
    name = ros_name(replace(identity, job="x" * 63, replica=12), "robotino")

    assert len(name) <= 63
    assert "x_r12_collect_1a_robotino_" in name


def test_two_names_that_look_alike_differ_in_their_hash(identity: RunIdentity) -> None:
    """Replaced and cut characters may make the readable parts equal, but the hashes still differ."""
    dotted, dashed = ros_name(identity, "arm.left"), ros_name(identity, "arm-left")

    assert dotted[:-6] == dashed[:-6]
    assert dotted != dashed


def test_a_standby_beside_a_simulator_has_a_name_of_its_own(identity: RunIdentity) -> None:
    """The standby and the first simulator run at the same time, with one ROS master."""
    assert name_prefix(replace(identity, slot="b")) == "move_to_target_r0_collect_1b"


def test_the_same_job_created_again_has_other_names(identity: RunIdentity) -> None:
    """Names of the deleted job may still be registered, and must not be taken for those of the new job."""
    assert ros_name(identity, "robotino") != ros_name(replace(identity, uid="7a20"), "robotino")


def test_the_border_between_two_parts_of_the_hash_cannot_be_shifted() -> None:
    """Without a safe separator, the end of one part could be read as the beginning of the next part."""
    one = RunIdentity(job="j", namespace='a", "b', uid="c", replica=0, group="g", index=0)
    other = RunIdentity(job="j", namespace="a", uid='b", "c', replica=0, group="g", index=0)

    assert ros_name(one, "r") != ros_name(other, "r")


@given(identity=identities, robot=st.text())
def test_every_name_is_legal_and_fits(identity: RunIdentity, robot: str) -> None:
    """Jobs, groups and robots may have any name."""
    name = ros_name(identity, robot)

    assert LEGAL.fullmatch(name)
    assert len(name.encode()) <= 63
    assert re.search("_[0-9a-f]{6}$", name)


@given(
    job=st.text(max_size=70),
    groups=st.sets(st.text(max_size=40), min_size=1, max_size=3),
    robots=st.sets(st.text(max_size=40), min_size=1, max_size=3),
    replicas=st.sets(st.integers(0, 999), min_size=1, max_size=3),
    indices=st.sets(st.integers(0, 99), min_size=1, max_size=3),
)
def test_no_two_robots_of_a_job_share_a_name(
    job: str, groups: set[str], robots: set[str], replicas: set[int], indices: set[int]
) -> None:
    """Two nodes with one name would unregister each other from the ROS master."""
    names = [
        ros_name(RunIdentity(job=job, replica=r, group=g, index=i, slot=s), robot)
        for r, g, i, s, robot in product(replicas, groups, indices, "ab", robots)
    ]

    assert len(set(names)) == len(names)
