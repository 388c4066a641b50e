"""Latitude and longitude by the series of Krüger. The simulators use none of these formulas.

Source: C. F. F. Karney, Transverse Mercator with an accuracy of a few nanometers (2011), to the third order.
"""

import math

RADIUS_M, FLATTENING, SCALE = 6378137.0, 1.0 / 298.257223563, 0.9996
N = FLATTENING / (2.0 - FLATTENING)
MERIDIAN_M = SCALE * RADIUS_M / (1.0 + N) * (1.0 + N**2 / 4.0 + N**4 / 64.0)
ALPHA = (N / 2 - 2 * N**2 / 3 + 5 * N**3 / 16, 13 * N**2 / 48 - 3 * N**3 / 5, 61 * N**3 / 240)
BETA = (N / 2 - 2 * N**2 / 3 + 37 * N**3 / 96, N**2 / 48 + N**3 / 15, 17 * N**3 / 480)
DELTA = (2 * N - 2 * N**2 / 3 - 2 * N**3, 7 * N**2 / 3 - 8 * N**3 / 5, 56 * N**3 / 15)


def moved(latitude_deg, longitude_deg, east_m, north_m):
    """Return latitude and longitude, in degrees, of a point that is displaced on the grid of its UTM zone."""
    middle = 6 * math.floor(longitude_deg / 6) + 3
    east, north = _grid(math.radians(latitude_deg), math.radians(longitude_deg - middle))
    latitude, longitude = _angles(east + east_m / MERIDIAN_M, north + north_m / MERIDIAN_M)
    return math.degrees(latitude), middle + math.degrees(longitude)


def _grid(latitude, longitude):
    root = 2.0 * math.sqrt(N) / (1.0 + N)
    sine = math.sin(latitude)
    conformal = math.sinh(math.atanh(sine) - root * math.atanh(root * sine))
    north = math.atan2(conformal, math.cos(longitude))
    east = math.atanh(math.sin(longitude) / math.hypot(1.0, conformal))
    terms = [(2 * j * north, 2 * j * east, it) for j, it in enumerate(ALPHA, 1)]
    return (
        east + sum(it * math.cos(x) * math.sinh(y) for x, y, it in terms),
        north + sum(it * math.sin(x) * math.cosh(y) for x, y, it in terms),
    )


def _angles(east, north):
    terms = [(2 * j * north, 2 * j * east, it) for j, it in enumerate(BETA, 1)]
    east_ = east - sum(it * math.cos(x) * math.sinh(y) for x, y, it in terms)
    north_ = north - sum(it * math.sin(x) * math.cosh(y) for x, y, it in terms)
    conformal = math.asin(math.sin(north_) / math.cosh(east_))
    latitude = conformal + sum(it * math.sin(2 * j * conformal) for j, it in enumerate(DELTA, 1))
    return latitude, math.atan2(math.sinh(east_), math.cos(north_))
