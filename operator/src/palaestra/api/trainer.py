"""The trainer: task, algorithm, length of training, evaluation and checkpoints."""

from enum import StrEnum
from typing import Annotated

from pydantic import Field

from palaestra.api.container import Environment, Resources
from palaestra.api.fields import (
    ALGORITHM,
    CLASS_NAME,
    ENVIRONMENT_ID,
    POLICY,
    POLICY_FILE,
    ROBOT,
    Count,
    FreeObject,
    Image,
    Listed,
    ObjectName,
    Words,
)
from palaestra.api.model import ApiModel, Rule
from palaestra.api.passwords import NO_PASSWORD_IN_COMMAND, NO_PASSWORD_IN_OPTIONS

OWN_TASKS = frozenset(
    {"MoveToTargetEnv-v0", "MoveToTargetGoalEnv-v0", "SeeTarget-v0", "Deliver-v0", "Navigate-v0"}
)


class Reward(StrEnum):
    """At which steps the environment gives a reward."""

    DENSE = "Dense"
    SPARSE = "Sparse"


class Cnn(StrEnum):
    """The convolutional networks for images besides Stable-Baselines3's own."""

    SMALL = "small"


class Collection(StrEnum):
    """Whether a step of the trainer waits for all collecting simulators."""

    SYNCHRONOUS = "Synchronous"
    ASYNCHRONOUS = "Asynchronous"


class PullPolicy(StrEnum):
    """When a node pulls an image."""

    ALWAYS = "Always"
    IF_NOT_PRESENT = "IfNotPresent"
    NEVER = "Never"


class EnvironmentWrapper(ApiModel):
    """A wrapper of gymnasium or of your own, derived from gymnasium.Wrapper."""

    name: Annotated[str, Field(min_length=1, max_length=256, pattern=CLASS_NAME)]
    """Class of the wrapper as `module:Class`, such as `gymnasium.wrappers:ClipAction`; the trainer must be
    able to import the module."""

    options: FreeObject = Field(default={})
    """Keyword arguments of the class."""

    guards = (NO_PASSWORD_IN_OPTIONS,)


class Task(ApiModel):
    """The gymnasium environment."""

    id: Annotated[str, Field(min_length=1, max_length=128, pattern=ENVIRONMENT_ID)] = "MoveToTargetEnv-v0"
    """Id in gymnasium's registry; `module:Name-v0` imports the module first."""

    reward: Reward = Field(default=Reward.DENSE, strict=False)
    """`Dense`: a reward at every step. `Sparse`: a reward at the last step of an episode only, or with
    `MoveToTargetGoalEnv-v0` at each step within 0.20 m of the goal."""

    options: FreeObject = Field(default={})
    """Keyword arguments of the environment, as in `gymnasium.make`."""

    wrappers: Annotated[Listed[EnvironmentWrapper], Field(max_length=16)] | None = None
    """Wrappers around the environment, the first one innermost. Training, evaluations and the exported
    policy use the observations and actions of the wrapped environment."""

    frame_stack: Annotated[int, Field(ge=2, le=64)] | None = None
    """Number of newest observations that are stacked into one for the policy, in the layout of
    Stable-Baselines3's VecFrameStack. The observations are stacked after all wrappers. Absent: the policy
    gets the newest observation only."""

    guards = (NO_PASSWORD_IN_OPTIONS,)


Bound = Annotated[float, Field(gt=0, le=1_000_000)]


class Normalize(ApiModel):
    """Normalization of observations and rewards with Stable-Baselines3's VecNormalize.

    `model.zip` contains the statistics of the observations, because the policy needs them. Evaluations
    normalize observations with these statistics and report unscaled returns.
    """

    observations: bool = True
    """Whether each number of an observation is normalized by its running mean and standard deviation."""

    rewards: bool = True
    """Whether rewards are divided by the running standard deviation of the discounted return."""

    clip_observations: Bound | None = None
    """Largest absolute value of a normalized observation; absent: 10."""

    clip_rewards: Bound | None = None
    """Largest absolute value of a normalized reward; absent: 10."""

    rules = (
        Rule(
            holds=lambda normalize: normalize.observations or normalize.rewards,
            cel="self.observations || self.rewards",
            message="has no effect while observations and rewards are both false; remove it",
        ),
        Rule(
            field="clipObservations",
            holds=lambda normalize: normalize.clip_observations is None or normalize.observations,
            cel="!has(self.clipObservations) || self.observations",
            message="has no effect while observations is false; remove it",
        ),
        Rule(
            field="clipRewards",
            holds=lambda normalize: normalize.clip_rewards is None or normalize.rewards,
            cel="!has(self.clipRewards) || self.rewards",
            message="has no effect while rewards is false; remove it",
        ),
    )


