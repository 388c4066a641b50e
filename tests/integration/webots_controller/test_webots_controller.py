"""The controller for Webots: its robots step, pause, reload and end as those of Webots' own controller."""

import contextlib
import os
import signal
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from palaestra_trainer.ros import Master, is_served
from palaestra_trainer.webots.attached import Attached
from palaestra_trainer.webots.facade import Webots
from tests.waiting import eventually

DEADLINE_S = 60.0
STEP_MS = 32
ROBOT = """DEF R{index} Robot {{
  translation {index} 0 0 name "r{index}" controller "ros" supervisor {supervisor}
  controllerArgs [ "--name={prefix}_{index}" "--synchronize" ]
  children [ GPS {{ }} ]
}}
"""


def world(prefix, *supervisors):
    """Return a world with one robot for each of `supervisors`: True for a robot that is a supervisor."""
    robots = (
        ROBOT.format(index=index, prefix=prefix, supervisor=str(supervisor).upper())
        for index, supervisor in enumerate(supervisors)
    )
    return f"#VRML_SIM R2023b utf8\nWorldInfo {{ basicTimeStep {STEP_MS} }}\n{''.join(robots)}"


@pytest.fixture
def ask(client, prefix):
    """Return a function that calls a service of a robot."""

    def call(index, path, type_name, **request):
        return client.call(f"/{prefix}_{index}/{path}", f"webots_ros/{type_name}", request)

    return call


@pytest.fixture
def step(ask):
    """Return a function that requests a step of a robot."""
    return lambda index, step_ms=STEP_MS: ask(index, "robot/time_step", "set_int", value=step_ms)


def test_two_robots_step_together(webots, prefix, ask, step):
    """Simulated time passes only when both robots have requested a step, so neither misses an observation."""
    webots(world(prefix, True, False), f"{prefix}_0", f"{prefix}_1")

    with ThreadPoolExecutor() as pool:
        first = pool.submit(step, 0)
        assert not first.done()
        assert step(1) == {"success": True}
        assert first.result(DEADLINE_S) == {"success": True}

    times = {ask(index, "robot/get_time", "get_float")["value"] for index in range(2)}
    assert times == {STEP_MS / 1000.0}


def test_a_step_that_is_no_multiple_of_the_basic_step_is_refused(webots, prefix, ask, step):
    """The stub and Webots' own controller refuse such a step, so our controller must refuse it too."""
    webots(world(prefix, True), f"{prefix}_0")

    assert [step(0, step_ms) for step_ms in (STEP_MS + 1, -STEP_MS)] == [{"success": False}] * 2
    assert ask(0, "robot/get_time", "get_float") == {"value": 0.0}


def test_services_respond_in_a_pause_and_a_step_waits_for_its_end(webots, prefix, ask, step):
    """A trainer that has paused a simulator may still read the world, but time must stand still."""
    webots(world(prefix, True, True), f"{prefix}_0", f"{prefix}_1", mode="pause")

    assert ask(0, "supervisor/simulation_get_mode", "get_int") == {"value": 0}
    with ThreadPoolExecutor() as pool:
        waiting = pool.submit(step, 0)
        assert ask(1, "robot/get_basic_time_step", "get_float") == {"value": float(STEP_MS)}
        assert ask(1, "supervisor/simulation_set_mode", "set_int", value=2) == {"success": True}
        assert step(1) == {"success": True}
        assert waiting.result(DEADLINE_S) == {"success": True}


@pytest.mark.parametrize("paused", [False, True])
def test_a_reload_ends_both_controllers_and_starts_them_again(webots, prefix, ask, paused):
    """A reload must remove and register again the ROS names of a supervisor and of another robot."""
    process = webots(
        world(prefix, True, False), f"{prefix}_0", f"{prefix}_1", mode="pause" if paused else "fast"
    )
    before = children(process.pid)

    assert ask(0, "supervisor/world_reload", "get_bool") == {"value": True}

    eventually(lambda: len(now := children(process.pid)) == 2 and not now & before, DEADLINE_S)
    for index in range(2):
        eventually(lambda index=index: is_served(f"/{prefix}_{index}/robot/get_device_list"), DEADLINE_S)
    assert ask(1, "robot/get_time", "get_float") == {"value": 0.0}


def test_a_facade_that_reloads_connects_only_to_the_new_controllers(webots, prefix):
    """The old controllers respond until Webots ends them, and one of them may end later than the others.

    A client that connects to an old controller would lose its connection, which counts as a simulator fault.
    """
    robots = [f"{prefix}_0", f"{prefix}_1"]
    webots(world(prefix, True, False), *robots)
    with contextlib.closing(Webots(robots[0], "world.wbt", launcher=Attached())) as facade:
        facade.at_start("robots", lambda: None, robots)
        for _ in range(2):
            before = [Master("/test").node_uri(f"/{robot}") for robot in robots]
            facade.reload()
            after = [Master("/test").node_uri(f"/{robot}") for robot in robots]
            assert not {*before} & {*after}


