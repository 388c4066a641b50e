"""The arms that ship put their tools where the data sheets' Denavit-Hartenberg parameters do."""

import numpy as np
import pytest

from palaestra_sim.scene.mode import Mode
from palaestra_sim.scene.nodes.instantiate import Descriptions
from palaestra_sim.scene.simulation import Simulation
from palaestra_sim.world import builtin_protos, parse
from tests.values.worlds import PHYSICS, STEP_MS, Setting, device, enable

JOINTS = ("shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3")
# d1, a2, a3, d4, d5 and d6 in meters, from the manufacturer's table of the e-series.
LENGTHS = {
    "UR3e": (0.15185, -0.24355, -0.2132, 0.13105, 0.08535, 0.0921),
    "UR5e": (0.1625, -0.425, -0.3922, 0.1333, 0.0997, 0.0996),
    "UR10e": (0.1807, -0.6127, -0.57155, 0.17415, 0.11985, 0.11655),
}
TWISTS = (np.pi / 2, 0.0, 0.0, np.pi / 2, -np.pi / 2, 0.0)
POSES = (
    (0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
    (0.7, -1.2, 0.9, -0.4, 0.6, 0.3),
    (-1.4, -0.6, -1.1, 1.3, -0.8, 1.0),
    (2.0, -2.2, 0.5, 0.2, 1.5, -0.7),
)
NEAR_M = 0.006  # Webots rounds the lengths of the links to a millimeter, and the errors of six links add up


def tool(name, angles):
    """Return the position of the tool by the table; Webots' base is turned by half a turn about z."""
    d1, a2, a3, d4, d5, d6 = LENGTHS[name]
    pose = np.diag([-1.0, -1.0, 1.0, 1.0])
    for angle, twist, offset, length in zip(
        angles, TWISTS, (d1, 0.0, 0.0, d4, d5, d6), (0.0, a2, a3, 0.0, 0.0, 0.0), strict=True
    ):
        c, s, ct, st = np.cos(angle), np.sin(angle), np.cos(twist), np.sin(twist)
        pose = pose @ [
            [c, -s * ct, s * st, length * c],
            [s, c * ct, -c * st, length * s],
            [0.0, st, ct, offset],
            [0.0, 0.0, 0.0, 1.0],
        ]
    return pose[:3, 3]


@pytest.mark.parametrize("physics", PHYSICS)
@pytest.mark.parametrize("name", LENGTHS)
def test_the_tool_of_an_arm_is_where_its_data_sheet_puts_it(physics, name):
    """A policy for an arm reaches with the simulated arm where the real arm would reach."""
    arm = f'DEF ARM {name} {{ supervisor TRUE controller "ros" controllerArgs [ "--name=r" "--synchronize" ]'
    world = parse(Setting(physics).text(f"{arm} toolSlot [ GPS {{ }} ] }}", "gravity 0").encode())
    shipped = Descriptions(protos=builtin_protos())
    simulation = Simulation.of(world, PHYSICS[physics](), "arm", Mode.FAST, shipped)
    enable(simulation)
    wrong = []
    for angles in POSES:
        for joint, angle in zip(JOINTS, angles, strict=True):
            device(simulation, f"{joint}_joint").set_position(angle)
        for _ in range(400):
            simulation.step(STEP_MS)
        found = np.array(device(simulation, "gps").value)
        if np.linalg.norm(found - tool(name, angles)) > NEAR_M:
            wrong.append((angles, found.round(4).tolist(), tool(name, angles).round(4).tolist()))

    assert wrong == []
