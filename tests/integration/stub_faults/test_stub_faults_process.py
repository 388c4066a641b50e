"""A stub's process with faults: how it ends, when it does not start, and what it leaves unchanged."""

import os
import signal
from pathlib import Path

import pytest

from palaestra_trainer.errors import SimulatorDead
from palaestra_trainer.ros import RosService
from tests.integration.stub_faults.conftest import DEADLINE_S
from tests.waiting import eventually


def up(process):
    """Wait for the line about running controllers, which follows the line about faults."""
    lines = iter(process.stderr.readline, "")
    assert any("arena.wbt: faulty_" in line for line in lines)


def is_stopped(pid):
    """Return whether a signal has stopped a process."""
    return "State:\tT" in Path(f"/proc/{pid}/status").read_text()


@pytest.mark.parametrize(
    ("fault", "how"),
    [
        ("crash:step=2", "SIGSEGV"),
        ("crash:signal=SIGBUS,reset=1", "SIGBUS"),
        ("crash:signal=SIGKILL,step=2", "SIGKILL"),
        ("exit:step=2", 0),
        ("exit:code=3,step=2", 3),
        ("master_lost:step=2", 1),
        ("start_refused:code=4", 4),
    ],
)
def test_the_sidecar_sees_the_end_that_was_ordered(player, fault, how):
    """A user reads the exit code or signal in the log, and the operator recognizes a crash by it."""
    played = player(fault).play(episodes=1)

    assert played.ended() == how
    assert played.launcher.state().faults == 1


def test_the_step_that_is_named_is_the_first_that_is_not_answered(player):
    """The author of a test must know which transition is lost."""
    played = player("crash:step=5")
    played.start()
    for _ in range(4):
        played.step()

    with pytest.raises(SimulatorDead):
        played.step()


def test_24_resets_go_well_and_the_next_ends_in_a_bus_error(player):
    """The paper reports this behavior of its simulator."""
    played = player("crash:signal=SIGBUS,reset=25").play()

    assert played.scene.resets == 25
    assert played.ended() == "SIGBUS"


def test_steps_are_counted_anew_after_a_restart(player):
    """A fault at a step occurs in each life of the simulator."""
    played = player("crash:step=4").play(episodes=2)
    played.webots.stop()
    answered = len(played.durations_s)

    played.start()
    for _ in range(3):
        played.step()

    assert len(played.durations_s) == answered + 3
    with pytest.raises(SimulatorDead):
        played.step()


def test_a_simulator_that_never_starts_is_tried_again_in_vain(player):
    """The error must show that each start was refused."""
    played = player("start_refused")
    for _ in range(2):
        with pytest.raises(SimulatorDead, match="code 1"):
            played.webots.start()

    assert played.launcher.state().starts == 2


def test_one_start_can_be_refused_and_the_next_allowed(stub):
    """The sidecar counts the starts and passes the number to the stub."""
    refused = stub("--fault=start_refused:start=1", PALAESTRA_SIMULATOR_START="1")

    assert refused.wait(20) == 1
    assert not stub.registered()
    allowed = stub("--fault=start_refused:start=1", PALAESTRA_SIMULATOR_START="2")
    up(allowed)
    assert stub.registered()


def test_a_slow_start_can_be_ended_at_once(stub):
    """During a slow start, SIGTERM must end the stub properly."""
    process = stub("--fault=slow_start:latency_ms=60000", "--fault-life=1")
    assert "faults: slow_start:latency_ms=60000 (seed 0, life 1)" in process.stderr.readline()

    process.send_signal(signal.SIGTERM)

    assert process.wait(DEADLINE_S) == 0
    assert not stub.registered()


