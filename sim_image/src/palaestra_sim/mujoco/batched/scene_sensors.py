"""The readings of all rows as arrays: the samplers of DistanceSensor, TouchSensor and PositionSensor.

The noise of a row comes from Python's generator, in the order in which the robot's samplers draw it. Only so
do the rows have the same bits as the single simulation. This needs a loop over rows, which takes about 0.2
microseconds for each number.
"""

from __future__ import annotations

import random
from collections.abc import Callable, Sequence
from typing import Any, Final

import numpy as np

from palaestra_sim.mujoco.model import Built
from palaestra_sim.mujoco.rays import GROUPS, origins_and_directions
from palaestra_sim.scene.devices import DEVICES
from palaestra_sim.scene.devices.distance_sensor import DistanceSensor
from palaestra_sim.scene.devices.position_sensor import PositionSensor
from palaestra_sim.scene.devices.touch_sensor import TouchSensor
from palaestra_sim.scene.lookup_table import LookupTable
from palaestra_sim.scene.robot import Robot

Gauss = Callable[[float, float], float]
UNITS: Final = {DistanceSensor: "of its lookupTable", TouchSensor: "0 or 1", PositionSensor: "rad"}


class Noise:
    """The noise of all rows; each row has its own generator.

    Args:
        count: the number of rows.
        draws: the number of random numbers that a row draws at each sample.
    """

    def __init__(self, count: int, draws: int) -> None:
        self._generators = [random.Random(0) for _ in range(count)]
        self._draws = range(draws)

    def sow(self, rows: Any, seeds: Any) -> None:
        """Restart the noise of rows with these seeds."""
        for row, seed in zip(rows.tolist(), seeds.tolist(), strict=True):
            self._generators[row].seed(seed)

    def draw(self, rows: Any) -> Any:
        """Return the next random numbers of rows (None: all rows), as an array (rows, draws)."""
        chosen = self._generators if rows is None else [self._generators[row] for row in rows.tolist()]
        draws = self._draws
        numbers = [gauss(0.0, 1.0) for gauss in _gausses(chosen) for _ in draws]
        return np.array(numbers, np.float64).reshape(len(chosen), len(draws))


def _gausses(generators: Sequence[random.Random]) -> list[Gauss]:
    return [generator.gauss for generator in generators]


