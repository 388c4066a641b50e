"""The interface of a batched world, and the readings of a step."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

from palaestra_protocol.batch import BatchDescription, BatchRequest
from palaestra_sim.errors import SimError


class BatchRefusedError(SimError, ValueError):
    """The batch form of the simulator lacks parts that a world or a trainer needs; the message lists them."""

    def __init__(self, world: str, lacks: Sequence[str], remedy: str) -> None:
        super().__init__(f"{world}: --batch: {'; '.join(dict.fromkeys(lacks))}; {remedy}")


class BatchReadings(NamedTuple):
    """The readings of rows: values (rows, values), poses (rows, 3), failed (rows,), and reasons by row."""

    values: Any
    poses: Any
    failed: Any
    reasons: Mapping[int, str]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Reset:
    """A reset of some rows.

    Attributes:
        rows: the numbers of the rows, in increasing order.
        seeds: the seed of each row's noise.
        places: for each row, x, y and the quaternion of the robot; an empty array leaves the robot where the
            world has it.
        joints: for each row, the positions of the joints of the request.
        commands: for each row, the commands of the motors after the reset.
    """

    rows: Any
    seeds: Any
    places: Any
    joints: Any
    commands: Any


class BatchWorld(Protocol):
    """Many copies of one world."""

    def open(self, request: BatchRequest) -> BatchDescription:
        """Use the devices of the request from now on; return the number of copies, basic step and units.

        Raises:
            BatchRefusedError: the world lacks a device or node, or the period does not fit.
        """
        ...

    def step(self, commands: Any) -> BatchReadings:
        """Apply the commands (rows, motors) and simulate one period of all rows."""
        ...

    def reset(self, reset: Reset) -> BatchReadings:
        """Return rows to the start of the world, place their robots, and simulate one period of them."""
        ...
