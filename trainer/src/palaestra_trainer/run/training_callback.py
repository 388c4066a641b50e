"""The callback that evaluates, saves, pauses simulators and ends the run between two rollouts.

The model's state is complete only at a boundary between rollouts, because the algorithm has then learned from
all collected data. So the model is evaluated and saved only at a boundary. If a run is interrupted during a
rollout, the resumed attempt plays that rollout again with the same seeds and random numbers.
"""

from __future__ import annotations

import time
from collections import Counter
from dataclasses import dataclass
from typing import Any

import structlog
from stable_baselines3.common.callbacks import BaseCallback

from palaestra_protocol.pod.status import Cause
from palaestra_trainer.algorithms.buffers import valid_rows
from palaestra_trainer.algorithms.divergence import Learner
from palaestra_trainer.episodes.collecting import CollectingVecEnv
from palaestra_trainer.run import checkpoint
from palaestra_trainer.run.best_model import Selection
from palaestra_trainer.run.best_record import last_evaluated
from palaestra_trainer.run.checkpoint import SavedCheckpoint, Tensors, TrainingState
from palaestra_trainer.run.context import RunContext
from palaestra_trainer.run.journal import Journal
from palaestra_trainer.run.telemetry.progress_log import ProgressLog
from palaestra_trainer.waiting import shutdown_deadline

log = structlog.get_logger(__name__)

# A pause costs two service calls per simulator and a copy of the model. A shorter learning phase is not worth
# this cost.
LONG_LEARNING_S = 0.5
COUNTED_BY_STEP = ("episodes", "extra_steps")


@dataclass(frozen=True, slots=True)
class Resumed:
    """The checkpoint from which an attempt resumes, and its state."""

    checkpoint: SavedCheckpoint
    state: TrainingState


