"""The package for programs in the trainer's container and in notebooks."""

from __future__ import annotations

from palaestra_protocol.shadowing import settle_imports

settle_imports()

from typing import TYPE_CHECKING, Any

from palaestra_trainer.run.deferred_imports.compiler import defer_compiler
from palaestra_trainer.run.deferred_imports.sb3 import defer_unused_imports

if TYPE_CHECKING:
    from pathlib import Path

    from palaestra_trainer.run.fault_tolerant.env import FaultTolerantEnv
    from palaestra_trainer.run.fault_tolerant.env_group import EnvGroup
    from palaestra_trainer.run.fault_tolerant.sb3_vec_env import FaultTolerantVecEnv
    from palaestra_trainer.run.fault_tolerant.vector_env import FaultTolerantVectorEnv
    from palaestra_trainer.run.policies import TrainedPolicy

defer_unused_imports()
defer_compiler()


def load_policy(run_or_zip: str | Path) -> TrainedPolicy:
    """Return the trained policy of a run directory or of its model.zip; see `policies.load_policy`."""
    from palaestra_trainer.run import policies

    return policies.load_policy(run_or_zip)


def make_env(environment: str | None = None, *, role: str = "Collect", **options: Any) -> FaultTolerantEnv:
    """Return a gymnasium.Env that has its own simulator, for a training loop of any library.

    A fault of the simulator truncates the episode. The step with the fault returns the last observation
    before the fault, reward 0 and `info["palaestra"]["sim_fault"]`. If the restart budget allows a restart,
    the next `reset` waits until the simulator runs again.

    If this process has `Webots` facades that no environment uses, the environment takes the simulator of the
    newest of these facades. Otherwise it takes a free simulator of PALAESTRA_CONFIG. If that variable is not
    set, as in a notebook, a new simulator is started: the stub, or MuJoCo for `SeeTarget-v0`.

    Args:
        environment: id of the environment; by default the environment of PALAESTRA_CONFIG.
        role: the role of the simulator in PALAESTRA_CONFIG, `Collect` or `Evaluate`.
        options: keyword arguments of the environment.

    Raises:
        ConfigurationError: the environment is missing or wrong, or all simulators with the role are in use.
        FaultBudgetSpent: the simulator does not start.
    """
    from palaestra_trainer.run.fault_tolerant.env import FaultTolerantEnv

    return FaultTolerantEnv(_players(environment, 1, role, options))


def make_vec_env(
    environment: str | None = None, num_envs: int | None = None, *, role: str = "Collect", **options: Any
) -> FaultTolerantVectorEnv:
    """Return a gymnasium VectorEnv whose simulators step at the same time; see `make_env`.

    The last step of an episode also resets the environment (`AutoresetMode.SAME_STEP`). A step with a fault
    waits until the faulty simulator is restarted, and the other simulators wait too.

    Args:
        environment: see `make_env`.
        num_envs: number of simulators; by default all simulators with this role in PALAESTRA_CONFIG, or one
            simulator if that variable is not set.
        role: see `make_env`.
        options: see `make_env`.

    Raises:
        The same errors as `make_env`.
    """
    from palaestra_trainer.run.fault_tolerant.vector_env import FaultTolerantVectorEnv

    return FaultTolerantVectorEnv(_players(environment, num_envs, role, options))


def make_sb3_vec_env(
    environment: str | None = None, num_envs: int | None = None, *, role: str = "Collect", **options: Any
) -> FaultTolerantVecEnv:
    """Return a Stable-Baselines3 VecEnv whose simulators step at the same time; see `make_vec_env`.

    Args:
        environment: see `make_env`.
        num_envs: see `make_vec_env`.
        role: see `make_env`.
        options: see `make_env`.

    Raises:
        The same errors as `make_env`.
    """
    from palaestra_trainer.run.fault_tolerant.sb3_vec_env import FaultTolerantVecEnv

    return FaultTolerantVecEnv(_players(environment, num_envs, role, options))


def report(*, step: int, success_rate: float | None = None) -> None:
    """Report the progress of your own training program to /status, /metrics and the operator.

    Call this function at least once every `stallDeadlineSeconds`. After the first report, the operator ends a
    program whose step does not change within that time. If PALAESTRA_CONFIG is not set, as in a notebook, the
    function does nothing.

    Args:
        step: number of environment steps that the program has learned from in all attempts. The run is
            complete when this number reaches the job's `steps`.
        success_rate: success rate of an evaluation at this step, 0 to 1; None: no evaluation since the
            previous report, whose rate is kept.

    Raises:
        ValueError: the step is negative, or the rate is not within 0 to 1.
        ConfigurationError: the configuration cannot be read, or its statusAddress is in use.
    """
    from palaestra_trainer.run import custom_program

    custom_program.report(step, success_rate)


def _players(environment: str | None, number: int | None, role: str, options: dict[str, Any]) -> EnvGroup:
    from palaestra_trainer.run.fault_tolerant.make import make_players

    return make_players(environment, number, role, options)
