"""Definitions of all metrics of a trainer; `palaestra_trainer.run.telemetry.metrics` reads their values.

Counters of the run continue in the next attempt, because checkpoints save them. Counters of simulators begin
at 0 in each attempt. Prometheus adds the labels of job and replica when it scrapes.
"""

from __future__ import annotations

from palaestra_protocol.metrics import Family, Label, counter, gauge, histogram
from palaestra_protocol.pod.status import Cause, FaultKind, Role
from palaestra_trainer.simulators.stats import STEP_S

# The scale of returns is not known in advance, and returns are often negative. So the bounds of the buckets
# are symmetric around 0, and each positive bound is at most two and a half times the next smaller one.
DECADES = (0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 500.0, 1000.0)
RETURNS = (*(-decade for decade in reversed(DECADES)), 0.0, *DECADES)
LENGTHS = (1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 500.0, 1000.0, 2000.0, 5000.0, 10_000.0)
CHECKPOINT_S = (0.01, 0.03, 0.1, 0.3, 1.0, 3.0, 10.0, 30.0, 100.0)

QUANTILES = (0.0, 0.1, 0.5, 0.9, 1.0)
RECYCLED = "recycled"
GIVEN_UP = "given_up"
# The names of losses in the logs of Stable-Baselines3, without the part before the slash.
LOSSES = (
    "loss",
    "policy_loss",
    "policy_gradient_loss",
    "value_loss",
    "entropy_loss",
    "actor_loss",
    "critic_loss",
    "ent_coef_loss",
)
MEASURES = ("exploration_rate", "ent_coef", "std")

SIMULATOR = Label(name="simulator", bound="simulator")
ROLE = Label(name="role", values=tuple(Role))
STATE = Label(name="state", values=("starting", "ready", "failed", GIVEN_UP))
KIND = Label(name="kind", values=tuple(FaultKind))
CAUSE = Label(name="cause", values=(*(kind for kind in FaultKind if kind is not FaultKind.SLOW), RECYCLED))


STEPS = counter("palaestra_trainer_steps_total", "Valid environment steps so far.")
TARGET_STEPS = gauge("palaestra_trainer_target_steps", "Number of steps at which the run ends.")
STEPS_PER_SECOND = gauge(
    "palaestra_trainer_steps_per_second", "Environment steps per second of training over the last 30 seconds."
)
STEPS_LOST = counter(
    "palaestra_trainer_steps_lost_total",
    "Valid steps of episodes that a fault ended, and steps that a resumed run played again.",
)
EXTRA_STEPS = counter(
    "palaestra_trainer_extra_steps_total", "Simulation steps taken because a message was late."
)
IDLE = gauge(
    "palaestra_trainer_idle_seconds",
    "Seconds since the last environment step of any simulator, or since the start.",
)
STALL_DEADLINE = gauge(
    "palaestra_trainer_stall_deadline_seconds",
    "Idle seconds after which the trainer's watchdog ends the trainer.",
)
SECONDS = counter(
    "palaestra_trainer_seconds_total",
    "Wall-clock time by cause.",
    Label(name="cause", values=tuple(Cause)),
)

EPISODES = counter("palaestra_trainer_episodes_total", "Training episodes that ended without a fault.")
RETURN = histogram(
    "palaestra_trainer_episode_return",
    "Return of each training episode of this attempt; no sum, because returns may be negative.",
    RETURNS,
)
RETURN_MEAN = gauge(
    "palaestra_trainer_episode_return_mean",
    "Mean return of the last 100 training episodes, as rollout/ep_rew_mean in TensorBoard.",
)
RETURN_QUANTILE = gauge(
    "palaestra_trainer_episode_return_quantile",
    "Quantiles of the returns of the last 100 training episodes; rank 0.5 is the median.",
    Label(name="rank", values=tuple(f"{quantile:g}" for quantile in QUANTILES)),
)
LENGTH = histogram(
    "palaestra_trainer_episode_length_steps", "Steps of each training episode of this attempt.", LENGTHS
)
SUCCESS = gauge(
    "palaestra_trainer_episode_success_ratio",
    "Share of the last 100 training episodes of this attempt that succeeded.",
)