class Sensors:
    """The sensors of one robot in all rows.

    Args:
        robot: the robot of the single simulation; it has the sensors.
        built: the model of the robot, with one contact sensor for each part of the robot.

    Attributes:
        names: the names of the sensors, in the order of `values`.
        draws: the number of random numbers that a row draws at each sample.
    """

    def __init__(self, robot: Robot, built: Built) -> None:
        devices: list[Any] = [
            device for kind in DEVICES.values() if kind.sampler for device in robot.parts.devices.of(kind)
        ]
        self._distances = [it for it in devices if isinstance(it, DistanceSensor)]
        self._touches = [it for it in devices if isinstance(it, TouchSensor)]
        self._angles = [it for it in devices if isinstance(it, PositionSensor)]
        self._all: list[Any] = [*self._distances, *self._touches, *self._angles]
        self.names = tuple(it.name for it in self._all)
        self._noisy = [it.table.noisy for it in self._distances] + [bool(it.noise) for it in self._angles]
        self.draws = sum(self._noisy)
        self._own = next(number for _, number in built.figures.values())
        self._floors_m = built.floors_m
        beams = [beam for sensor in self._distances for beam in sensor.beams]
        self._reach = np.array([beam.reach_m for beam in beams])
        if beams:
            self._origins, self._directions = origins_and_directions(beams)
        self._parts = self._parts_of_bumpers(robot, built)
        wheels = list(robot.motors.values())
        self._wheels = [wheels.index(it.shaft.motor) for it in self._angles if it.shaft.motor is not None]
        self._tables = _groups([sensor.table for sensor in self._distances])

    def units(self, name: str) -> str:
        """Return the unit of a sensor."""
        return next(UNITS[type(it)] for it in self._all if it.name == name)

    def values(self, cast: Any, touched: Any, angles_rad: Any, noise: Any) -> Any:
        """Return the readings of some rows: (rows, sensors).

        Args:
            cast: the distances that the method `cast` returned.
            touched: whether each part of the robot was touched since the last sample (rows, parts).
            angles_rad: the angles of the wheels (rows, wheels).
            noise: random numbers (rows, draws).
        """
        drawn = np.zeros((len(touched), len(self._noisy)))
        drawn[:, self._noisy] = noise
        count = len(self._distances)
        values = np.empty((len(touched), len(self.names)))
        for table, columns in self._tables:
            values[:, columns] = _responses(table, cast[:, columns], drawn[:, columns])
        for column, parts in enumerate(self._parts, start=count):
            values[:, column] = touched[:, parts].any(axis=1)
        first = count + len(self._parts)
        for index, (sensor, wheel) in enumerate(zip(self._angles, self._wheels, strict=True)):
            angles = angles_rad[:, wheel] + sensor.noise * drawn[:, count + index]
            values[:, first + index] = _discrete(angles, sensor.resolution)
        for column, distance in enumerate(self._distances):
            values[:, column] = _discrete(values[:, column], distance.resolution)
        return values

    def cast(self, batch: Any, rows: Any, positions: Any, rotations: Any) -> Any:
        """Return the distance in meters of each beam, at most its reach: (rows, beams).

        Args:
            batch: MuJoCo's batch.
            rows: the numbers of the rows; None for all.
            positions: the positions of the robots (rows, 3).
            rotations: the rotations of the robots (rows, 3, 3).
        """
        if not self._distances:
            return np.zeros((len(positions), 0))
        turned = rotations.transpose(0, 2, 1)
        origins = self._origins @ turned + positions[:, None, :]
        directions = self._directions @ turned
        distances, _ = batch.ray(origins, directions, GROUPS, True, self._own, rows)
        for height_m in self._floors_m:
            distances = _before_floor(height_m, origins, directions, distances)
        missed = (distances < 0.0) | (distances > self._reach)
        return np.where(missed, self._reach, distances)

    def _parts_of_bumpers(self, robot: Robot, built: Built) -> list[list[int]]:
        """Return the columns of the contact sensors for each bumper."""
        bits = [bit for _, body, bit in built.geoms.values() if body is not None]
        wanted = [0 if robot.body is None else robot.body.bits(it.outline) for it in self._touches]
        return [[column for column, bit in enumerate(bits) if bit & some] for some in wanted]


def _groups(tables: Sequence[LookupTable]) -> list[tuple[LookupTable, list[int]]]:
    """Return each table with the columns of the sensors that share it."""
    found: dict[int, tuple[LookupTable, list[int]]] = {}
    for column, table in enumerate(tables):
        found.setdefault(id(table), (table, []))[1].append(column)
    return list(found.values())


def _responses(table: LookupTable, distances: Any, noise: Any) -> Any:
    """Return the responses of a table, as `LookupTable.response`."""
    between, bases, slopes = table.intervals
    interval = np.searchsorted(np.array(between), distances, side="right")
    base, slope = np.array(bases)[interval], np.array(slopes)[interval]
    values = base[..., 0] + slope[..., 0] * distances
    if not table.noisy:
        return values
    return values * (1.0 + (base[..., 1] + slope[..., 1] * distances) * noise)


def _discrete(values: Any, resolution: float) -> Any:
    return resolution * np.rint(values / resolution) if resolution > 0.0 else values


def _before_floor(height_m: float, origins: Any, directions: Any, distances: Any) -> Any:
    """Shorten the beams that meet a floor from below; MuJoCo's rays pass through a plane from below."""
    ways = height_m - origins[..., 2]
    rising = (ways > 0.0) & (directions[..., 2] > 0.0)
    met = ways / np.where(rising, directions[..., 2], 1.0)
    nearer = np.where(distances < 0.0, met, np.minimum(distances, met))
    return np.where(rising, nearer, distances)