class Callback(ApiModel):
    """A callback of your own, derived from Stable-Baselines3's BaseCallback."""

    name: Annotated[str, Field(min_length=1, max_length=256, pattern=CLASS_NAME)]
    """Class of the callback as `module:Class`; the trainer must be able to import the module."""

    options: FreeObject = Field(default={})
    """Keyword arguments of the class."""

    guards = (NO_PASSWORD_IN_OPTIONS,)


class Algorithm(ApiModel):
    """The learning algorithm."""

    name: Annotated[str, Field(min_length=1, max_length=256, pattern=ALGORITHM)] = "DQN"
    """From Stable-Baselines3: DQN, PPO, A2C, SAC, TD3 and DDPG. From sb3-contrib: QRDQN, TQC, TRPO, CrossQ,
    RecurrentPPO and MaskablePPO. From Palaestra: REINFORCE. `module:Class` is a class of yours that is
    compatible with Stable-Baselines3. docs/reference/algorithms.md lists the observations and actions that
    each algorithm supports."""

    hyperparameters: FreeObject = Field(default={})
    """Keyword arguments of the algorithm's class, spelled as in Python (`learning_rate`, not
    `learningRate`); docs/reference/trainingjob.md lists the defaults."""

    normalize: Normalize | None = None
    """Normalization of observations and rewards; `{}`: both; absent: neither."""

    cnn: Cnn | None = Field(default=None, strict=False)
    """Convolutional network for observations that are images. `small`: 16 and 32 channels and 128 units; this
    network trains about twice as fast as NatureCNN. Absent: Stable-Baselines3's NatureCNN."""

    policy: Annotated[str, Field(min_length=1, max_length=256, pattern=POLICY)] | None = None
    """Policy of the algorithm, such as MlpPolicy, or `module:Class`; absent: the policy that fits the
    observation space."""

    callbacks: Annotated[Listed[Callback], Field(max_length=16)] | None = None
    """Callbacks that the built-in loop calls at every step and rollout, in the order of this list."""


class InitialPolicy(ApiModel):
    """The policy with which a new run begins, instead of random weights."""

    claim: ObjectName | None = None
    """Claim in the job's namespace with the label `palaestra.dev/for-jobs: "true"`, mounted read-only.
    Absent: the file is in the trainer's image (`palaestra run`: on this machine)."""

    path: Annotated[str, Field(min_length=1, max_length=1024, pattern=POLICY_FILE)]
    """Path of a `model.zip`, or of a policy package as a zip: relative to the claim, such as
    `<job UID>/<replica>/model.zip`, or absolute without a claim. Only the tensors and the statistics of
    the normalization are read, so the file must have the same networks as the job's policy."""

    rules = (
        Rule(
            field="path",
            holds=lambda initial: (initial.claim is None) == initial.path.startswith("/"),
            cel="has(self.claim) != self.path.startsWith('/')",
            message="must be relative with a claim and absolute without one; change it",
        ),
    )


class Evaluation(ApiModel):
    """Evaluation of the policy during training."""

    every_steps: Count = 2500
    """Environment steps between two evaluations; 0: no evaluations."""

    episodes: Annotated[int, Field(ge=1, le=1000)] = 20
    """Episodes of one evaluation; every evaluation uses the same seeds."""

    stop_at_success_rate: Annotated[float, Field(gt=0, le=1)] | None = None
    """Success rate, above 0 and up to 1, at which training ends early. An evaluation must reach this rate,
    and then the confirmation of that evaluation must reach it too. Absent: training runs for all `steps`."""

    confirm_episodes: Annotated[int, Field(ge=0, le=10_000)] | None = None
    """Number of episodes of a confirmation: a policy is evaluated again with other seeds. The policy of an
    evaluation that would end training is confirmed, and so is the best policy at the end of training. 0: no
    confirmation; absent: 100."""

    rules = (
        Rule(
            field="stopAtSuccessRate",
            holds=lambda evaluation: evaluation.stop_at_success_rate is None or evaluation.every_steps > 0,
            cel="!has(self.stopAtSuccessRate) || self.everySteps > 0",
            message="has no effect while everySteps is 0; remove it or raise everySteps",
        ),
        Rule(
            field="confirmEpisodes",
            holds=lambda evaluation: not evaluation.confirm_episodes or evaluation.every_steps > 0,
            cel="!has(self.confirmEpisodes) || self.confirmEpisodes == 0 || self.everySteps > 0",
            message="has no effect while everySteps is 0; remove it or raise everySteps",
        ),
    )