def test_the_world_goes_on_without_a_controller_that_was_killed(webots, prefix, step):
    """Webots does not wait for a dead process; the trainer's other robots must not hang."""
    process = webots(world(prefix, True, False), f"{prefix}_0", f"{prefix}_1")
    [killed] = [pid for pid in children(process.pid) if f"--name={prefix}_1" in arguments(pid)]

    with ThreadPoolExecutor() as pool:
        waiting = pool.submit(step, 0)
        os.kill(killed, signal.SIGKILL)
        assert waiting.result(DEADLINE_S) == {"success": True}


def test_quitting_ends_with_the_status_and_leaves_no_name(webots, prefix, ask):
    """A sidecar reads the exit code; a name that stays would mislead clients of the next simulator."""
    process = webots(world(prefix, True), f"{prefix}_0")

    assert ask(0, "supervisor/simulation_quit", "set_int", value=3) == {"success": True}

    assert process.wait(DEADLINE_S) == 3
    assert not is_served(f"/{prefix}_0/robot/time_step")


def test_sigterm_unregisters_the_names_also_during_a_step(webots, prefix, step):
    """During a pause, a controller waits in its step when it gets SIGTERM; its ROS names must not stay."""
    process = webots(world(prefix, True), f"{prefix}_0", mode="pause")
    [pid] = children(process.pid)
    with ThreadPoolExecutor() as pool:
        waiting = pool.submit(step, 0)
        os.kill(pid, signal.SIGTERM)
        assert "failed" in waiting.result(DEADLINE_S)

    eventually(lambda: not is_served(f"/{prefix}_0/robot/time_step"), DEADLINE_S)


def test_a_refused_argument_is_one_line_in_the_console(webots, prefix):
    """A person who forgot an argument reads the remedy in Webots' console."""
    process = webots(world(prefix, True).replace('"--synchronize"', ""))

    lines = iter(process.stdout.readline, "")
    assert next(lines) == (
        "ros: controllerArgs has no --synchronize; add it, because this controller steps only on request\n"
    )
    assert next(lines) == "WARNING: 'r0' controller exited with status: 2.\n"


def test_an_injected_crash_ends_only_the_controller(webots, prefix, step):
    """A user tests training code by such a crash, so Webots must continue as after a real crash."""
    process = webots(
        world(prefix, True, True), f"{prefix}_0", f"{prefix}_1", PALAESTRA_STUB_FAULTS="crash:step=2"
    )
    assert step_both(step)

    with ThreadPoolExecutor() as pool:
        crashed = [pool.submit(step, index) for index in range(2)]
        assert all("failed" in it.result(DEADLINE_S) for it in crashed)

    eventually(lambda: not children(process.pid), DEADLINE_S)
    assert process.poll() is None


def test_an_injected_value_reaches_the_client(webots, prefix, ask):
    """A fault that only changes a message must not end the controller."""
    faulty = "wrong_value:service=robot/get_time,value=7"
    webots(world(prefix, True), f"{prefix}_0", PALAESTRA_STUB_FAULTS=faulty)

    assert ask(0, "robot/get_time", "get_float") == {"value": 7.0}
    assert ask(0, "robot/get_basic_time_step", "get_float") == {"value": float(STEP_MS)}


@pytest.mark.parametrize("slot", ["", "a"])
def test_a_wrong_fault_ends_the_webots_of_a_sidecar_with_2(webots, prefix, slot):
    """A job must not wait for a robot without a controller. But a person's own Webots must stay open."""
    sidecar = {"PALAESTRA_SIMULATOR_SLOT": slot} if slot else {}
    process = webots(world(prefix, True), PALAESTRA_STUB_FAULTS="lost:topic=gsp/values", **sidecar)

    line = next(line for line in iter(process.stdout.readline, "") if "has no topic" in line)
    assert "the world has no topic gsp/values; name another, such as gps/values" in line
    if slot:
        assert process.wait(DEADLINE_S) == 2
    else:
        assert "exited with status: 2" in process.stdout.readline()
        assert process.poll() is None


def step_both(step):
    """Return whether a step of both robots succeeds."""
    with ThreadPoolExecutor() as pool:
        steps = [pool.submit(step, index) for index in range(2)]
        return [it.result(DEADLINE_S) for it in steps] == [{"success": True}] * 2


def children(pid):
    """Return the ids of the processes that a process has started."""
    return set(map(int, Path(f"/proc/{pid}/task/{pid}/children").read_text().split()))


def arguments(pid):
    """Return the arguments of a process."""
    return Path(f"/proc/{pid}/cmdline").read_text().split("\0")
