"""RangeFinder: the settings of a depth camera, and its distances if the simulator renders.

Without rendering, `enable` and `save_image` return failure. Distortion, motion blur and noise have no effect.
"""

from __future__ import annotations

from array import array
from dataclasses import dataclass
from typing import Final

from palaestra_sim.ros_interfaces import Fields, Row
from palaestra_sim.scene.camera_interface import CameraInterface, Lens
from palaestra_sim.scene.devices.camera_common import picture_topic, projection_topic, read_lens, saver
from palaestra_sim.scene.devices.device_type import Carrier, DevicePart, DeviceTopic, DeviceType
from palaestra_sim.scene.frames import Frame
from palaestra_sim.scene.old_axes import looking

_WHITE: Final = 255


@dataclass(slots=True, kw_only=True, eq=False)
class RangeFinder:
    """A depth camera.

    Attributes:
        place: the frame of the device.
        lens: the lens; `lens.far_m` is the maximum range.
        least_m: the minimum range.
        resolution_m: the resolution of a distance; -1 for exact values.
        spherical: whether the world requests a spherical image, which is not rendered.
        eye: the camera interface; None if the simulator does not render.
    """

    name: str
    model: str
    place: Frame
    lens: Lens
    least_m: float
    resolution_m: float
    spherical: bool
    eye: CameraInterface | None = None

    @property
    def value(self) -> bytes | memoryview:
        """The current distances, a float32 for each pixel; infinite outside the range."""
        return b"" if self.eye is None else self.eye.depths(self.least_m, self.resolution_m)

    @property
    def info(self) -> Fields:
        """The response of `get_info`."""
        width, height = self.lens.size
        return {
            "width": width,
            "height": height,
            "Fov": self.lens.field_of_view_rad,
            "minRange": self.least_m,
            "maxRange": self.lens.far_m,
        }

    def attach(self, robot: Carrier) -> None:
        """Connect the camera to the robot that carries it."""
        self.eye = None if self.spherical else robot.eye(self.place, self.lens)

    def enabled(self, period_ms: int) -> None:
        """Prepare to render.

        Raises:
            UnsimulatedError: this machine cannot render.
        """
        if period_ms and self.eye is not None:
            self.eye.open()

    def gray(self) -> bytes:
        """Return the distances as pixels: black is near, white is the maximum range or beyond."""
        share = _WHITE / self.lens.far_m
        distances = array("f", bytes(self.value))
        levels = bytes(
            min(_WHITE, int(share * distance)) if distance < self.lens.far_m else _WHITE
            for distance in distances
        )
        pixels = bytearray(4 * len(levels))
        for channel in range(4):
            pixels[channel::4] = levels
        return bytes(pixels)


def _read(part: DevicePart) -> RangeFinder:
    least_m = part.number("minRange", 0.01)
    return RangeFinder(
        name=part.name,
        model=part.text("model"),
        place=looking(part.node, part.place),
        lens=read_lens(part, min(part.number("near", 0.01), least_m), part.number("maxRange", 1.0)),
        least_m=least_m,
        resolution_m=part.number("resolution", -1.0),
        spherical=part.node.flag("spherical", False),
    )


def _services(finder: RangeFinder) -> tuple[Row, ...]:
    return (
        ("get_info", "range_finder_get_info", lambda _: finder.info),
        ("save_image", "save_image", saver(finder.lens, lambda: finder.eye is None, finder.gray)),
    )


def _topics(finder: RangeFinder) -> tuple[DeviceTopic, ...]:
    return picture_topic("range_image", finder, finder.lens, "32FC1"), projection_topic(finder.lens)


RANGE_FINDER: Final = DeviceType(
    node="RangeFinder",
    name="range-finder",
    without_effect="motionBlur noise lens",
    fields="""fieldOfView SFFloat 0.7854; width SFInt32 64; height SFInt32 64; spherical SFBool FALSE;
        near SFFloat 0.01; minRange SFFloat 0.01; maxRange SFFloat 1; motionBlur SFFloat 0;
        noise SFFloat 0; resolution SFFloat -1; lens SFNode""",
    read=_read,
    services=_services,
    topics=_topics,
    attach=RangeFinder.attach,
    enabled=RangeFinder.enabled,
    silent=lambda finder: finder.eye is None,
)