class Checkpoint(ApiModel):
    """How often a checkpoint is saved, and how many are kept."""

    every_steps: Annotated[int, Field(ge=1, le=2_000_000_000)] = 5000
    """Environment steps between two checkpoints; a checkpoint is saved at the end of a rollout."""

    keep: Annotated[int, Field(ge=1, le=100)] = 3
    """Number of newest checkpoints that are kept; older checkpoints are deleted."""


def _actions(trainer: "Trainer") -> str | None:
    """Return the type of actions of a built-in task, discrete or continuous; None for other tasks."""
    if trainer.environment.id not in OWN_TASKS:
        return None
    return str(trainer.environment.options.get("actions", "discrete"))


_ACTIONS = ("environment", "id", "options", "actions", "algorithm", "name")


def _needs(algorithm: str, actions: str, others: str) -> Rule:
    """Return the rule that refuses `algorithm` in a built-in task whose actions are `others`."""
    return Rule(
        field="algorithm.name",
        holds=lambda trainer: trainer.algorithm.name != algorithm or _actions(trainer) != others,
        reads=_ACTIONS,
        message=f"{algorithm} needs {actions} actions; set environment.options.actions: {actions}",
    )


_LEARN_FROM_ROLLOUTS = ("A2C", "MaskablePPO", "PPO", "REINFORCE", "RecurrentPPO", "TRPO")
ROLLOUTS_ARE_SYNCHRONOUS = Rule(
    field="collection",
    holds=lambda trainer: (
        trainer.collection is not Collection.ASYNCHRONOUS
        or trainer.algorithm.name not in _LEARN_FROM_ROLLOUTS
    ),
    cel=(
        "!has(self.collection) || self.collection != 'Asynchronous' || "
        f"!(self.algorithm.name in {[*_LEARN_FROM_ROLLOUTS]})"
    ),
    message="Asynchronous needs an off-policy algorithm; remove the field, or use DQN, SAC or a similar one",
)


class Trainer(ApiModel):
    """The task, the algorithm and the length of training."""

    image: Image | None = None
    """Container image; absent: this release's image. `palaestra run` ignores it."""

    image_pull_policy: PullPolicy = Field(default=PullPolicy.IF_NOT_PRESENT, strict=False)
    """When a node pulls the pod's images: `Always`, `IfNotPresent` or `Never`."""

    environment: Task = Task()
    """The task, a gymnasium environment."""

    robot: Annotated[str, Field(min_length=1, max_length=128, pattern=ROBOT)] | None = None
    """Class of the robot in the world: `Robotino`, `TurtleBot3Burger`, `EPuck`, or `module:Class`, a
    `SimulatedRobot` that the trainer can import; absent: `Robotino`."""

    algorithm: Algorithm = Algorithm()
    """The learning algorithm and its hyperparameters."""

    steps: Annotated[int, Field(ge=1, le=2_000_000_000)] = 50_000
    """Environment steps to train for, summed over all collecting simulators of a replica."""

    collection: Collection | None = Field(default=None, strict=False)
    """`Synchronous`: each step waits for all collecting simulators. `Asynchronous`: a slow simulator does not
    hold back the others. Only off-policy algorithms, such as DQN and SAC, support `Asynchronous`, and a
    resumed run then differs from an uninterrupted run. Absent: `Synchronous`."""

    evaluation: Evaluation = Evaluation()
    """Evaluation of the policy during training."""

    checkpoint: Checkpoint = Checkpoint()
    """How often a checkpoint is saved, and how many are kept."""

    initial_policy: InitialPolicy | None = None
    """Policy with which a new run begins. A run that has a checkpoint resumes from the checkpoint instead.
    Absent: the weights are random."""

    command: Words = ()
    """Program and arguments that replace the built-in training loop; empty: the built-in loop."""

    env: Environment = ()
    """Environment variables of the trainer's container."""

    resources: Resources = Resources()
    """CPU, memory and GPUs of the trainer. If `limits` or `requests` name a GPU (`nvidia.com/gpu`,
    `amd.com/gpu`) and the image's PyTorch finds the GPU, the built-in loop trains on the GPU; otherwise it
    trains on the CPU."""

    rules = (
        *(_needs(name, "continuous", "discrete") for name in ("SAC", "TD3", "DDPG", "TQC", "CrossQ")),
        *(_needs(name, "discrete", "continuous") for name in ("DQN", "QRDQN")),
        ROLLOUTS_ARE_SYNCHRONOUS,
    )
    guards = (NO_PASSWORD_IN_COMMAND,)
