"""The bones of a Skin node, which only Webots simulates; the stub and MuJoCo have no bones."""

from __future__ import annotations

from palaestra_trainer.webots.device import whole_fact
from palaestra_trainer.webots.fields import applied_quaternion
from palaestra_trainer.webots.outputs import OutputDevice

Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]


class Skin(OutputDevice):
    """A skin; bones are numbered from 0.

    Every method may raise SimulatorDead, SimulatorHung or WrongData.
    """

    __slots__ = ()
    nodes = ("Skin",)
    bone_count = whole_fact("get_bone_count", "The number of bones.")

    def bone_name(self, bone: int) -> str:
        """Return the name of a bone."""
        return str(self.call("get_bone_name", "skin_get_bone_name", index=bone).name)

    def bone_pose(self, bone: int, *, absolute: bool = False) -> tuple[Vector, Quaternion]:
        """Return position, in meters, and rotation, as a quaternion x, y, z, w, of a bone.

        Args:
            bone: the number of the bone.
            absolute: whether the pose is in the axes of the skin; if not, it is relative to the parent bone.
        """
        where = {"index": bone, "absolute": absolute}
        at = self.call("get_bone_position", "skin_get_bone_position", **where).position
        turn = self.call("get_bone_orientation", "skin_get_bone_orientation", **where).orientation
        return (at.x, at.y, at.z), (turn.x, turn.y, turn.z, turn.w)

    def set_bone_position(self, bone: int, position: Vector, *, absolute: bool = False) -> None:
        """Move a bone to x, y, z in meters; see `bone_pose`."""
        wanted = dict(zip("xyz", position, strict=True))
        self._command(
            "set_bone_position", "skin_set_bone_position", index=bone, position=wanted, absolute=absolute
        )

    def set_bone_orientation(self, bone: int, rotation: Quaternion, *, absolute: bool = False) -> None:
        """Turn a bone to a quaternion x, y, z, w of any length; see `bone_pose`."""
        wanted = applied_quaternion(*rotation)
        self._command(
            "set_bone_orientation",
            "skin_set_bone_orientation",
            index=bone,
            orientation=wanted,
            absolute=absolute,
        )
