"""The client of a sidecar, against a server whose responses a test prepares."""

import pytest

from palaestra_protocol.control import LastExit, SidecarState, SimulatorState
from palaestra_trainer.errors import SimulatorDead, SimulatorHung, SimulatorRefused, WrongData
from palaestra_trainer.job.configuration import parse
from palaestra_trainer.simulators.batch_simulator import BatchSimulator
from palaestra_trainer.webots.launching.sidecar import Sidecar
from tests.integration.apiserver.server import hang_up, raw, reply, serving

NOWHERE = "http://127.0.0.1:1"


def state(kind, **fields):
    """Return the response with a simulator's state."""
    found = SimulatorState(state=kind, driver="mujoco", world="/w/arena.xml", **fields)
    return reply(200, found.to_json())


STARTING, READY = state(SidecarState.STARTING), state(SidecarState.READY)


@pytest.fixture
def sidecar():
    """Yield a function that prepares responses and returns a client; the last response repeats."""
    with serving() as (address, script):

        def prepared(*responses):
            script.calls = [*responses]
            return Sidecar(address, "collect-0")

        yield prepared


def test_a_sidecar_that_never_listens_is_dead_after_the_deadline():
    """A pod's sidecar starts before its trainer, so a sidecar that is late has crashed."""
    with pytest.raises(SimulatorDead, match="collect-0: its sidecar cannot be reached"):
        Sidecar(NOWHERE, "collect-0").first_state(0.05)


def test_a_simulator_that_does_not_end_is_hung(sidecar):
    """The sidecar kills its simulator, so a simulator that still runs waits for its disk."""
    with pytest.raises(SimulatorHung, match=r"collect-0: did not end within 0\.05 s"):
        sidecar(READY).wait_stopped(0.05)


def test_the_end_of_a_simulator_is_waited_for(sidecar):
    """The next simulator needs the ROS names of this one."""
    ending = sidecar(READY, READY, state(SidecarState.FAILED))

    ending.wait_stopped(30.0)

    assert ending.failure() == "its state is failed"


@pytest.mark.parametrize(
    ("response", "error", "fact"),
    [
        (reply(404), WrongData, "does not describe its world"),
        (reply(503), SimulatorDead, "does not describe its world now"),
        (reply(500), WrongData, "its sidecar responded to /watch with HTTP status 500"),
        (raw(b"[]"), WrongData, "its sidecar sent an invalid response to /watch"),
    ],
)
def test_a_world_without_a_description_is_an_error_with_its_cause(sidecar, response, error, fact):
    """A film is left out for a simulator that cannot describe its world, and tried again after a restart."""
    with pytest.raises(error, match=fact):
        sidecar(response).scene_state()


@pytest.mark.parametrize(
    ("response", "fact"),
    [
        (reply(418), "its sidecar responded to /start with HTTP status 418"),
        (raw(b"<html>"), "its sidecar sent an invalid response to /start"),
    ],
)
def test_a_response_that_is_not_of_a_sidecar_is_wrong_data(sidecar, response, fact):
    """Another program may listen at the address."""
    with pytest.raises(WrongData, match=fact):
        sidecar(response).start()


def test_a_program_that_does_not_speak_http_is_dead(sidecar):
    """The trainer restarts the simulator then, instead of ending with a traceback."""
    with pytest.raises(SimulatorDead, match="its sidecar cannot be reached"):
        sidecar(hang_up).ready()


@pytest.fixture
def copies(sidecar):
    """Return a function that makes a simulator with copies, whose sidecar gives these responses."""
    entry = {
        "name": "collect-0", "group": "collect", "index": 0, "role": "Collect", "driver": "mujoco",
        "world": "arena", "batch": 2, "startDeadlineSeconds": 1,
    }  # fmt: skip
    environment = {"id": "MoveToTargetEnv-v0"}
    configuration = parse({"job": "b", "environment": environment, "steps": 9, "simulators": [entry]})

    def make(*responses):
        return BatchSimulator(sidecar(*responses), configuration, configuration.simulators[0])

    return make


@pytest.mark.parametrize(
    ("code", "error"), [(2, SimulatorRefused), (1, SimulatorDead)], ids=["a wrong world", "a crash"]
)
def test_copies_that_end_at_their_start_have_the_reason_of_their_sidecar(copies, code, error):
    """A wrong world is not started again, because it would fail in the same way."""
    ended = state(
        SidecarState.FAILED, detail="the world has no robot", last_exit=LastExit(code=code, expected=False)
    )

    with pytest.raises(error, match="the world has no robot") as caught:
        copies(STARTING, STARTING, ended).start()
    assert type(caught.value) is error


def test_copies_that_are_not_served_in_time_are_hung(copies):
    """A simulator of another release runs, but does not serve copies."""
    with pytest.raises(SimulatorHung, match="collect-0: does not serve its copies within 1 s"):
        copies(STARTING, READY).start()


def test_a_start_that_is_abandoned_ends_soon(copies):
    """The trainer must end within the grace period of its pod, even while a simulator starts."""
    made = []

    def abandon(exchange):
        made[0].abandon()
        STARTING(exchange)

    made.append(copies(STARTING, STARTING, abandon, STARTING))

    with pytest.raises(SimulatorDead, match="its start was canceled"):
        made[0].start()


def test_one_copy_stands_for_all_in_questions_about_attributes(copies):
    """A callback sets attributes of one environment; the batched environment holds those of all copies."""
    env = copies(STARTING).env

    assert env.has_wrapper_attr("options")
    assert not env.has_wrapper_attr("difficulty")
    assert not env.set_wrapper_attr("difficulty", 2, force=False)
    assert env.set_wrapper_attr("difficulty", 2)
    assert env.get_wrapper_attr("difficulty") == env.batched.difficulty == 2


def test_one_copy_cannot_be_played_alone(copies):
    """All copies are stepped in one request, so the error names the class that steps them."""
    env = copies(STARTING).env

    with pytest.raises(NotImplementedError, match="steps all copies together"):
        env.step(0)
    with pytest.raises(NotImplementedError, match="resets its copies itself"):
        env.reset(seed=1, options={})
