"""Read and check training.yaml, the configuration of one replica.

The operator writes the file. The modules of this package read the file only through this module; reports and
experiment trackers show its text unchanged. A wrong file is refused before a simulator starts. The error
lists all mistakes of the file, each with field, fact and remedy. The hyperparameters of each algorithm are
defined in `palaestra_trainer.algorithms`, not here, because reading a configuration must not import a
learning library.

Unknown fields are logged and ignored. A job may name a `trainer.image` that is older than the operator that
writes the file. A newer operator writes a new field only if the job sets that field. A field that a user
misspelled does not reach this module, because the operator checks the job before it writes the file. An
unknown value of a known field is refused, because the training would differ from the job.
"""

from __future__ import annotations

import difflib
import os
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Annotated, Any, Literal, Self

import structlog
import yaml
from pydantic import BaseModel, Field, ValidationError, model_validator
from pydantic.alias_generators import to_camel
from pydantic_core import ErrorDetails

from palaestra_protocol.pod.enums import Role
from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.job.run_directory import RunDirectory
from palaestra_trainer.job.section import ConfigurationSection, Positive
from palaestra_trainer.job.simulator_configuration import SimulatorConfiguration
from palaestra_trainer.job.simulator_rules import simulator_mistake

log = structlog.get_logger(__name__)

_UNKNOWN = "extra_forbidden"  # pydantic's type of the error for an unknown field

CONFIG_VARIABLE = "PALAESTRA_CONFIG"
CONFIRM_EPISODES = 100  # a measured success rate of 95 % is then accurate to about 4 percentage points

Reward = Literal["Dense", "Sparse"]
Device = Literal["cpu", "cuda"]
Cnn = Literal["small"]
DEFAULT_REWARD: Reward = "Dense"
DEFAULT_ROBOT = "Robotino"


class Wrapper(ConfigurationSection):
    """A wrapper around the environment, see `environments.wrappers`.

    Attributes:
        name: class of the wrapper, as `module:Class`.
        options: keyword arguments of the class.
    """

    name: str
    options: dict[str, Any] = Field(default_factory=dict)


class Environment(ConfigurationSection):
    """The gymnasium environment to train in.

    Attributes:
        id: name under which the environment is registered with gymnasium.
        reward: with `Dense` the environment gives a reward at each step, with `Sparse` only at the end of an
            episode.
        options: keyword arguments of the environment.
        wrappers: wrappers around the environment, the innermost first; None: no wrappers.
        frame_stack: number of newest observations that are stacked into one observation; None: no stacking.
    """

    id: str
    reward: Reward = DEFAULT_REWARD
    options: dict[str, Any] = Field(default_factory=dict)
    wrappers: tuple[Wrapper, ...] | None = None
    frame_stack: Annotated[int, Field(ge=2)] | None = None


class Normalize(ConfigurationSection):
    """How observations and rewards are normalized before learning, see `algorithms.normalization`.

    Attributes:
        observations: whether each observation is normalized by its running mean and deviation.
        rewards: whether rewards are divided by the running deviation of the discounted return.
        clip_observations: the largest absolute value of a normalized observation.
        clip_rewards: the largest absolute value of a normalized reward.
    """

    observations: bool = True
    rewards: bool = True
    clip_observations: Annotated[float, Field(gt=0)] = 10.0
    clip_rewards: Annotated[float, Field(gt=0)] = 10.0


class Callback(ConfigurationSection):
    """A callback of the job's author, see `run.callbacks`.

    Attributes:
        name: class of the callback, as `module:Class`.
        options: keyword arguments of the class.
    """

    name: str
    options: dict[str, Any] = Field(default_factory=dict)


class Algorithm(ConfigurationSection):
    """The learning algorithm of the run.

    Attributes:
        name: a name in the table of algorithms, or `module:Class`.
        hyperparameters: values that replace the defaults of the algorithm.
        normalize: the values that are normalized; None: no values.
        cnn: the convolutional network for images; None: Stable-Baselines3's NatureCNN.
        policy: a policy of the algorithm, or `module:Class`; None: the algorithm's policy for this type of
            observation.
        callbacks: callbacks of the job's author, in the order of their calls; None: no callbacks.
    """

    name: str = "DQN"
    hyperparameters: dict[str, Any] = Field(default_factory=dict)
    normalize: Normalize | None = None
    cnn: Cnn | None = None
    policy: str | None = None
    callbacks: tuple[Callback, ...] | None = None


