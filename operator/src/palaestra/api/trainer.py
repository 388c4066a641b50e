"""The trainer: what is learned, how, for how long, and how it is measured and kept."""

from enum import StrEnum
from typing import Annotated

from pydantic import Field

from palaestra.api.container import Environment, Resources
from palaestra.api.fields import ENVIRONMENT_ID, Count, FreeObject, Image, Words
from palaestra.api.model import ApiModel, Rule

MOVE_TO_TARGET = "MoveToTargetEnv-v0"


class Reward(StrEnum):
    """When the environment pays."""

    DENSE = "Dense"
    SPARSE = "Sparse"


class AlgorithmName(StrEnum):
    """The algorithms that the trainer knows."""

    DQN = "DQN"
    PPO = "PPO"
    A2C = "A2C"
    SAC = "SAC"
    REINFORCE = "REINFORCE"


class PullPolicy(StrEnum):
    """When a node fetches an image."""

    ALWAYS = "Always"
    IF_NOT_PRESENT = "IfNotPresent"
    NEVER = "Never"


class Task(ApiModel):
    """The gymnasium environment."""

    id: Annotated[str, Field(min_length=1, max_length=128, pattern=ENVIRONMENT_ID)] = "MoveToTargetEnv-v0"
    """Its id in gymnasium's registry; `module:Name-v0` imports the module first."""

    reward: Reward = Field(default=Reward.DENSE, strict=False)
    """`Dense`: every step pays. `Sparse`: only the last step of an episode does."""

    options: FreeObject = Field(default={})
    """Keyword arguments of the environment, as in `gymnasium.make`."""


Bound = Annotated[float, Field(gt=0, le=1_000_000)]


class Normalize(ApiModel):
    """What is brought to one scale before it is learned from: Stable-Baselines3's VecNormalize.

    What is known of observations is kept in `model.zip`, since the policy cannot be used without it.
    Evaluations see as training saw, and their returns are true ones.
    """

    observations: bool = True
    """Each number of an observation is shifted and scaled by its running mean and deviation."""

    rewards: bool = True
    """Rewards are scaled by the running deviation of the discounted return."""

    clip_observations: Bound | None = None
    """The largest absolute value of a normalized observation; absent: 10."""

    clip_rewards: Bound | None = None
    """The largest absolute value of a normalized reward; absent: 10."""

    rules = (
        Rule(
            holds=lambda it: it.observations or it.rewards,
            cel="self.observations || self.rewards",
            message="nothing is normalized while observations and rewards are false; remove it",
        ),
        Rule(
            field="clipObservations",
            holds=lambda it: it.clip_observations is None or it.observations,
            cel="!has(self.clipObservations) || self.observations",
            message="no observation is normalized while observations is false; remove it",
        ),
        Rule(
            field="clipRewards",
            holds=lambda it: it.clip_rewards is None or it.rewards,
            cel="!has(self.clipRewards) || self.rewards",
            message="no reward is normalized while rewards is false; remove it",
        ),
    )


class Algorithm(ApiModel):
    """The learning algorithm."""

    name: AlgorithmName = Field(default=AlgorithmName.DQN, strict=False)
    """DQN, PPO, A2C and SAC are Stable-Baselines3's; REINFORCE is Palaestra's. DQN needs discrete
    actions, SAC a continuous one."""

    hyperparameters: FreeObject = Field(default={})
    """Keyword arguments of the algorithm's class, in its own spelling (`learning_rate`, not
    `learningRate`); absent ones have the defaults of docs/trainingjob.md."""

    normalize: Normalize | None = None
    """What is brought to one scale before it is learned from; `{}`: observations and rewards; absent:
    nothing."""


class Evaluation(ApiModel):
    """How the policy is measured while it learns."""

    every_steps: Count = 2500
    """Environment steps between two evaluations; 0: none."""

    episodes: Annotated[int, Field(ge=1, le=1000)] = 20
    """Episodes of one evaluation, always with the same seeds."""

    stop_at_success_rate: Annotated[float, Field(gt=0, le=1)] | None = None
    """Training ends when this share of an evaluation's episodes succeeds, above 0 and up to 1, and then
    of the episodes that confirm it; absent: it goes on for all `steps`."""

    confirm_episodes: Annotated[int, Field(ge=0, le=10_000)] | None = None
    """Episodes that confirm an evaluation that would end training, and the best one at its end, with
    seeds by which no policy was chosen; 0: none; absent: 100."""

    rules = (
        Rule(
            field="stopAtSuccessRate",
            holds=lambda it: it.stop_at_success_rate is None or it.every_steps > 0,
            cel="!has(self.stopAtSuccessRate) || self.everySteps > 0",
            message="nothing is evaluated while everySteps is 0; remove it or evaluate",
        ),
        Rule(
            field="confirmEpisodes",
            holds=lambda it: not it.confirm_episodes or it.every_steps > 0,
            cel="!has(self.confirmEpisodes) || self.confirmEpisodes == 0 || self.everySteps > 0",
            message="nothing is evaluated while everySteps is 0; remove it or evaluate",
        ),
    )


class Checkpoint(ApiModel):
    """How the run is kept."""

    every_steps: Annotated[int, Field(ge=1, le=2_000_000_000)] = 5000
    """Environment steps between two checkpoints, which are written at rollout boundaries."""

    keep: Annotated[int, Field(ge=1, le=100)] = 3
    """How many of the newest checkpoints are kept."""


def _actions(trainer: "Trainer") -> str | None:
    """Return what actions the task takes; None for a task that is not Palaestra's own."""
    if trainer.environment.id != MOVE_TO_TARGET:
        return None
    return str(trainer.environment.options.get("actions", "discrete"))


_ACTIONS = ("environment", "id", "options", "actions", "algorithm", "name")


class Trainer(ApiModel):
    """What is learned, how, and for how long."""

    image: Image | None = None
    """Container image; absent: the one of this release. Not used by `palaestra run`."""

    image_pull_policy: PullPolicy = Field(default=PullPolicy.IF_NOT_PRESENT, strict=False)
    """When a node fetches the pod's images: `Always`, `IfNotPresent` or `Never`."""

    environment: Task = Task()
    """The task, a gymnasium environment."""

    algorithm: Algorithm = Algorithm()
    """The learning algorithm and its hyperparameters."""

    steps: Annotated[int, Field(ge=1, le=2_000_000_000)] = 50_000
    """Environment steps to learn from, over all collecting simulators of a replica."""

    evaluation: Evaluation = Evaluation()
    """How the policy is measured while it learns."""

    checkpoint: Checkpoint = Checkpoint()
    """How the run is kept."""

    command: Words = ()
    """A program and its arguments in place of the built-in training loop; empty: the built-in."""

    env: Environment = ()
    """Environment variables of the trainer's container."""

    resources: Resources = Resources()
    """CPU, memory and GPUs of the trainer. Where `limits` or `requests` name a GPU (`nvidia.com/gpu`,
    `amd.com/gpu`), the built-in loop trains on it, if the image's PyTorch sees it; else on the CPU."""

    rules = (
        Rule(
            field="algorithm.name",
            holds=lambda it: it.algorithm.name is not AlgorithmName.SAC or _actions(it) != "discrete",
            reads=_ACTIONS,
            message="SAC needs continuous actions; set environment.options.actions: continuous",
        ),
        Rule(
            field="algorithm.name",
            holds=lambda it: it.algorithm.name is not AlgorithmName.DQN or _actions(it) != "continuous",
            reads=_ACTIONS,
            message="DQN needs discrete actions; set environment.options.actions: discrete",
        ),
    )