def test_a_hanging_process_is_stopped_and_can_be_continued(player):
    """After SIGCONT the step completes, so a test can also cover a hang that ends."""
    played = player("hang:step=2")
    played.start()
    played.step()
    step = RosService("/robotino/robot/time_step", "webots_ros/set_int", DEADLINE_S)
    step.begin(value=192)
    eventually(lambda: is_stopped(played.pid))

    os.kill(played.pid, signal.SIGCONT)

    assert step.finish().success
    step.close()


def test_names_that_are_lost_are_gone_while_the_process_lives(stub):
    """Connections that are already open must continue to work."""
    process = stub("--fault=names_lost:step=1")
    up(process)
    get_time = stub.service("robot/get_time", "get_float")
    step = stub.service("robot/time_step", "set_int")
    get_time(ask=True)

    assert step(value=32).success
    assert get_time(ask=True).value == pytest.approx(0.032)
    assert not stub.registered()
    assert process.poll() is None
    get_time.close()
    step.close()


def test_memory_grows_up_to_its_limit(player):
    """The process must really use the memory, so that a container's limit can end it."""
    played = player("memory_growth:mib=10,most_mib=60")
    played.start()
    before = played.memory_mib[-1]
    for _ in range(12):
        played.step()

    assert played.memory_mib[-1] - before == pytest.approx(60, abs=8)
    assert played.memory_mib[-1] - played.memory_mib[-4] < 8


def test_the_environment_orders_faults_for_a_job(stub):
    """`spec.simulators[].env` of a job reaches the stub through the sidecar."""
    process = stub(
        PALAESTRA_STUB_FAULTS="crash:step=9 \n hang:step=8",
        PALAESTRA_STUB_FAULT_SEED="7",
        PALAESTRA_SIMULATOR_START="3",
    )

    assert "faults: crash:step=9 hang:step=8 (seed 7, life 3)" in process.stderr.readline()


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("crsh", "--fault: crsh: 'crsh' is not a fault; use one of crash, "),
        (
            "hang:service=ir99/enable",
            "the world has no service ir99/enable; name another, such as ir9/enable",
        ),
        ("lost:topic=ir1", "the world has no topic ir1; name another, such as ir1/value"),
        ("start_refused:start=2", "the number of this start is unknown; give --fault-life N"),
    ],
)
def test_what_is_written_wrongly_is_refused_before_anything_starts(stub, text, words):
    """If a wrong fault were ignored, its author would believe that the code survives it."""
    process = stub(f"--fault={text}")

    _, said = process.communicate(timeout=20)

    assert process.returncode == 2
    assert words in said
    assert not stub.registered()


def test_without_a_count_the_life_is_drawn_and_printed(stub):
    """Two processes must not have the same faults, but a printed life can be repeated."""
    first, second = (stub("--fault=crash:probability=0.5").stderr.readline() for _ in range(2))

    assert "drawn" in first
    assert first != second


def steps_of_a_life(played):
    """Return the number of steps until a simulator fails in one long episode, and stop it."""
    played.play(episodes=1, steps=400)
    played.webots.stop()
    return len(played.durations_s)


def test_lives_do_not_end_at_the_same_step(player):
    """A simulator that always crashed at the same step would never pass that step."""
    lengths = [steps_of_a_life(player("crash:probability=0.05", life=life)) for life in (1, 2, 3)]

    assert len(set(lengths)) == 3


def test_a_life_can_be_repeated(player):
    """The same seed and life must give the same faults, so that a user can repeat a failure."""
    lengths = [steps_of_a_life(player("crash:probability=0.05", life=2)) for _ in range(2)]

    assert lengths[0] == lengths[1]


def test_the_end_by_a_fault_leaves_no_core_file(stub, tmp_path):
    """A work folder is small, and core files would fill it."""
    process = stub("--fault=crash:step=1")
    up(process)
    step = stub.service("robot/time_step", "set_int")

    with pytest.raises(SimulatorDead):
        step(value=32)

    assert process.wait(DEADLINE_S) == -signal.SIGSEGV
    assert [path.name for path in tmp_path.iterdir()] == ["arena.wbt"]