EVALUATIONS = counter(
    "palaestra_trainer_evaluations_total", "Evaluations in this attempt, confirmations included."
)
EVALUATION_SUCCESS = gauge(
    "palaestra_trainer_evaluation_success_ratio",
    "Share of successful episodes in the last evaluation or confirmation of this attempt.",
)
EVALUATION_BOUND = gauge(
    "palaestra_trainer_evaluation_success_bound_ratio",
    "Bounds of the 95 % interval around the success ratio of the last evaluation or confirmation.",
    Label(name="bound", values=("low", "high")),
)
EVALUATION_EPISODES = gauge(
    "palaestra_trainer_evaluation_episodes",
    "Number of episodes of the last evaluation or confirmation of this attempt.",
)
EVALUATION_RETURN = gauge(
    "palaestra_trainer_evaluation_return_mean",
    "Mean return of the episodes of the last evaluation or confirmation of this attempt.",
)
EVALUATION_LENGTH = gauge(
    "palaestra_trainer_evaluation_length_mean_steps",
    "Mean length of the episodes of the last evaluation or confirmation of this attempt.",
)

LOSS = gauge(
    "palaestra_trainer_loss",
    "Losses of the last update, the same values as train/* in TensorBoard.",
    Label(name="loss", values=LOSSES),
)
EXPLORATION = gauge(
    "palaestra_trainer_exploration",
    "Amount of exploration: DQN's exploration_rate, SAC's ent_coef, the std of the actions' distribution.",
    Label(name="measure", values=MEASURES),
)
LEARNING_RATE = gauge("palaestra_trainer_learning_rate", "Learning rate of the last update.")

CHECKPOINT_STEPS = gauge("palaestra_trainer_checkpoint_steps", "Step of the newest checkpoint.")
CHECKPOINT_INTERVAL = gauge(
    "palaestra_trainer_checkpoint_interval_steps",
    "Environment steps between two checkpoints (checkpoint.everySteps).",
)
CHECKPOINT_TIME = gauge(
    "palaestra_trainer_checkpoint_timestamp_seconds",
    "Unix time at which this attempt wrote its newest checkpoint.",
)
CHECKPOINT_DURATION = histogram(
    "palaestra_trainer_checkpoint_duration_seconds",
    "Time to write each checkpoint of this attempt.",
    CHECKPOINT_S,
)
CHECKPOINT_SIZE = gauge(
    "palaestra_trainer_checkpoint_size_bytes",
    "Size of the newest checkpoint of this attempt, with the files that it shares with older checkpoints.",
)
CHECKPOINT_FAILURES = counter(
    "palaestra_trainer_checkpoint_failures_total",
    "Checkpoints that this attempt could not write, because the disk was full.",
)

SIMULATORS = gauge(
    "palaestra_trainer_simulators", "Simulators by role and state, as the trainer sees them.", ROLE, STATE
)
BUILD = gauge(
    "palaestra_trainer_build_info",
    "Always 1; the label is the release.",
    Label(name="version", bound="release"),
)

FAULTS = counter(
    "palaestra_simulator_faults_total",
    "Faults that the trainer detected; `slow` counts steps that took too long, which are not faults.",
    SIMULATOR,
    KIND,
)
RESTARTS = counter(
    "palaestra_simulator_restarts_total",
    "Restarts by the fault that caused them; recycled: a healthy simulator reached a limit of `recycle`.",
    SIMULATOR,
    CAUSE,
)
BUDGET = gauge(
    "palaestra_simulator_restart_budget_spent_ratio",
    "Share of restart.limit spent within restart.withinSeconds; at 1, the next fault causes no restart.",
    SIMULATOR,
)
RESETS = counter("palaestra_simulator_resets_total", "Episodes begun, in training and evaluation.", SIMULATOR)
STEP_DURATION = histogram(
    "palaestra_simulator_step_duration_seconds",
    "Time from the request for an environment step to its result, without work for other simulators.",
    STEP_S,
    SIMULATOR,
)
SIMULATED = counter(
    "palaestra_simulator_simulated_seconds_total",
    "Simulated time; its rate is the real-time factor.",
    SIMULATOR,
)

FAMILIES: tuple[Family, ...] = (
    STEPS,
    TARGET_STEPS,
    STEPS_PER_SECOND,
    STEPS_LOST,
    EXTRA_STEPS,
    IDLE,
    STALL_DEADLINE,
    SECONDS,
    EPISODES,
    RETURN,
    RETURN_MEAN,
    RETURN_QUANTILE,
    LENGTH,
    SUCCESS,
    EVALUATIONS,
    EVALUATION_SUCCESS,
    EVALUATION_BOUND,
    EVALUATION_EPISODES,
    EVALUATION_RETURN,
    EVALUATION_LENGTH,
    LOSS,
    EXPLORATION,
    LEARNING_RATE,
    CHECKPOINT_STEPS,
    CHECKPOINT_INTERVAL,
    CHECKPOINT_TIME,
    CHECKPOINT_DURATION,
    CHECKPOINT_SIZE,
    CHECKPOINT_FAILURES,
    SIMULATORS,
    BUILD,
    FAULTS,
    RESTARTS,
    BUDGET,
    RESETS,
    STEP_DURATION,
    SIMULATED,
)
