"""The package that runs in the trainer's container and in notebooks."""

from __future__ import annotations

from palaestra_protocol.shadowing import settle_imports

settle_imports()

from typing import TYPE_CHECKING, Any

from palaestra_trainer.deferred_imports.compiler import defer_compiler
from palaestra_trainer.deferred_imports.sb3 import defer_unused_imports

if TYPE_CHECKING:
    from pathlib import Path

    from palaestra_trainer.fault_tolerant.env import FaultTolerantEnv
    from palaestra_trainer.fault_tolerant.env_group import EnvGroup
    from palaestra_trainer.fault_tolerant.sb3_vec_env import FaultTolerantVecEnv
    from palaestra_trainer.fault_tolerant.vector_env import FaultTolerantVectorEnv
    from palaestra_trainer.run.policies import TrainedPolicy

defer_unused_imports()
defer_compiler()


def load_policy(run_or_zip: str | Path) -> TrainedPolicy:
    """Return the policy of a run directory, or of a model zip inside one; see `policies.load_policy`."""
    from palaestra_trainer.run import policies

    return policies.load_policy(run_or_zip)


def make_env(environment: str | None = None, *, role: str = "Collect", **options: Any) -> FaultTolerantEnv:
    """Return a gymnasium.Env in its own simulator, for a training loop of any library.

    A fault of the simulator ends an episode as truncated, with the last observation before it, reward 0 and
    `info["palaestra"]["sim_fault"]`. The next `reset` waits until the simulator is restarted, within its
    restart budget.

    The simulator is that of the newest `Webots` facade of this process that no environment uses, else a free
    simulator of PALAESTRA_CONFIG. If that variable is not set, as in a notebook, a new simulator is started:
    a stub, or MuJoCo for `SeeTarget-v0`.

    Args:
        environment: id of the environment; by default the environment of PALAESTRA_CONFIG.
        role: the role of the simulator in PALAESTRA_CONFIG, `Collect` or `Evaluate`.
        options: options of the environment.

    Raises:
        ConfigurationError: the environment is missing or wrong, or no simulator with the role is free.
        FaultBudgetSpent: the simulator does not start.
    """
    from palaestra_trainer.fault_tolerant.env import FaultTolerantEnv

    return FaultTolerantEnv(_players(environment, 1, role, options))


def make_vec_env(
    environment: str | None = None, num_envs: int | None = None, *, role: str = "Collect", **options: Any
) -> FaultTolerantVectorEnv:
    """Return a gymnasium VectorEnv whose simulators step at the same time; see `make_env`.

    Episodes are reset in their last step (`AutoresetMode.SAME_STEP`). After a fault, that step waits until
    the simulator is restarted, and the other simulators wait with it.

    Args:
        environment: see `make_env`.
        num_envs: number of simulators; by default all with this role in PALAESTRA_CONFIG, else one.
        role: see `make_env`.
        options: see `make_env`.

    Raises:
        As `make_env`.
    """
    from palaestra_trainer.fault_tolerant.vector_env import FaultTolerantVectorEnv

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
        As `make_env`.
    """
    from palaestra_trainer.fault_tolerant.sb3_vec_env import FaultTolerantVecEnv

    return FaultTolerantVecEnv(_players(environment, num_envs, role, options))


def report(*, step: int, success_rate: float | None = None) -> None:
    """Report the progress of your own training program to /status, /metrics and the operator.

    Call it at least once every `stallDeadlineSeconds`. After the first report, the operator ends a program
    whose step stays the same for longer. If PALAESTRA_CONFIG is not set, as in a notebook, it does nothing.

    Args:
        step: environment steps learned from, over all attempts; the program is complete at the job's `steps`.
        success_rate: success rate of the last evaluation, 0 to 1; None keeps the previous value.

    Raises:
        ValueError: the step is negative, or the rate not within 0 to 1.
        ConfigurationError: the configuration cannot be read, or its statusAddress is in use.
    """
    from palaestra_trainer.run import custom_program

    custom_program.report(step, success_rate)


def _players(environment: str | None, number: int | None, role: str, options: dict[str, Any]) -> EnvGroup:
    from palaestra_trainer.fault_tolerant.make import make_players

    return make_players(environment, number, role, options)
