"""Select the best policy of a run, and decide whether it is good enough to stop.

The best of many evaluations on the same few episodes overestimates the policy, and so does the first
evaluation that reaches the goal. Therefore these two policies are confirmed, which means evaluated once more
on episodes of another stream. Each confirmation plays the next episodes of that stream. If many confirmations
played the same episodes, these episodes would select the policy too.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from math import ceil
from pathlib import Path
from typing import Any

import structlog
from stable_baselines3.common.base_class import BaseAlgorithm

from palaestra_protocol.pod.status import Cause
from palaestra_protocol.whole_file import replace_file
from palaestra_trainer import algorithms
from palaestra_trainer.episodes.evaluation import Episode, EvaluationResult, evaluate_on_all
from palaestra_trainer.episodes.scene_film import SceneFilm
from palaestra_trainer.episodes.second_play import record_again
from palaestra_trainer.episodes.seeds import CONFIRM, EVALUATE, episode_seeds
from palaestra_trainer.errors import ConfigurationError, TrainerError
from palaestra_trainer.job.run_directory import append_line, read_lines
from palaestra_trainer.run import checkpoint
from palaestra_trainer.run.best_record import (
    POLICY,
    Best,
    best_of,
    confirmation_of,
    measured,
    status_of,
)
from palaestra_trainer.run.context import RunContext
from palaestra_trainer.run.logger import CurvesLogger
from palaestra_trainer.run.replays import films_of, keep_replays
from palaestra_trainer.run.telemetry.progress import Progress
from palaestra_trainer.simulators.fleet import resting, running

log = structlog.get_logger(__name__)


class Enough(TrainerError):
    """The policy has reached the wanted success rate, so the run is complete."""


class Selection:
    """Evaluates the model of a run, keeps the best policy in model.zip, and confirms its success rate.

    Args:
        run: the run; its collecting simulators are paused while the evaluating simulators play.
        model: the model to evaluate; its logger must be set.
    """

    def __init__(self, run: RunContext, model: BaseAlgorithm) -> None:
        self._run = run
        self._model = model
        self._directory = run.directory
        self._best = best_of(run.directory)
        self._confirmation: tuple[int, EvaluationResult] | None = None

    @property
    def measures(self) -> bool:
        """Whether this run evaluates its policy."""
        return self._run.configuration.evaluation.every_steps > 0 and bool(self._run.fleet.evaluating)

    def evaluate(self, step: int) -> None:
        """Evaluate the current policy at `step`, and save the policy if it is the best so far.

        The evaluation's line in evaluations.jsonl is written last. So a resumed attempt repeats an evaluation
        that was interrupted, or whose confirmation was interrupted.

        Raises:
            Enough: the policy reaches the goal of the run in this evaluation, and in the confirmation if the
                run confirms.
            ConfigurationError: the run has a goal, but the environment does not report success.
            Interrupted: a signal has arrived.
        """
        wanted, policy = self._run.configuration.evaluation, checkpoint.digest_of_policy(self._model)
        evaluation = self._measure(EVALUATE, wanted.episodes)
        self._log("eval", step, evaluation)
        goal, best = wanted.stop_at_success_rate, self._best
        reached = goal is not None and self._confirmed(evaluation, goal, step, policy)
        # An attempt that ended before the line was written may have saved this policy, but not its replays.
        repeated = best is not None and (best.step, best.policy) == (step, policy)
        if reached or repeated or best is None or evaluation.score > best.score:
            self._keep(evaluation, step, policy)
        line = {"step": step} | evaluation.record()
        append_line(self._directory.evaluations, line)
        self._run.progress.last_evaluation = status_of(line)
        if reached:
            raise Enough(f"{_in_words(self._run.progress)} at step {step}")

    def recycle_resting(self) -> None:
        """Begin to restart the evaluating simulators that would reach a recycle limit in the next evaluation.

        They restart while the collecting simulators work.
        """
        restarters = [restarter for restarter in self._run.fleet.evaluating if not restarter.lost]
        for restarter in restarters:
            restarter.recycle_resting(ceil(self._run.configuration.evaluation.episodes / len(restarters)))

    def finish(self, step: int) -> None:
        """Confirm the best policy at the end of training; without evaluations, save the last policy instead.

        Afterwards the run reports the success rate of the best policy, even if the last evaluation is one of
        another policy.

        Raises:
            Interrupted: a signal has arrived.
        """
        best, confirming = self._best, self._run.configuration.evaluation.confirming
        if best is None:  # model.zip may exist, if the run was shorter before
            replace_file(self._directory.model, lambda path: checkpoint.save_tensors(path, self._model))
            return
        if self.measures and confirming and confirmation_of(self._directory, best) is None:
            with self._acting_as_best():
                self._keep_replays(self._confirm(best.step, step, best.policy), step)
        self._run.progress.completed(measured(self._directory))

    def _confirmed(self, evaluation: EvaluationResult, goal: float, step: int, policy: str) -> bool:
        if evaluation.success_rate is None:
            raise ConfigurationError(
                "evaluation.stopAtSuccessRate: the environment reports no success; set is_success in the "
                "info of an episode's last step, or remove stopAtSuccessRate"
            )
        if evaluation.success_rate < goal:
            return False
        if not self._run.configuration.evaluation.confirming:
            return True
        confirmation = self._confirm(step, step, policy)
        return confirmation.success_rate is not None and confirmation.success_rate >= goal

    def _confirm(self, step: int, now: int, policy: str | None) -> EvaluationResult:
        """Confirm the policy of `step`, which the model now has, on the next episodes of the stream.

        The line has the digest `policy`; None: the line has no digest, as model.zip of an older release.
        """
        before = sum(int(line["episodes"]) for line in read_lines(self._directory.confirmations))
        evaluation = self._measure(CONFIRM, self._run.configuration.evaluation.confirming, before)
        self._log("confirm", now, evaluation, of_step=step)
        self._confirmation = (step, evaluation)
        known = {} if policy is None else {POLICY: policy}
        line = {"step": step, "confirmed_at": now} | known | evaluation.record()
        append_line(self._directory.confirmations, line)
        return evaluation

    def _measure(self, stream: str, episodes: int, first: int = 0) -> EvaluationResult:
        run = self._run
        seeds = episode_seeds(run.configuration.seed, stream, episodes, first)
        with self._playing():
            policy = algorithms.ModelPolicy(self._model)
            evaluation = evaluate_on_all(policy, run.fleet.evaluating, seeds, run.interruption.check)
        run.progress.evaluated(evaluation)
        return evaluation

    def _record_again(self, game: tuple[int, Episode]) -> SceneFilm:
        with self._playing():
            policy, run = algorithms.ModelPolicy(self._model), self._run
            return record_again(policy, run.fleet.evaluating, game, run.interruption.check)

    @contextmanager
    def _playing(self) -> Iterator[None]:
        """Within the context, run the evaluating simulators, and pause the collecting simulators."""
        run = self._run
        with (
            run.progress.spending(Cause.EVALUATING),
            resting(run.fleet.collecting),
            running(run.fleet.evaluating, run.interruption.check),
        ):
            yield

    def _log(self, kind: str, step: int, evaluation: EvaluationResult, **fields: Any) -> None:
        logger = self._model.logger
        if evaluation.success_rate is not None:
            logger.record(f"{kind}/success_rate", evaluation.success_rate)
        logger.record(f"{kind}/mean_reward", evaluation.mean_return)
        logger.record(f"{kind}/mean_ep_length", evaluation.mean_length)
        logger.dump(step)
        event = "evaluated" if kind == "eval" else "confirmed"
        interval = evaluation.success_interval
        bounds = {} if interval is None else {"success_low": interval.low, "success_high": interval.high}
        log.info(event, step=step, **fields, **evaluation.summary(), **bounds)

    def _keep(self, evaluation: EvaluationResult, step: int, policy: str) -> None:
        self._best = best = Best(
            step=step,
            success_rate=evaluation.success_rate,
            mean_return=evaluation.mean_return,
            record={"step": step, POLICY: policy} | evaluation.record(),
        )

        def write(path: Path) -> None:
            checkpoint.save_tensors(path, self._model)
            best.add_to(path)

        # If the attempt is killed here, missing replays are better than those of another policy.
        self._directory.replays.unlink(missing_ok=True)
        replace_file(self._directory.model, write)
        self._keep_replays(evaluation, step)

    def _keep_replays(self, evaluation: EvaluationResult, now: int) -> None:
        """Save recorded episodes of the best policy, and show them in TensorBoard.

        The episodes come from the confirmation of the policy, or else from its evaluation.
        """
        if self._best is None:
            return
        step, confirmation = self._confirmation or (-1, evaluation)
        shown, name = evaluation, f"the evaluation at step {self._best.step:,}"
        if step == self._best.step:
            shown, name = confirmation, f"the confirmation of step {step:,}"
        kept = keep_replays(self._directory, shown, name, self._record_again)
        logger = self._model.logger
        if isinstance(logger, CurvesLogger):  # a callback may have set another logger
            logger.show({f"episodes/{title}": film for title, film in films_of(kept).items()}, now)

    @contextmanager
    def _acting_as_best(self) -> Iterator[None]:
        """Load the policy of model.zip into the model for the context; restore the model afterwards."""
        own, normalizer = checkpoint.Tensors.of(self._model), algorithms.normalizer_of(self._model)
        normalized = None if normalizer is None else normalizer.to_json()
        try:
            checkpoint.load_tensors(self._directory.model, self._model)
            yield
        finally:
            own.put_back(self._model)
            if normalizer is not None and normalized is not None:
                normalizer.learn_from_json(normalized)


def _in_words(progress: Progress) -> str:
    interval = progress.success_interval
    bounds = f" ({interval.low:.2f} to {interval.high:.2f}, {interval.episodes} episodes)" if interval else ""
    return f"success rate {progress.success_rate:.2f}{bounds}"
