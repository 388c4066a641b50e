"""Centers of mass of robots and their parts, compared with formulas, in each simulator and axis system."""

import numpy as np
import pytest

from tests.values.frames import frame
from tests.values.shapes import ELL
from tests.values.worlds import SETTINGS, robot

SIDE = frame((0.0, 0.5, 0.1), (0.0, 0.6, 0.8), 0.9)
END = frame((0.4, -0.1, 0.2), (0.6, 0.0, 0.8), 0.5)
PARTS = f"""
DEF SIDE Solid {{ {SIDE.fields} name "side"
  physics Physics {{ density -1 mass 1 centerOfMass [ 0.1 0.2 0.3 ] }}
  boundingObject Box {{ size 0.1 0.1 0.1 }} }}
DEF LIGHT Solid {{ translation 9 9 9 name "light" boundingObject Box {{ size 0.1 0.1 0.1 }} }}
HingeJoint {{ jointParameters HingeJointParameters {{ axis 0 0 1 }}
  device RotationalMotor {{ name "motor" }}
  endPoint DEF END Solid {{ {END.fields} name "end" physics Physics {{ density 500 }}
    boundingObject Group {{ children [ Box {{ size 0.2 0.2 0.2 }}
      Pose {{ translation 0.5 0 0 children [ Sphere {{ radius 0.1 }} ] }} ] }} }} }}
Solid {{ name "ell" physics Physics {{ density -1 mass 3 }} boundingObject {ELL} }}
"""
FIELDS = """physics Physics { density -1 mass 2 }
  boundingObject Pose { translation 0.3 0 0.1 children [ Box { size 0.4 0.2 0.2 } ] }"""
# The masses in kg, and their centers in the frame of the robot.
BOX_M3, BALL_M3 = 0.2**3, 4.0 / 3.0 * np.pi * 0.1**3
ON_SIDE = (1.0, SIDE @ [0.1, 0.2, 0.3])
ON_END = (500.0 * (BOX_M3 + BALL_M3), END @ [0.5 * BALL_M3 / (BOX_M3 + BALL_M3), 0.0, 0.0])
# The L consists of a rectangle of 2 m by 0.5 m along x, and a rectangle of 0.5 m by 1.5 m above it.
ON_ELL = (3.0, np.array([(1.0 * 1.0 + 0.75 * 0.25) / 1.75, (1.0 * 0.25 + 0.75 * 1.25) / 1.75, 0.0]))
ON_BASE = (2.0, np.array([0.3, 0.0, 0.1]))
WHOLE = (ON_BASE, ON_SIDE, ON_END, ON_ELL)
EXPECTED = {
    "R": np.average([at for _, at in WHOLE], axis=0, weights=[mass for mass, _ in WHOLE]),
    "SIDE": ON_SIDE[1],
    "END": ON_END[1],
    "LIGHT": np.array([9.0, 9.0, 9.0]),
}


# Positions and headings of the robot in the axes of the file. A robot that drives is always upright.
POSES = (((0.0, 0.0, 0.0), 0.0), ((1.0, -2.0, 0.5), 0.7), ((-3.0, 1.0, 0.0), -2.5))


@pytest.mark.parametrize("setting", SETTINGS, ids=str)
def test_a_center_of_mass_is_that_of_the_formula(setting):
    """Webots weights all Solids with physics inside the node; a Solid without a mass has its origin there."""
    for position, heading in POSES:
        base = frame(position, setting.up, heading)
        simulation = setting.load(robot(PARTS, f"{base.fields} {FIELDS}"))

        for name, center in EXPECTED.items():
            found = simulation.motion.center_of_mass(simulation.tree.of_def(name))

            assert found == pytest.approx(base @ center, abs=1e-9), (name, base)