class TrainingCallback(BaseCallback):
    """The Stable-Baselines3 callback that runs one attempt."""

    def __init__(self, run: RunContext, env: CollectingVecEnv, resumed: Resumed | None = None) -> None:
        super().__init__()
        self._run = run
        self._env = env
        self._saver = checkpoint.Saver(
            run.directory.checkpoints,
            run.configuration.checkpoint.keep,
            resumed.checkpoint if resumed else None,
        )
        self._journal = Journal(run.directory.journal)
        self._log = ProgressLog()
        self._boundary = self._resumed = resumed.state if resumed else None
        self._step = self._saved = resumed.checkpoint.manifest.step if resumed else 0
        self._evaluated = last_evaluated(run.directory, self._step)
        self._terms: list[Counter[str]] = [
            Counter(terms) for terms in (resumed.state.rollout["terms"] if resumed else [{}] * env.num_envs)
        ]
        self._learning_s: float | None = None
        self._before_update: Tensors | None = None
        self._rollout_ended: float | None = None
        self._updates = 0
        self._resting = False
        self._cut = False

    def drop_rollout(self) -> None:
        """Set the model back to the last boundary, after a callback ended the rollout; then call `finish`."""
        if self._boundary is not None:
            self._boundary.put_back(self.model)
        self._cut = True

    def finish(self) -> None:
        """Evaluate and save the final model, and confirm the best policy."""
        self._learner.check(self.model.num_timesteps)
        if self._cut:
            self._step = self.model.num_timesteps
        else:
            self._mark_boundary()
        if self._evaluated != self._step:
            self._evaluate_if_wanted()
        self.save()
        self._selection.finish(self._step)

    def save(self) -> None:
        """Set the model back to the last boundary and save the model; do nothing before any boundary."""
        run, state = self._run, self._boundary
        if state is None:
            return
        step = int(state.numbers["num_timesteps"])
        if self._before_update is not None:
            self._before_update.put_back(self.model)
        started = time.monotonic()
        with run.progress.spending(Cause.CHECKPOINTING):
            # A resumed run plays the steps after the boundary again, so the counts of these steps are
            # dropped. The counts of faults and times are saved.
            counters = run.progress.counted(kept=step).to_json() | state.rollout["counters"]
            manifest = checkpoint.describe(run.configuration, step, counters)
            if self._saver.save(self.model, state, manifest):
                run.progress.saved(step)
                seconds = time.monotonic() - started
                run.progress.figures.saved(seconds, self._saver.size_bytes())
                log.info("checkpoint written", step=step, seconds=round(seconds, 3))
            else:
                run.progress.figures.saves_refused += 1
        self._saved = step

    def leave_update(self, *_step: object) -> None:
        """Raise Interrupted before a gradient step if a signal has arrived and the deadline is over.

        This method raises only if a copy of the tensors before the update exists. A resume collects the data
        of the update again.
        """
        if self._before_update is not None and shutdown_deadline.is_over():
            self._run.interruption.check()

    def _init_callback(self) -> None:
        self._learner = Learner(self.model)
        self._selection = Selection(self._run, self.model)

    def _on_rollout_start(self) -> None:
        if self._rollout_ended is not None and self.updates_so_far() != self._updates:
            self._learning_s = time.monotonic() - self._rollout_ended
        if self._resumed:
            # State-dependent exploration has drawn new noise for this rollout, but must use the saved noise.
            self._resumed.put_back(self.model)
            self._resumed = None
        self._learner.check(self.model.num_timesteps)
        self._mark_boundary()
        self._run.interruption.check()
        if self._resting:
            self._env.unpause()
            self._resting = False
        if _passed(self._evaluated, self._step, self._run.configuration.evaluation.every_steps):
            self._evaluate_if_wanted()
            self._selection.recycle_resting()
        if _passed(self._saved, self._step, self._run.configuration.checkpoint.every_steps):
            self.save()

    def _on_step(self) -> bool:
        infos = self.locals["infos"]
        self._step += int(valid_rows(infos).sum())
        self._run.progress.collected(self._step, infos)
        self._journal.keep(self._run.progress)
        self._record_rewards(infos, self.locals["dones"])
        if self._log.due:
            self._log.write(self._run.progress.status())
        # A rollout may take longer than the grace period. So a signal ends the rollout here, and a resume
        # plays it again.
        self._run.interruption.check()
        return True

    def _on_rollout_end(self) -> None:
        self._rollout_ended, self._updates = time.monotonic(), self.updates_so_far()
        if self._learning_s is not None and self._learning_s >= LONG_LEARNING_S:
            self._env.pause()
            self._resting = True
        first = self._learning_s is None and self._step > getattr(self.model, "learning_starts", -1)
        if first or self._resting:  # the first update may be long, and so may an update after a long update
            self._before_update = Tensors.of(self.model)

    def updates_so_far(self) -> int:
        """Return the number of updates that the algorithm has counted."""
        return int(self.model._n_updates)  # noqa: SLF001 - the count has no public name

    def _mark_boundary(self) -> None:
        self._before_update = None
        self._step = self.model.num_timesteps
        progress = self._run.progress
        self._env.set_training_progress(min(1.0, self._step / self._run.configuration.steps))
        self._boundary = TrainingState.of(
            self.model,
            self._env.snapshot(),
            {
                "returns": progress.returns(),
                "terms": [dict(terms) for terms in self._terms],
                "counters": {name: getattr(progress.counters, name) for name in COUNTED_BY_STEP},
            },
        )

    def _evaluate_if_wanted(self) -> None:
        self._evaluated = self._step
        if self._selection.measures:
            self._selection.evaluate(self._step)

    def _record_rewards(self, infos: list[dict[str, Any]], dones: Any) -> None:
        for row, info in enumerate(infos):
            self._terms[row].update(info.get("reward_terms", {}))
            if dones[row]:
                terms, self._terms[row] = self._terms[row], Counter()
                if "episode" in info:
                    for name, value in terms.items():
                        self.logger.record_mean(f"reward/{name}", value)


def _passed(before: int, now: int, every: int) -> bool:
    """Return whether a multiple of `every` lies in (before, now]; False if `every` is 0."""
    return every > 0 and now // every > before // every
