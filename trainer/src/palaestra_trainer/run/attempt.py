"""Run one attempt, from a configuration to an exit code.

The attempt reports every error that it can find without a simulator before a simulator starts.
"""

from __future__ import annotations

import logging
import os
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import structlog
import torch
from stable_baselines3.common.base_class import BaseAlgorithm
from torch.optim.optimizer import register_optimizer_step_pre_hook

from palaestra_protocol.pod.status import Cause, ExitCode
from palaestra_protocol.whole_file import replace_file
from palaestra_trainer import algorithms
from palaestra_trainer.algorithms import her
from palaestra_trainer.algorithms.divergence import Learner
from palaestra_trainer.algorithms.replay_size import replay_size
from palaestra_trainer.environments.env_checker import refuse_statistics
from palaestra_trainer.episodes.collecting import CollectingVecEnv
from palaestra_trainer.episodes.collecting_env import collecting_env
from palaestra_trainer.errors import ConfigurationError, Diverged, TrainerError, fact_of
from palaestra_trainer.job.configuration import Configuration, dump
from palaestra_trainer.job.run_directory import RunDirectory
from palaestra_trainer.run import checkpoint
from palaestra_trainer.run.best_model import Enough
from palaestra_trainer.run.best_record import forget_after, last_evaluation
from palaestra_trainer.run.callbacks import JobCallbacks, make_callbacks
from palaestra_trainer.run.capacity import capacity_now, refuse_what_does_not_fit
from palaestra_trainer.run.checkpoint import SavedCheckpoint
from palaestra_trainer.run.context import RunContext
from palaestra_trainer.run.directory_check import inspect
from palaestra_trainer.run.end_record import write_end
from palaestra_trainer.run.exit import leave_after
from palaestra_trainer.run.her_reward_env import make_judge
from palaestra_trainer.run.journal import Journal
from palaestra_trainer.run.logger import CurvesLogger, hide_points
from palaestra_trainer.run.resume import rejoin
from palaestra_trainer.run.signals import Interruption
from palaestra_trainer.run.source_commit import source_commit
from palaestra_trainer.run.summary import finished, last_word_of, summarise, write_summary
from palaestra_trainer.run.telemetry.fault_log import FaultLog
from palaestra_trainer.run.telemetry.metrics import constants
from palaestra_trainer.run.telemetry.progress import Counters, Progress
from palaestra_trainer.run.telemetry.progress_sources import follow
from palaestra_trainer.run.telemetry.status_server import status_server
from palaestra_trainer.run.tensorboard_link import link_curves
from palaestra_trainer.run.termination import End, end_of, write_last_word
from palaestra_trainer.run.training_callback import Resumed, TrainingCallback
from palaestra_trainer.run.versions import versions
from palaestra_trainer.run.watchdog import Watchdog, stalled
from palaestra_trainer.simulators.fleet import Fleet, rest
from palaestra_trainer.simulators.interface import Member

log = structlog.get_logger(__name__)

MakeMembers = Callable[[Configuration], Sequence[Member]]
DONE = End(ExitCode.DONE, "Completed", "the training is complete")
NOTHING_LEARNED = End(
    ExitCode.DONE,
    "Completed",
    "the training is complete, but nothing was learned: no update was made",
)
_FAR_BEYOND = 1.5  # a run with more steps than the job's steps times this number is logged
STOPPED_S = 60.0  # longest time for closing environments and stopping simulators
# Code of the job's author may try to end the program, for example by sys.exit.
ENDING = (Exception, SystemExit, KeyboardInterrupt, GeneratorExit)


@dataclass(frozen=True, slots=True, kw_only=True)
class AttemptDependencies:
    """The dependencies of an attempt.

    Attributes:
        make_members: a function that creates the members of a configuration without starting them.
        must_resume: whether the attempt may only resume an existing run.
        environment: the environment variables of the process.
    """

    make_members: MakeMembers
    must_resume: bool = False
    environment: Mapping[str, str]


