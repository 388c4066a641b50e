"""MuJoCo's batch of one model: steps, failed rows, and the state to which a reset returns."""

from __future__ import annotations

import importlib
from typing import Any, Final

import numpy as np

from palaestra_sim.mujoco.library import mujoco

_STATE: Final = mujoco.mjtState.mjSTATE_INTEGRATION
_TIMES: Final = 1  # index of the field of a warning that counts its occurrences
_BAD: Final = [
    int(kind)
    for kind in (
        mujoco.mjtWarning.mjWARN_BADQPOS,
        mujoco.mjtWarning.mjWARN_BADQVEL,
        mujoco.mjtWarning.mjWARN_BADQACC,
        mujoco.mjtWarning.mjWARN_BADCTRL,
    )
]


class Rows:
    """The copies of one model.

    Args:
        model: the compiled model; this class sets its option AUTORESET.
        data: the state to which a reset returns.
        count: the number of copies.
        threads: the number of threads; 0: one for each processor.
        sleeping: whether bodies may sleep, if the model allows it.

    Attributes:
        count: the number of copies.
        batch: MuJoCo's batch.
        qpos, qvel, ctrl, sensordata: live arrays of all rows.
        reasons: the reason of the failure, for each failed row.
    """

    def __init__(self, model: Any, data: Any, count: int, threads: int, *, sleeping: bool = True) -> None:
        # By default, MuJoCo resets a copy silently if a value is not finite. Without this reset, `failed`
        # reports the row to the trainer.
        model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET
        # Bodies that sleep need one MjData for each copy; the bodies of a scene's batch never sleep.
        if not sleeping:
            model.opt.enableflags &= ~int(mujoco.mjtEnableBit.mjENBL_SLEEP)
        sleeps = bool(model.opt.enableflags & mujoco.mjtEnableBit.mjENBL_SLEEP)
        batching = importlib.import_module("mujoco.batch")
        self._error: type[Exception] = batching.SimulationError
        self.batch = batching.Batch(model, count, threads, persistent=sleeps)
        self.count = count
        self.reasons: dict[int, str] = {}
        self._start = np.zeros(self.batch.nstate)
        mujoco.mj_getState(model, data, self._start, _STATE)
        self.batch.state[:] = self._start
        self.qpos, self.qvel = self.batch.bind("qpos"), self.batch.bind("qvel")
        self.ctrl, self.sensordata = self.batch.bind("ctrl"), self.batch.bind("sensordata")
        self._warm_start = self.batch.bind("qacc_warmstart")
        self._motion = (self.qpos, self.qvel, self._warm_start)  # arrays that a step without contacts changes
        self.batch.forward()

    def restart(self, rows: Any) -> None:
        """Return rows to the start; a failed row can then be used again."""
        self.batch.state[rows] = self._start
        self.batch.warning[rows] = 0
        for row in rows.tolist():
            self.reasons.pop(row, None)

    def step(self, rows: Any, count: int) -> None:
        """Take `count` MuJoCo steps in these rows (None: all); record the rows for which MuJoCo raised."""
        try:
            self.batch.step(rows, count)
        except self._error:
            self._note(rows)

    def step_as(self, other: Rows, rows: Any, count: int) -> None:
        """Take `count` steps of these rows with the model of `other`, which has the same joints."""
        controls, moves = self.ctrl[rows], self.qvel[rows].any(axis=1)
        # A body at rest with no command and no acceleration stays as it is, bit for bit.
        rows = rows[controls.any(axis=1) | moves | self._warm_start[rows].any(axis=1)]
        if not len(rows):
            return
        other.ctrl[rows] = self.ctrl[rows]
        for mine, its in zip(self._motion, other._motion, strict=True):
            its[rows] = mine[rows]
        other.step(rows, count)
        for mine, its in zip(self._motion, other._motion, strict=True):
            mine[rows] = its[rows]

    def forward(self, rows: Any, stage: int) -> None:
        """Compute the quantities up to a stage for the current state, which does not change."""
        try:
            self.batch.forward(rows, stage)
        except self._error:
            self._note(rows)

    def failed(self, rows: Any) -> Any:
        """Return for each of these rows (None: all rows) whether it failed.

        A row fails if MuJoCo raised an error, or if a position, speed or control is not finite or is larger
        than MuJoCo allows.
        """
        chosen = slice(None) if rows is None else rows
        finite = np.isfinite(self.qpos[chosen]).all(axis=1) & np.isfinite(self.qvel[chosen]).all(axis=1)
        warned = self.batch.warning[chosen][:, _BAD, _TIMES].any(axis=1)
        sound = finite & ~warned
        numbers = np.arange(self.count)[chosen]
        if not sound.all():
            for row in numbers[~sound].tolist():
                self.reasons.setdefault(row, "a position, speed or control of the simulation is not finite")
        if not self.reasons:
            return np.zeros(len(numbers), dtype=bool)
        return np.isin(numbers, list(self.reasons))

    def _note(self, rows: Any) -> None:
        chosen = np.arange(self.count) if rows is None else rows
        for row in chosen[self.batch.status[chosen] != 0].tolist():
            self.reasons.setdefault(row, self.batch.error(row))