class Evaluation(ConfigurationSection):
    """When the policy is evaluated, on how many episodes, and the success rate that ends training.

    Attributes:
        every_steps: environment steps between two evaluations; 0: no evaluations.
        episodes: episodes of one evaluation, shared among all evaluating simulators.
        stop_at_success_rate: training ends when this share of the episodes (0 to 1) succeeds in an evaluation
            and again in its confirmation.
        confirm_episodes: episodes of a confirmation; 0: no confirmation; None: `CONFIRM_EPISODES`.
    """

    every_steps: Annotated[int, Field(ge=0)] = 2500
    episodes: Positive = 20
    stop_at_success_rate: Annotated[float, Field(gt=0, le=1)] | None = None
    confirm_episodes: Annotated[int, Field(ge=0)] | None = None

    @property
    def confirming(self) -> int:
        """Episodes of a confirmation; 0: no confirmation."""
        return CONFIRM_EPISODES if self.confirm_episodes is None else self.confirm_episodes


class Checkpoint(ConfigurationSection):
    """How often a checkpoint is saved, and how many of the newest checkpoints are kept."""

    every_steps: Positive = 5000
    keep: Positive = 3


class Configuration(ConfigurationSection):
    """The complete configuration of one replica, which the operator derives from the TrainingJob.

    Attributes:
        seed: the job's seed plus the replica's index; all other seeds are derived from this seed.
        device: device of the model; `cuda` is the GPU that the job requested, or the CPU if PyTorch finds no
            GPU.
        steps: number of valid environment steps of the whole run, of all simulators together.
        collection: whether a vector step waits for all collecting simulators (`Synchronous`), or returns as
            soon as one of them has a row (`Asynchronous`); None: `Synchronous`.
        resume_from: the run directory of another job; a run that has not saved a checkpoint yet resumes from
            the newest checkpoint in that directory.
        initial_policy: a model.zip with whose policy a new run begins; None: random weights.
        stall_deadline_seconds: the run fails after this number of seconds without an environment step.
        robot: class of the robot, `module:Class` or a name of `simulators.robot_registry`; None:
            `DEFAULT_ROBOT`.
        command: the user's own program that replaces the built-in training loop; the trainer does not read
            it.
        status_address: `host:port` of /metrics, /status and /healthz.
    """

    job: str
    namespace: str = "default"
    uid: str = ""
    replica: Annotated[int, Field(ge=0)] = 0
    seed: Annotated[int, Field(ge=0)] = 0
    environment: Environment
    robot: Annotated[str, Field(min_length=1)] | None = None
    algorithm: Algorithm = Field(default_factory=Algorithm)
    device: Device = "cpu"
    steps: Positive
    collection: Literal["Synchronous", "Asynchronous"] | None = None
    evaluation: Evaluation = Field(default_factory=Evaluation)
    checkpoint: Checkpoint = Field(default_factory=Checkpoint)
    resume_from: Annotated[str, Field(min_length=1)] | None = None
    initial_policy: Annotated[str, Field(min_length=1)] | None = None
    stall_deadline_seconds: Annotated[float, Field(gt=0)] = 600
    command: tuple[str, ...] | None = None
    status_address: Annotated[str, Field(pattern=r"^[^:\s]+:\d{1,5}$")] = "127.0.0.1:9090"
    simulators: Annotated[tuple[SimulatorConfiguration, ...], Field(min_length=1)]

    def with_role(self, role: Role) -> tuple[SimulatorConfiguration, ...]:
        """Return the simulators of one role, in the order of the file."""
        return tuple(simulator for simulator in self.simulators if simulator.role == role)

    @model_validator(mode="after")
    def _simulators_fit_together(self) -> Self:
        own_program, asynchronous = self.command is not None, self.collection == "Asynchronous"
        if mistake := simulator_mistake(self.simulators, own_program=own_program, asynchronous=asynchronous):
            raise ValueError(mistake)
        return self