def run(
    configuration: Configuration,
    directory: RunDirectory,
    make_members: MakeMembers,
    *,
    must_resume: bool = False,
) -> int:
    """Train to the end and return the exit code; resume if the directory has a checkpoint.

    If the run is already finished, report its result without training. Call this function in the main thread,
    because that thread receives signals. With `must_resume`, never begin a new run.
    """
    around = AttemptDependencies(
        make_members=make_members,
        must_resume=must_resume,
        environment=os.environ,
    )
    progress = Progress(
        configuration.steps, [(simulator.name, simulator.role) for simulator in configuration.simulators]
    )
    attempt = Attempt(configuration, directory, progress, around)
    try:
        inspect(directory)
    except ConfigurationError as error:
        return _reported(end_of(error), attempt)
    before = finished(directory, configuration)
    if before is not None:
        log.info("already finished", **before)
        write_last_word(last_word_of(before, directory))
        return ExitCode.DONE
    return _reported(attempt.play(), attempt)


def _reported(end: End, attempt: Attempt) -> int:
    """Log the end of an attempt, write its termination message, and return its exit code."""
    for line in end.message.splitlines():
        log.log(logging.INFO if end.code == ExitCode.DONE else logging.ERROR, line, reason=end.reason)
    attempt.write_end(end)
    return int(end.code)


def _logged(error: BaseException) -> End:
    end = end_of(error)
    if end.reason in {"Unexpected", "CallbackFailed", "ProgramEnded"}:
        log.error("unexpected error", exc_info=error)
    return end


class Learning(NamedTuple):
    """A model and the environment in which it learns."""

    env: CollectingVecEnv
    model: BaseAlgorithm


