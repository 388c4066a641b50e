"""The infrared distance sensors of a Robotino, whose readings are volts."""

from __future__ import annotations

from palaestra_trainer.robots.base import SENSOR_RANGE_M

# The distance in meters is a * V**b + c for V volts of the GP2Y0A41, the default sensor of the model. Source:
# the sample controller of that model, R2023b.
RANGE_SCALE, RANGE_EXPONENT, RANGE_OFFSET_M = 0.1594, -0.8533, -0.02916
LEAST_VOLTS = 0.05  # below the sensor's range; avoids an infinite result


def meters(volts: float) -> float:
    """Return the distance in meters, within the sensor's range, for a reading in volts."""
    distance: float = RANGE_SCALE * max(volts, LEAST_VOLTS) ** RANGE_EXPONENT + RANGE_OFFSET_M
    return min(max(distance, SENSOR_RANGE_M[0]), SENSOR_RANGE_M[1])