def load(path: Path | None = None) -> Configuration:
    """Return the configuration in the file `path`; None stands for the file that PALAESTRA_CONFIG names.

    Raises:
        ConfigurationError: the file is missing, not YAML, or wrong; the message has one line for each
            mistake.
    """
    chosen = path or _path_of_environment(os.environ)
    try:
        content = yaml.safe_load(chosen.read_bytes())
    except OSError as error:
        raise ConfigurationError(
            f"{chosen}: cannot be read ({error.strerror}); name the file with {CONFIG_VARIABLE}"
        ) from error
    except yaml.YAMLError as error:
        raise ConfigurationError(f"{chosen}: is not YAML: {error}") from error
    return parse(content, source=chosen.name)


def load_run(folder: Path) -> Configuration:
    """Return the configuration of the run in `folder`.

    Raises:
        ConfigurationError: `folder` is not a run directory, or its training.yaml is wrong.
    """
    file = RunDirectory(folder).configuration
    if not file.exists():
        raise ConfigurationError(
            f"{folder}: has no training.yaml; give a run directory, such as runs/<job>/<replica>"
        )
    return load(file)


def parse(content: object, *, source: str = "training.yaml") -> Configuration:
    """Return the configuration that `content` describes, which is the Python data of a YAML document.

    Raises:
        ConfigurationError: the message has one line for each mistake, with field, fact and remedy.
    """
    try:
        return Configuration.model_validate(content)
    except ValidationError as error:
        for mistake in error.errors():
            if mistake["type"] == _UNKNOWN:
                log.warning("unknown field ignored", **_unknown(mistake), file=source)
    try:
        return Configuration.model_validate(content, extra="ignore")
    except ValidationError as error:
        lines = (f"{source}: {line}" for line in _mistakes(error))
        raise ConfigurationError("\n".join(lines)) from error


def dump(configuration: Configuration) -> str:
    """Return YAML text from which `load` reads an equal configuration."""
    content = configuration.model_dump(mode="json", by_alias=True, exclude_none=True)
    # The text is pure ASCII, because YAML reads some other characters as line ends.
    return yaml.safe_dump(content, sort_keys=False)


def nearest(word: str, known: Mapping[str, object] | list[str], likeness: float = 0.6) -> str:
    """Return the remedy for an unknown name: use the most similar known name, or one of all known names.

    Args:
        word: the unknown name.
        known: the known names.
        likeness: the least similarity, 0 to 1, with which a known name is suggested.
    """
    close = difflib.get_close_matches(word, list(known), n=1, cutoff=likeness)
    return f"did you mean {close[0]}?" if close else f"use one of {', '.join(sorted(known))}"


def _path_of_environment(environment: Mapping[str, str]) -> Path:
    name = environment.get(CONFIG_VARIABLE)
    if not name:
        raise ConfigurationError(f"{CONFIG_VARIABLE}: is not set; set it to the path of a training.yaml")
    return Path(name)


def _mistakes(error: ValidationError) -> Iterator[str]:
    for mistake in error.errors():
        field = _field(mistake["loc"])
        match mistake["type"]:
            case "missing":
                yield f"{field}: is missing; add it"
            case "value_error" if not mistake["loc"]:
                yield mistake["msg"].removeprefix("Value error, ")
            case _:
                yield f"{field}: {mistake['input']!r} is refused; {mistake['msg']}"


def _unknown(mistake: ErrorDetails) -> dict[str, str]:
    return {"field": _field(mistake["loc"]), "hint": _nearest_field(mistake)}


def _field(location: tuple[int | str, ...]) -> str:
    parts = (f"[{part}]" if isinstance(part, int) else f".{part}" for part in location)
    return "".join(parts).removeprefix(".") or "the document"


def _nearest_field(mistake: ErrorDetails) -> str:
    section: Any = Configuration
    for part in mistake["loc"][:-1]:
        if isinstance(part, str):
            section = _section_of(section, part)
    return nearest(str(mistake["loc"][-1]), [to_camel(name) for name in section.model_fields])


def _section_of(section: type[BaseModel], alias: str) -> type[BaseModel]:
    by_alias = {to_camel(name): field for name, field in section.model_fields.items()}
    return next(
        kind
        for kind in (*_arguments(by_alias[alias].annotation), by_alias[alias].annotation)
        if isinstance(kind, type) and issubclass(kind, BaseModel)
    )


def _arguments(annotation: Any) -> tuple[Any, ...]:
    return getattr(annotation, "__args__", ())