class Attempt:
    """One attempt of a run; call `play` once."""

    def __init__(
        self,
        configuration: Configuration,
        directory: RunDirectory,
        progress: Progress,
        around: AttemptDependencies,
    ) -> None:
        self._configuration = configuration
        self._directory = directory
        self._progress = progress
        self._around = around
        self._algorithm = configuration.algorithm
        self._callbacks = JobCallbacks([])

    def play(self) -> End:
        """Train, stop all simulators and servers, and return the end of the attempt.

        The first error decides the end; a later error during the stop is only logged. If the stop takes too
        long, the process ends.
        """
        with ExitStack() as stack:
            end = self._trained(stack)
            hurry = leave_after(STOPPED_S, int(end.code), lambda: self.write_end(end))
            try:
                stack.close()
            except ENDING as error:
                log.warning(
                    "an error occurred while the run was stopped", fact=fact_of(error), exc_info=error
                )
            finally:
                hurry.cancel()
        return end

    def _trained(self, stack: ExitStack) -> End:
        try:
            self._directory.path.mkdir(parents=True, exist_ok=True)
            with self._watchdog():  # the watchdog does not watch the stop, which has its own deadline
                learned = self._train(*self._prepare(stack))
        except ENDING as error:  # the outermost handler of the process, because every end needs an exit code
            return _logged(error)
        return DONE if learned else NOTHING_LEARNED

    def write_end(self, end: End) -> None:
        """Write the termination message of this attempt, as it ends, and the report of the run."""
        write_end(self._directory, self._progress, end)

    def _prepare(self, stack: ExitStack) -> tuple[RunContext, Learning, SavedCheckpoint | None]:
        """Start the simulators; return the run, its model and environment, and the checkpoint to resume from.

        The model is created before the simulators start, because its constructor refuses wrong values and
        spaces. The attempt is also recorded before the simulators start, so it counts even if they fail.
        `stack` stops and closes everything that this method starts.
        """
        configuration, progress = self._configuration, self._progress
        algorithms.check(configuration.algorithm)
        self._callbacks = make_callbacks(configuration.algorithm.callbacks or ())
        interruption = stack.enter_context(Interruption())
        found = self._newest()
        before = RunDirectory(found.path.parent.parent) if found else None
        self._algorithm = algorithms.begin_with(configuration, self._directory, before)
        # The counters of previous attempts are set before the server starts, because Prometheus would count a
        # later jump of a counter as new events.
        self._take_over(found)
        known = constants(configuration)
        stack.enter_context(status_server(configuration.status_address, progress, known))
        self._begin(found)
        members = self._around.make_members(configuration)
        follow(progress, members)
        fleet = Fleet(configuration, members, progress)
        progress.figures.meters = fleet.meters()
        stack.callback(fleet.stop)
        learning = self._make_model(fleet, interruption, stack, found)
        fleet.start(interruption.check, stepped=found is not None)
        for line in progress.left_out():
            log.warning("simulators leave out nodes of their world", what=line)
        rest(fleet.evaluating)
        run = RunContext(
            configuration=configuration,
            directory=self._directory,
            fleet=fleet,
            progress=progress,
            interruption=interruption,
        )
        return run, learning, found

    def _make_model(
        self, fleet: Fleet, interruption: Interruption, stack: ExitStack, found: SavedCheckpoint | None
    ) -> Learning:
        """Return a new model with its environment; the simulators need not have started."""
        use_threads(self._around.environment)
        wanted = self._configuration
        task = fleet.collecting[0].member.env
        algorithms.refuse_spaces(self._algorithm, task.observation_space, task.action_space)
        refuse_statistics(task, wanted.environment.id)
        algorithms.refuse_without_masks(self._algorithm, task, wanted.environment.id)
        judge = make_judge(wanted) if her.wanted(self._algorithm) else None
        unawaited = wanted.collection == "Asynchronous"
        env = collecting_env(fleet.collecting, wanted.seed, interruption.check, judge, asynchronous=unawaited)
        stack.callback(env.close)
        self._progress.moments = env.moments
        replay = replay_size(self._algorithm, env.observation_space, env.action_space, wanted.steps)
        refuse_what_does_not_fit(replay, wanted.checkpoint, capacity_now(self._directory))
        model = algorithms.make_model(self._algorithm, env, wanted.seed, wanted.device)
        for line in algorithms.futile(model, wanted.steps):
            log.warning(line)
        if found is None and wanted.initial_policy is not None:
            checkpoint.begin_from(Path(wanted.initial_policy), model)
        return Learning(env, model)

    def _take_over(self, found: SavedCheckpoint | None) -> None:
        """Set the progress to the progress of the previous attempts."""
        journal = Journal(self._directory.journal)
        if found is None:
            self._progress.counters = journal.regained(0, Counters())
            return
        step, saved = found.manifest.step, Counters.from_json(found.manifest.counters)
        self._progress.resumed(step, journal.regained(step, saved), last_evaluation(self._directory, step))

    def _newest(self) -> SavedCheckpoint | None:
        checkpoint.tidy(self._directory.checkpoints)
        found = checkpoint.newest(self._directory.checkpoints) or self._of_another_run()
        if found is None and self._around.must_resume:
            raise ConfigurationError(
                f"{self._directory.path}: has no checkpoint to resume from; remove --resume"
            )
        if found:
            checkpoint.refuse_another_run(found, self._configuration)
        return found

    def _of_another_run(self) -> SavedCheckpoint | None:
        """Return the newest checkpoint of the run that `resumeFrom` names; None: the field is not set."""
        another = self._configuration.resume_from
        if another is None:
            return None
        found = checkpoint.newest(RunDirectory(Path(another)).checkpoints)
        if found is None:
            raise ConfigurationError(f"resumeFrom: {another} has no checkpoint; give the run of another job")
        return found

    def _train(self, run: RunContext, learning: Learning, found: SavedCheckpoint | None) -> bool:
        """Train to the end; return whether the policy was updated, always True for a user's algorithm."""
        env, model = learning
        self._forget_what_is_played_again()
        resumed = self._resume(model, env, found) if found else None
        model.set_logger(CurvesLogger(self._directory.tensorboard, self._progress))
        with self._progress.spending(Cause.LEARNING):
            conductor = TrainingCallback(run, env, resumed)
            self._learn_with_callbacks(model, conductor)
        self._tell_if_it_took_longer()
        write_summary(self._directory, summarise(self._directory, self._progress))
        return self._algorithm.name not in algorithms.ALGORITHMS or conductor.updates_so_far() > 0

    def _tell_if_it_took_longer(self) -> None:
        """Log a warning if the run took many more steps than set, because an update waited for episodes."""
        wanted, taken = self._configuration.steps, self._progress.step
        if taken > _FAR_BEYOND * wanted:
            log.warning(
                "the run took more steps than set, because an update waited for whole episodes",
                wanted=wanted,
                taken=taken,
            )

    def _forget_what_is_played_again(self) -> None:
        """Remove evaluations and curves that a previous attempt recorded after the resumed step."""
        step, curves = self._progress.step, self._directory.tensorboard
        forget_after(self._directory, step)
        if curves.exists():
            hide_points(curves, after=step)

    def _resume(self, model: BaseAlgorithm, env: CollectingVecEnv, found: SavedCheckpoint) -> Resumed:
        """Bring model and simulators back to the state of the checkpoint."""
        saved = checkpoint.restore(found, model)
        env.set_training_progress(min(1.0, found.manifest.step / self._configuration.steps))
        with self._progress.spending(Cause.RECOVERING):
            state = rejoin(env, saved, masked=algorithms.takes_masks(model))
        state.put_back(model)
        self._progress.recall(state.rollout["returns"])
        return Resumed(found, state)

    def _begin(self, found: SavedCheckpoint | None) -> None:
        reason = f"resumed at step {found.manifest.step}" if found else "new run"
        text = dump(self._configuration)
        replace_file(self._directory.configuration, lambda path: path.write_text(text, encoding="utf-8"))
        self._directory.end.unlink(missing_ok=True)
        self._directory.summary.unlink(missing_ok=True)  # exists if a finished run gets more steps
        algorithms.keep(self._algorithm, self._directory)
        pod = self._around.environment.get("PALAESTRA_POD_UID", "")
        source = source_commit(self._configuration.environment.id)
        self._progress.attempt = attempt = self._directory.begin_attempt(pod, reason, versions(), source)
        self._progress.fault_log = FaultLog(self._directory.faults, attempt)
        link_curves(self._directory, self._configuration)
        log.info("training", attempt=attempt, reason=reason, target=self._configuration.steps)

    def _learn_with_callbacks(self, model: BaseAlgorithm, conductor: TrainingCallback) -> None:
        with ExitStack() as failed:
            failed.callback(self._callbacks.end_after_error)
            self._learn(model, conductor)
            failed.pop_all()
        self._callbacks.end()

    def _learn(self, model: BaseAlgorithm, conductor: TrainingCallback) -> None:
        missing = self._configuration.steps - model.num_timesteps
        try:
            if missing > 0:
                with register_optimizer_step_pre_hook(conductor.leave_update):
                    model.learn(
                        missing,
                        [conductor, self._callbacks],
                        log_interval=algorithms.entry_of(self._algorithm.name).log_interval,
                        reset_num_timesteps=False,
                    )
            else:
                conductor.init_callback(model)
            if name := self._callbacks.stopped_by:
                log.info("done early", fact=f"callback {name} returned False")
                conductor.drop_rollout()
            self._progress.step = model.num_timesteps
            conductor.finish()
        except Enough as enough:
            log.info("done early", fact=str(enough))
            conductor.save()
        except Diverged:
            raise
        except TrainerError:
            conductor.save()
            raise
        except ValueError:
            # PyTorch's distributions raise a ValueError for NaN. In that case the check raises Diverged
            # instead.
            Learner(model).check(model.num_timesteps)
            raise

    def _watchdog(self) -> Watchdog:
        return Watchdog(
            self._progress.idle_s,
            self._configuration.stall_deadline_seconds,
            lambda: self.write_end(stalled(self._progress)),
        )


def use_threads(environment: Mapping[str, str] = os.environ) -> None:
    """Set the number of PyTorch's threads to OMP_NUM_THREADS, by default to 1.

    Networks of the usual size are slower with two threads than with one.
    """
    threads = environment.get("OMP_NUM_THREADS", "1")
    torch.set_num_threads(int(threads) if threads.isdigit() and int(threads) else 1)
