"""The geometries that Webots defines as PROTOs: rays meet their faces."""

import math

import pytest

from palaestra_sim.scene.loader import Loader
from palaestra_sim.scene.mode import Mode
from tests.tables import for_each
from tests.values.worlds import PHYSICS, STEP_MS, Setting, device, enable, robot

ADDRESS = "https://raw.githubusercontent.com/cyberbotics/webots/R2023b/projects/objects/geometries/protos"
IMPORTS = "".join(f'EXTERNPROTO "{ADDRESS}/{name}.proto"\n' for name in ("TexturedBox", "Rectangle"))
EYES = robot(
    """DistanceSensor { name "bounds" lookupTable [ 0 0 0 9 9 0 ] }
    Lidar { name "sight" numberOfLayers 1 horizontalResolution 1 fieldOfView 0.01 maxRange 9 }""",
    "translation 0 0 0.5",
)


@pytest.mark.parametrize("physics", PHYSICS)
@for_each(
    "geometry, heading_rad, away_m",
    [
        ("TexturedBox { size 1 2 3 }", 0.0, 2.5),
        ("TexturedBox { size 1 2 3 }", 0.5 * math.pi, 2.0),
        ("TexturedBox { size 1 2 3 }", 0.3, 3.0 - 0.5 / math.cos(0.3)),
        ("TexturedBox { size 1 2 3 back FALSE }", math.pi, 2.5),
        ("TexturedBox { }", 0.0, 2.95),
        ("Rectangle { size 2 3 }", 0.0, 3.0),
        ("Rectangle { size 2 3 }", 0.5, 3.0),
        ("Rectangle { size 2 3 doubleSided FALSE }", math.pi, 3.0),
        ("Rectangle { }", math.pi, 3.0),
    ],
)
def test_rays_meet_a_geometry_of_webots_at_its_faces(physics, geometry, heading_rad, away_m, tmp_path):
    """A wall of a type that sensors do not know trains a policy to drive into it."""
    turned = f"translation 3 0 0.5 rotation 0 0 1 {heading_rad}"
    wall = f"Solid {{ {turned} children [ Shape {{ geometry {geometry} }} ] boundingObject {geometry} }}"
    world = tmp_path / "my.wbt"
    world.write_text(Setting(physics).text(wall + EYES).replace("WorldInfo", f"{IMPORTS}WorldInfo", 1))
    simulation = Loader(physics=PHYSICS[physics])(world, Mode.FAST)
    enable(simulation)

    simulation.step(STEP_MS)

    # A flat boundingObject is a millimeter thick.
    assert device(simulation, "bounds").value == pytest.approx(away_m, abs=6e-4)
    assert device(simulation, "sight").layers[0][0] == pytest.approx(away_m)
