"""Latitude and longitude on the ellipsoid WGS84, and meters on the grid of a UTM zone. Pure.

Source: J. P. Snyder, Map Projections: A Working Manual (USGS Professional Paper 1395), pages 60 to 64. Webots
has the same formulas, in WbGps.cpp. Within a zone the formulas are exact to a millimeter.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

_RADIUS_M: Final = 6378137.0  # radius of the ellipsoid at the equator
_FLATTENING: Final = 1.0 / 298.257223563
_SCALE: Final = 0.9996
_FALSE_EAST_M: Final = 500_000.0
# The northing of the equator in southern zones, so that all northings are positive.
_FALSE_NORTH_M: Final = 10_000_000.0
_E2: Final = _FLATTENING * (2.0 - _FLATTENING)
_E4: Final = _E2 * _E2
_E6: Final = _E4 * _E2
_SECOND_E2: Final = _E2 / (1.0 - _E2)
_E1: Final = (1.0 - math.sqrt(1.0 - _E2)) / (1.0 + math.sqrt(1.0 - _E2))
_RECTIFYING: Final = 1.0 - _E2 / 4.0 - 3.0 * _E4 / 64.0 - 5.0 * _E6 / 256.0


@dataclass(frozen=True, slots=True)
class UtmZone:
    """The zone and the hemisphere of a point.

    Attributes:
        longitude_deg: the longitude of the zone's central meridian.
        southern: whether the point is south of the equator.
    """

    longitude_deg: float
    southern: bool

    @classmethod
    def of(cls, latitude_deg: float, longitude_deg: float) -> UtmZone:
        """Return the zone of a point."""
        number = 1 + math.floor((longitude_deg + 180.0) / 6.0)
        return cls(6.0 * number - 183.0, latitude_deg < 0.0)

    def to_grid(self, latitude_deg: float, longitude_deg: float) -> tuple[float, float]:
        """Return east and north in meters of a point in degrees."""
        latitude = math.radians(latitude_deg)
        sine, cosine = math.sin(latitude), math.cos(latitude)
        across = _across(sine)
        t, c = math.tan(latitude) ** 2, _SECOND_E2 * cosine**2
        a = math.radians(longitude_deg - self.longitude_deg) * cosine
        east = a + (1.0 - t + c) * a**3 / 6.0
        east += (5.0 - 18.0 * t + t**2 + 72.0 * c - 58.0 * _SECOND_E2) * a**5 / 120.0
        north = a**2 / 2.0 + (5.0 - t + 9.0 * c + 4.0 * c**2) * a**4 / 24.0
        north += (61.0 - 58.0 * t + t**2 + 600.0 * c - 330.0 * _SECOND_E2) * a**6 / 720.0
        north_m = _SCALE * (_meridian(latitude) + across * math.tan(latitude) * north)
        return _FALSE_EAST_M + _SCALE * across * east, north_m + self._false_north_m

    def to_degrees(self, east_m: float, north_m: float) -> tuple[float, float]:
        """Return latitude and longitude in degrees of a point in meters."""
        foot = _footpoint((north_m - self._false_north_m) / _SCALE)
        sine, cosine = math.sin(foot), math.cos(foot)
        across = _across(sine)
        along = across * (1.0 - _E2) / (1.0 - _E2 * sine**2)
        t, c = math.tan(foot) ** 2, _SECOND_E2 * cosine**2
        d = (east_m - _FALSE_EAST_M) / (across * _SCALE)
        turn = d**2 / 2.0 - (5.0 + 3.0 * t + 10.0 * c - 4.0 * c**2 - 9.0 * _SECOND_E2) * d**4 / 24.0
        turn += (61.0 + 90.0 * t + 298.0 * c + 45.0 * t**2 - 252.0 * _SECOND_E2 - 3.0 * c**2) * d**6 / 720.0
        aside = d - (1.0 + 2.0 * t + c) * d**3 / 6.0
        aside += (5.0 - 2.0 * c + 28.0 * t - 3.0 * c**2 + 8.0 * _SECOND_E2 + 24.0 * t**2) * d**5 / 120.0
        latitude = foot - across * math.tan(foot) / along * turn
        return math.degrees(latitude), self.longitude_deg + math.degrees(aside / cosine)

    @property
    def _false_north_m(self) -> float:
        return _FALSE_NORTH_M if self.southern else 0.0


def _across(sine: float) -> float:
    """Return the radius of curvature across the meridian, in meters."""
    return _RADIUS_M / math.sqrt(1.0 - _E2 * sine**2)


def _meridian(latitude: float) -> float:
    """Return the distance along the meridian from the equator, in meters."""
    return _RADIUS_M * (
        _RECTIFYING * latitude
        - (3.0 * _E2 / 8.0 + 3.0 * _E4 / 32.0 + 45.0 * _E6 / 1024.0) * math.sin(2.0 * latitude)
        + (15.0 * _E4 / 256.0 + 45.0 * _E6 / 1024.0) * math.sin(4.0 * latitude)
        - 35.0 * _E6 / 3072.0 * math.sin(6.0 * latitude)
    )


def _footpoint(distance_m: float) -> float:
    """Return the latitude in rad at a distance from the equator along the meridian."""
    mean = distance_m / (_RADIUS_M * _RECTIFYING)
    return (
        mean
        + (3.0 * _E1 / 2.0 - 27.0 * _E1**3 / 32.0) * math.sin(2.0 * mean)
        + (21.0 * _E1**2 / 16.0 - 55.0 * _E1**4 / 32.0) * math.sin(4.0 * mean)
        + 151.0 * _E1**3 / 96.0 * math.sin(6.0 * mean)
        + 1097.0 * _E1**4 / 512.0 * math.sin(8.0 * mean)
    )
