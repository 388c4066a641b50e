"""Options or environment variables set the faults and the number of a simulator's run."""

import argparse

import pytest

from palaestra_sim.faults import FaultError, add_options, begin, read_options, survey
from palaestra_sim.scene.loader import Loader
from palaestra_sim.scene.validation import LeaveOut
from palaestra_sim.stub.physics import StubPhysics
from palaestra_sim.world import builtin


@pytest.fixture
def read():
    """`read("--fault", "crash", PALAESTRA_STUB_FAULTS="hang")` returns the requested faults."""

    def make(*arguments, **environment):
        parser = argparse.ArgumentParser()
        add_options(parser.add_argument)
        return read_options(parser.parse_args(arguments), environment)

    return make


@pytest.fixture
def arena(tmp_path):
    """Return the path of a file with the built-in arena."""
    path = tmp_path / "arena.wbt"
    path.write_bytes(builtin("arena"))
    return path


def test_nothing_is_ordered_by_default(read):
    """An empty variable means that no fault was requested."""
    assert read() is None
    assert read(PALAESTRA_STUB_FAULTS=" ") is None
    assert read("--fault-seed=7", PALAESTRA_SIMULATOR_START="x") is None


def test_options_and_environment_add_up(read):
    """A person may add faults to those that a job's variable sets."""
    ordered = read("--fault=crash:step=5", "--fault=exit:step=6", PALAESTRA_STUB_FAULTS="hang:step=4")

    assert [it.text for it in ordered.faults] == ["crash:step=5", "exit:step=6", "hang:step=4"]


def test_seed_and_life_come_from_options_before_the_environment(read):
    """A person's option overrides the variable that a job sets."""
    environment = {"PALAESTRA_STUB_FAULT_SEED": "7", "PALAESTRA_SIMULATOR_START": "3"}

    told, chosen = (
        read("--fault=crash", **environment),
        read("--fault=crash", "--fault-seed=8", "--fault-life=4", **environment),
    )

    assert (told.seed, told.life) == (7, 3)
    assert (chosen.seed, chosen.life) == (8, 4)
    assert str(told) == "crash (seed 7, life 3)"


def test_a_life_that_nobody_counts_is_drawn_and_can_be_repeated(read):
    """Without a number, one is drawn at random, so that a restart does not repeat the faults.

    The log has the drawn number, so a person can repeat the run.
    """
    lives = {read("--fault=crash").life for _ in range(8)}

    assert len(lives) > 1
    assert str(read("--fault=crash")).endswith(", drawn)")


@pytest.mark.parametrize(
    ("arguments", "environment", "words"),
    [
        (["--fault=crsh"], {}, "--fault: crsh: 'crsh' is not a fault"),
        ([], {"PALAESTRA_STUB_FAULTS": "crsh"}, "PALAESTRA_STUB_FAULTS: crsh: 'crsh' is not a fault"),
        (
            ["--fault=crash", "--fault-seed=-1"],
            {},
            "--fault-seed: '-1' is refused; give a whole number of at least 0",
        ),
        (
            ["--fault=crash", "--fault-life=0"],
            {},
            "--fault-life: '0' is refused; give a whole number of at least 1",
        ),
        (["--fault=crash"], {"PALAESTRA_SIMULATOR_START": ""}, "PALAESTRA_SIMULATOR_START: ''"),
        (["--fault=crash", "--fault=crash"], {}, "fault crash: is given twice; remove one"),
        (["--fault=slow_start:every=2,latency_ms=1"], {}, "the number of this start is unknown"),
    ],
)
def test_an_error_names_the_place_of_the_mistake(read, arguments, environment, words):
    """The message names the option or the variable, because the variable may be set in another file."""
    with pytest.raises(FaultError, match=words):
        read(*arguments, **environment)


@pytest.mark.parametrize(
    ("fault", "words"),
    [
        (
            "hang:service=ir99/enable",
            "the world has no service ir99/enable; name another, such as ir9/enable",
        ),
        ("lost:topic=ir1", "the world has no topic ir1; name another, such as ir1/value"),
        ("lost:topic=camera*", "the world has no topic camera"),
    ],
)
def test_the_error_for_a_name_that_the_world_lacks_suggests_one_that_it_has(read, arena, fault, words):
    """To find all names, the controllers of the world are started on nodes that only record registrations."""
    with pytest.raises(FaultError, match=words):
        begin(read(f"--fault={fault}"), survey(Loader(physics=StubPhysics), arena))


@pytest.mark.parametrize(
    "fault", ["lost:topic=touch_sensor/value", "lost:topic=/model_name", "hang:service=*/enable"]
)
def test_what_the_world_has_can_be_named(read, arena, fault):
    """A topic can be named even before a client enables its sensor."""
    assert (
        begin(read(f"--fault={fault}"), survey(Loader(physics=StubPhysics), arena)).schedule.faults[0].text
        == fault
    )


def test_the_random_part_of_a_ros_name_makes_no_difference(read, arena):
    """A job that runs again with another UID has the same faults."""
    names = []
    for name in (b"job_r0_collect_0a_robotino_8c31f2", b"job_r0_collect_0a_robotino_00ff00"):
        arena.write_bytes(builtin("arena").replace(b"--name=robotino", b"--name=" + name))
        names.append(
            begin(read("--fault=crash"), survey(Loader(physics=StubPhysics), arena)).schedule.life.simulator
        )

    assert names == ["job_r0_collect_0a_robotino"] * 2


def test_faults_are_looked_up_in_the_world_as_it_will_run(read, tmp_path):
    """A world that loads only with `--leave-out` can have faults too."""
    world = tmp_path / "odd.wbt"
    world.write_bytes(builtin("arena") + b"Unheard { }")
    load = Loader(physics=StubPhysics, leave_out=LeaveOut(everything=True))

    assert begin(read("--fault=crash"), survey(load, world)).schedule.faults[0].text == "crash"
