"""Values of the messages between trainer, sidecar and operator, and arbitrary JSON."""

import pytest
from hypothesis import strategies as st

from palaestra_protocol.control import LastExit, RobotName, SidecarState, SimulatorState
from palaestra_protocol.pod.status import (
    Cause,
    CheckpointStatus,
    EvaluationStatus,
    FaultKind,
    FaultRecord,
    Role,
    SimulatorStatus,
    StandbyState,
    Termination,
    TrainerStatus,
)

counts = st.integers(0, 2**53)
texts = st.text(st.characters(exclude_categories=["Cs"]), max_size=500)
names = st.text(st.characters(exclude_categories=["Cs"]), min_size=1, max_size=255)
shares = st.floats(0.0, 1.0)
times = st.datetimes().map(lambda time: f"{time.isoformat(timespec='seconds')}Z")

checkpoints = st.builds(CheckpointStatus, step=counts, time=times)
evaluations = st.builds(
    EvaluationStatus,
    step=counts,
    success_rate=st.none() | shares,
    mean_return=st.none() | st.floats(allow_nan=False, allow_infinity=False),
)
lines = st.text(st.characters(exclude_categories=["Cs"]), max_size=200)
fault_records = st.builds(
    FaultRecord,
    time=times,
    simulator=names,
    kind=st.sampled_from([kind.value for kind in FaultKind]),
    fact=lines,
    step=counts,
)

SHAPES = {
    SimulatorState: st.builds(
        SimulatorState,
        state=st.sampled_from(SidecarState),
        driver=names,
        world=texts,
        robots=st.lists(
            st.builds(
                RobotName,
                robot=names,
                ros_name=names,
                supervisor=st.booleans(),
                definition=names | st.just(""),
            ),
            max_size=3,
        ).map(tuple),
        pid=st.none() | st.integers(1, 2**22),
        starts=counts,
        faults=counts,
        last_exit=st.none()
        | st.builds(
            LastExit,
            code=st.none() | st.integers(0, 255),
            signal=st.none() | st.sampled_from(["SIGBUS", "SIGKILL", "SIG35"]),
            expected=st.booleans(),
        ),
        detail=texts,
        rss_bytes=st.none() | counts,
        left_out=st.lists(lines, max_size=16).map(tuple),
    ),
    TrainerStatus: st.builds(
        TrainerStatus,
        step=counts,
        target=counts,
        episodes=counts,
        phase=names,
        mean_return=st.none() | st.floats(allow_nan=False, allow_infinity=False),
        success_rate=st.none() | shares,
        steps_per_second=st.none() | st.floats(0.0, 1e9),
        simulators=st.lists(
            st.builds(
                SimulatorStatus,
                name=names,
                role=st.sampled_from([role.value for role in Role]),
                state=st.sampled_from([state.value for state in SidecarState]),
                restarts=counts,
                last_fault=st.none() | texts,
                flapping=st.booleans(),
                given_up=st.booleans(),
                standby=st.none() | st.sampled_from([state.value for state in StandbyState]),
            ),
            max_size=3,
        ).map(tuple),
        last_checkpoint=st.none() | checkpoints,
        last_progress=st.none() | times,
        last_progress_age_s=st.none() | st.floats(0.0, 1e9),
        attempt=st.none() | st.integers(1, 2**53),
        faults=st.dictionaries(st.sampled_from([kind.value for kind in FaultKind]), counts),
        goodput=st.dictionaries(st.sampled_from([cause.value for cause in Cause]), st.floats(0.0, 1e9)),
        steps_lost=counts,
        left_out=st.lists(lines, max_size=16).map(tuple),
        last_evaluation=st.none() | evaluations,
    ),
    Termination: st.builds(
        Termination,
        step=counts,
        reason=texts,
        success_rate=st.none() | shares,
        last_checkpoint=st.none() | checkpoints,
        attempt=st.none() | st.integers(1, 2**53),
        restarts=st.none() | counts,
        log=st.lists(lines, max_size=10).map(tuple),
        faults=st.lists(fault_records, max_size=10).map(tuple),
        last_evaluation=st.none() | evaluations,
    ),
}

scalars = st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=20)
anything = st.recursive(
    scalars, lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(), inner, max_size=4)
)


@st.composite
def bent(draw, shape):
    """Draw a valid message in which one field, at any depth, is replaced or removed."""
    whole = draw(SHAPES[shape]).to_json()
    part = whole
    while True:
        if not part:
            return whole
        name = draw(st.sampled_from(sorted(part)))
        inner = part[name][0] if isinstance(part[name], list) and part[name] else part[name]
        if not isinstance(inner, dict) or draw(st.booleans()):
            break
        part = inner
    if draw(st.booleans()):
        del part[name]
    else:
        part[name] = draw(anything)
    return whole


@pytest.fixture(scope="session")
def messages():
    """Return strategies for messages: valid messages, damaged messages, and any JSON."""

    class Messages:
        right = staticmethod(SHAPES.__getitem__)
        bent = staticmethod(bent)
        anything = anything

    return Messages


@pytest.fixture
def state():
    """Return a builder of a simulator's state; its keywords are the fields that differ from the default."""

    def make(**changes):
        plain = {"state": SidecarState.IDLE, "driver": "stub", "world": "/worlds/collect-0.wbt"}
        return SimulatorState(**plain | changes)

    return make


@pytest.fixture
def status():
    """Return a builder of a trainer's status; its keywords are the fields that differ from the default."""

    def make(**changes):
        return TrainerStatus(**{"step": 0, "target": 1, "episodes": 0, "phase": "training"} | changes)

    return make
