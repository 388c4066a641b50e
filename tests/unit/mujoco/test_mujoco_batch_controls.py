"""The motors of a batch of models: each kind of actuator follows commands as in the single simulation."""

import dataclasses

import numpy as np
import pytest

from palaestra_protocol.batch import BatchRequest
from palaestra_sim.mujoco.batched.model_batch import ModelBatch
from palaestra_sim.mujoco.batched.world import BatchRefusedError, Reset
from palaestra_sim.mujoco.mjcf.loader import load
from palaestra_sim.scene.mode import Mode
from tests.unit.mjcf.conftest import CARTPOLE

MOTOR = '<motor name="push" joint="slider" gear="2" ctrlrange="-10 10" ctrllimited="true"/>'
VELOCITY = '<velocity name="push" joint="slider" kv="50" ctrlrange="-2 2" ctrllimited="true"/>'
UNLIMITED = '<position name="push" joint="slider" kp="500" dampratio="1"/>'
POSITION = UNLIMITED.replace("/>", ' ctrlrange="-1.5 1.5" ctrllimited="true"/>')
ADHESION = '<adhesion name="push" body="cart" ctrlrange="0 1" gain="5"/>'
REQUEST = BatchRequest(
    period_ms=20, motors=("push",), commanded="velocity", sensors=("cart position",), joints=()
)


@pytest.fixture
def batch(tmp_path):
    """Return a function that makes two copies of a cart-pole, before `open`."""

    def make(actuator):
        path = tmp_path / "cartpole.xml"
        path.write_text(CARTPOLE.format(actuator=actuator, sensor=""))
        return ModelBatch(load(path, Mode.FAST), path.name, 2, 1)

    return make


def request(actuator, commanded):
    """Return a request that commands the actuator; one that is not a motor has another device name."""
    motor = "mujoco/push" if actuator == ADHESION else "push"
    return dataclasses.replace(REQUEST, motors=(motor,), commanded=commanded)


def driven(batch, wanted, command):
    """Return the positions of both carts after 2 s, of which only the second got the command."""
    batch.open(wanted)
    commands = np.array([[np.nan], [command]])
    batch.reset(
        Reset(
            rows=np.arange(2),
            seeds=np.arange(2),
            places=np.zeros(0),
            joints=np.zeros((2, 0)),
            commands=commands,
        )
    )
    for _ in range(100):
        readings = batch.step(commands)
    return readings.values[:, 0].tolist()


@pytest.mark.parametrize(
    ("actuator", "commanded", "command", "position"),
    [
        (POSITION, "position", 0.8, 0.8),
        (POSITION, "position", 9.0, 1.5),
        (UNLIMITED, "position", 1.7, 1.7),
        (VELOCITY, "velocity", 0.3, 0.6),
        (VELOCITY, "velocity", -9.0, -2.0),
        (ADHESION, "control", 0.5, 0.0),
    ],
)
def test_each_kind_of_actuator_follows_its_quantity_within_its_limits(
    batch, actuator, commanded, command, position
) -> None:
    """A policy that a batch trained must find the same limits in the single simulation."""
    still, moved = driven(batch(actuator), request(actuator, commanded), command)

    assert still == pytest.approx(0.0, abs=0.02)
    assert moved == pytest.approx(position, abs=0.05)


@pytest.mark.parametrize(
    ("actuator", "commanded", "fact"),
    [
        (ADHESION, "force", "the motor 'mujoco/push' is commanded by control; change"),
        (MOTOR, "control", "the motor 'push' is commanded by force, not by control"),
        (POSITION, "velocity", "the motor 'push' is commanded by position, not by velocity"),
    ],
)
def test_a_command_of_another_quantity_is_refused(batch, actuator, commanded, fact) -> None:
    """A force that is taken for an angle would move the robot in a wrong way."""
    with pytest.raises(BatchRefusedError, match=fact):
        batch(actuator).open(request(actuator, commanded))
