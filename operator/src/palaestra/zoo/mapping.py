"""The field of a TrainingJob for each key of an entry of RL-Baselines3-Zoo.

As in Zoo, a key that is not in the tables of this module is a keyword argument of the algorithm's class. The
trainer compares these arguments with the class before it starts a simulator.
"""

import math
import re
from collections.abc import Callable, Iterator, Mapping
from typing import Any

from palaestra.api.fields import CLASS
from palaestra.zoo import expressions
from palaestra.zoo.draft import MOST_COLLECTING, Draft
from palaestra.zoo.expressions import NotPlain
from palaestra.zoo.hyperparameter_file import CHOOSES_ALGORITHM
from palaestra_protocol.foreign_words import ELSEWHERE

_SCHEDULED = frozenset({"clip_range", "clip_range_vf", "delta_std", "learning_rate"})
_OFF_POLICY = frozenset({"DQN", "SAC", "TD3", "DDPG", "QRDQN", "TQC", "CrossQ"})
_LINEAR = re.compile(r"lin_\d+(\.\d*)?(e-?\d+)?")
_HINDSIGHT = "HerReplayBuffer"
_GOALS = ("n_sampled_goal", "goal_selection_strategy")
# A run fixes these options of replay buffers. The table has the fixed values.
_BUFFER_OPTIONS: Mapping[str, object] = {
    "copy_info_dict": False,
    "handle_timeout_termination": True,
    "online_sampling": True,
}
_NORMALIZE = {
    "norm_obs": "observations",
    "norm_reward": "rewards",
    "clip_obs": "clipObservations",
    "clip_reward": "clipRewards",
}
_LENGTH = "max_episode_length"  # a hyperparameter in her.yml
# The callbacks that a run replaces, with the remedy for each.
_CALLBACKS: Mapping[str, str] = {
    "CheckpointCallback": "a run saves checkpoints; set trainer.checkpoint.everySteps",
    "EvalCallback": "a run evaluates; set trainer.evaluation",
    "ProgressBarCallback": "palaestra run and palaestra watch show the progress",
    "StopTrainingOnMaxEpisodes": "training ends by steps; set trainer.steps",
    "StopTrainingOnNoModelImprovement": "it works only inside EvalCallback; write a callback of your own",
    "StopTrainingOnRewardThreshold": "a run stops by success; set trainer.evaluation.stopAtSuccessRate",
}


def note_together(draft: Draft) -> None:
    """Add notes about combinations of keys, after all keys were converted."""
    normalized = draft.algorithm.get("normalize", {}).get("observations", False)
    if draft.frame_stack is not None and normalized:
        draft.note("frame_stack", "a run stacks observations, then normalizes; Zoo normalizes, then stacks")


def put(draft: Draft, word: str, value: Any) -> None:
    """Convert one key of an entry, or add a note with the reason for which the key is left out."""
    if word == CHOOSES_ALGORITHM:
        return
    if word in _PLACES:
        _PLACES[word](draft, value)
    elif word == _LENGTH:
        draft.note(word, "left out; current replay buffers need no episode length")
    elif word in ELSEWHERE:
        draft.note(word, f"left out; {ELSEWHERE[word].removesuffix('; leave it out')}")
    elif word in _SCHEDULED and isinstance(value, str):
        draft.hyperparameters[word] = _schedule(draft, word, value)
    else:
        draft.hyperparameters[word] = value


def _timesteps(draft: Draft, value: Any) -> None:
    draft.steps = _whole(draft, "n_timesteps", value)


def _environments(draft: Draft, value: Any) -> None:
    number = _whole(draft, "n_envs", value)
    draft.collecting = 1 if number is None else min(number, MOST_COLLECTING)
    if number is not None and number > MOST_COLLECTING:
        draft.note(
            "n_envs",
            f"{value} became {MOST_COLLECTING}, because a pod has at most 32 simulators and one evaluates; "
            "a rollout has n_steps rows of each simulator, so it is shorter in the same proportion",
        )


def _seed(draft: Draft, value: Any) -> None:
    draft.seed = _whole(draft, "seed", value)


def _policy(draft: Draft, value: Any) -> None:
    draft.algorithm["policy"] = _as_class(str(value))


def _normalize(draft: Draft, value: Any) -> None:
    if not value:
        return
    chosen: dict[str, Any] = {"observations": True, "rewards": True}
    for name, option in _options(draft, "normalize", {} if value is True else value):
        if name in _NORMALIZE:
            chosen[_NORMALIZE[name]] = option
        elif name != "gamma" or "gamma" not in draft.entry:  # in Zoo, the entry's gamma overrides this gamma
            draft.note(f"normalize.{name}", "left out; algorithm.normalize has no such field")
    if not chosen["observations"]:
        chosen.pop("clipObservations", None)
    if not chosen["rewards"]:
        chosen.pop("clipRewards", None)
    if chosen["observations"] or chosen["rewards"]:
        draft.algorithm["normalize"] = chosen


def _policy_arguments(draft: Draft, value: Any) -> None:
    arguments = dict(_options(draft, "policy_kwargs", value))
    layers = arguments.get("net_arch")
    if isinstance(layers, list) and any(isinstance(layer, dict) for layer in layers):
        if len(layers) == 1:  # the format of Stable-Baselines3 before 1.8, which gives the same networks
            arguments["net_arch"] = layers[0]
        else:
            del arguments["net_arch"]
            draft.note(
                "policy_kwargs.net_arch",
                "left out; since 1.8, Stable-Baselines3 has no layers that policy and value share; "
                "write {pi: [...], vf: [...]}",
            )
    if arguments:
        draft.hyperparameters["policy_kwargs"] = arguments


def _buffer_class(kind: str) -> Callable[[Draft, Any], None]:
    """Return the converter for the class of a buffer; `kind` is `replay` or `rollout`."""

    def place(draft: Draft, value: Any) -> None:
        if value is not None:
            name = _HINDSIGHT if _is_hindsight(value) else _as_class(str(value))
            draft.hyperparameters[f"{kind}_buffer_class"] = name

    return place


def _buffer_arguments(kind: str) -> Callable[[Draft, Any], None]:
    """Return the converter for a buffer's options; a run sets the options of built-in buffers itself."""

    def place(draft: Draft, value: Any) -> None:
        chosen = draft.entry.get(f"{kind}_buffer_class")
        for name, option in _options(draft, f"{kind}_buffer_kwargs", value):
            if _takes(chosen, name):
                draft.hyperparameters.setdefault(f"{kind}_buffer_kwargs", {})[name] = option
            else:
                _buffer_option(draft, f"{kind}_buffer_kwargs.{name}", option)

    return place


def _takes(buffer: Any, option: str) -> bool:
    """Return whether the buffer of an entry accepts an option; a custom buffer may accept any option."""
    if buffer is None:
        return False
    return option in _GOALS if _is_hindsight(buffer) else option not in _BUFFER_OPTIONS


def _is_hindsight(buffer: Any) -> bool:
    return str(buffer).rpartition(".")[2] == _HINDSIGHT


def _buffer_option(draft: Draft, word: str, option: Any) -> None:
    name = word.rpartition(".")[2]
    if name not in _BUFFER_OPTIONS:
        draft.note(word, "left out; the buffer of a run has no such option")
    elif option is _BUFFER_OPTIONS[name]:
        draft.note(word, f"left out; in a run, its value is {option}, as in the file")
    else:
        draft.note(word, f"left out; in a run, its value is {_BUFFER_OPTIONS[name]}, unlike in the file")


def _old_hindsight(word: str) -> Callable[[Draft, Any], None]:
    """Return the converter for a key of Zoo's her.yml, in which HER is not a replay buffer yet."""

    def place(draft: Draft, value: Any) -> None:
        draft.hyperparameters["replay_buffer_class"] = _HINDSIGHT
        draft.hyperparameters.setdefault("replay_buffer_kwargs", {})[word] = value

    return place


def _memory(draft: Draft, value: Any) -> None:
    same = "unlike in the file" if value else "as in the file"
    draft.note("optimize_memory_usage", f"left out; in a run, its value is always false, {same}")


def _noise_type(draft: Draft, value: Any) -> None:
    if value is None:
        return
    deviation = _number(draft.entry.get("noise_std"))
    if deviation == 0:
        draft.note("noise_type", "left out, as noise_std is 0; a run adds no noise")
        return
    kinds = ("normal", "ornstein-uhlenbeck")
    kind = next((kind for kind in kinds if kind in str(value)), str(value))
    draft.hyperparameters |= {"noise_type": kind, "noise_std": deviation}


def _noise_deviation(draft: Draft, value: Any) -> None:
    if draft.entry.get("noise_type") is None:
        draft.note("noise_std", f"{value} is left out; without noise_type it has no effect")


def _steps_of_returns(draft: Draft, value: Any) -> None:
    if draft.name in _OFF_POLICY:
        if value != 1:
            draft.note(
                "n_steps", f"{value} is left out; rows of several simulators share a buffer, so only 1 works"
            )
        return
    draft.hyperparameters["n_steps"] = value


def _callbacks(draft: Draft, value: Any) -> None:
    for name, options in _classes(draft, "callback", value):
        module, _, last = name.rpartition(".")
        if reason := _CALLBACKS.get(last):
            draft.note("callback", f"{name} is left out; {reason}")
        elif module.startswith("rl_zoo3"):
            draft.note(
                "callback", f"{name} is left out; it needs Zoo's own training; write a callback of your own"
            )
        else:
            callback: dict[str, Any] = {"name": _as_class(name)}
            draft.algorithm.setdefault("callbacks", []).append(
                {**callback, "options": options} if options else callback
            )


def _wrappers(draft: Draft, value: Any) -> None:
    for name, options in _classes(draft, "env_wrapper", value):
        draft.wrappers.append({"name": _as_class(name), **({"options": options} if options else {})})
        if name.startswith("rl_zoo3."):
            draft.note("env_wrapper", f"{name} needs the package rl_zoo3; install it in the trainer's image")
    if draft.wrappers:
        draft.note("env_wrapper", "a run sums the rewards after the wrappers, Zoo the rewards before them")


def _vector_wrappers(draft: Draft, value: Any) -> None:
    for name, options in _classes(draft, "vec_env_wrapper", value):
        if name.rpartition(".")[2] == "VecFrameStack" and options.keys() == {"n_stack"}:
            _frames(draft, options["n_stack"])
            continue
        arguments = f" with {options}" if options else ""
        draft.note("vec_env_wrapper", f"{name}{arguments} is left out; {ELSEWHERE['vec_env_wrapper']}")


def _frames(draft: Draft, value: Any) -> None:
    number = None if value is None else _whole(draft, "frame_stack", value)
    if number is None or number == 1:  # a stack of one frame is the observation itself
        return
    draft.frame_stack = number


def _environment_arguments(draft: Draft, value: Any) -> None:
    draft.options |= dict(_options(draft, "env_kwargs", value))


def _options(draft: Draft, word: str, value: Any) -> Iterator[tuple[str, Any]]:
    """Yield the entries of a mapping in YAML or in a Python expression; add notes about other values."""
    if value is None:
        return
    try:
        found = list(expressions.entries(value) if isinstance(value, str) else value.items())
    except (NotPlain, AttributeError) as error:
        fact = error if isinstance(error, NotPlain) else f"{value!r} is not a mapping"
        draft.note(word, f"left out; {fact}; write its values into the job")
        return
    for name, option in found:
        if isinstance(option, NotPlain):
            draft.note(f"{word}.{name}", f"left out; {option}; write its value into the job")
        else:
            yield name, option


def _classes(draft: Draft, word: str, value: Any) -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield the dotted name and the arguments of each class in keys such as `env_wrapper` and `callback`."""
    if value is None:
        return
    for item in value if isinstance(value, list) else [value]:
        match item:
            case str():
                yield item, {}
            case dict() if len(item) == 1:
                name, options = next(iter(item.items()))
                yield name, dict(options or {})
            case _:
                draft.note(
                    word, f"{item!r} is left out, because it does not name a class; check the indentation"
                )


def _schedule(draft: Draft, word: str, value: str) -> Any:
    """Return a schedule in the format of a job; in Zoo, each `<word>_<value>` falls linearly to 0."""
    if _LINEAR.fullmatch(value):
        return value
    kind, _, rest = value.partition("_")
    number = _number(rest)
    if number is None:
        return value  # the trainer refuses the value and lists the accepted forms
    if kind not in {"lin", "linear"}:
        draft.note(word, f"{value} falls linearly to 0, as in Zoo, which treats every schedule as linear")
    return [[0, number], [1, 0.0]]


def _whole(draft: Draft, word: str, value: Any) -> int | None:
    """Return a number without its fraction, as Zoo does; add a note if the value is not a number."""
    number = _number(value)
    if number is None:
        draft.note(word, f"left out; {value!r} is not a number; write one")
    return None if number is None else int(number)


def _number(value: Any) -> float | None:
    try:
        number = math.nan if isinstance(value, bool) else float(value)
    except (TypeError, ValueError):
        return None
    return number if math.isfinite(number) else None


def _as_class(name: str) -> str:
    """Return `module:Class` for a dotted name; return a name without dots unchanged."""
    module, _, last = name.rpartition(".")
    written = f"{module}:{last}"
    return written if module and re.fullmatch(CLASS, written) else name


_PLACES: Mapping[str, Callable[[Draft, Any], None]] = {
    "callback": _callbacks,
    "env_kwargs": _environment_arguments,
    "env_wrapper": _wrappers,
    "frame_stack": _frames,
    "goal_selection_strategy": _old_hindsight("goal_selection_strategy"),
    "n_envs": _environments,
    "n_sampled_goal": _old_hindsight("n_sampled_goal"),
    "n_steps": _steps_of_returns,
    "n_timesteps": _timesteps,
    "noise_std": _noise_deviation,
    "noise_type": _noise_type,
    "normalize": _normalize,
    "online_sampling": lambda draft, value: _buffer_option(draft, "online_sampling", value),
    "optimize_memory_usage": _memory,
    "policy": _policy,
    "policy_kwargs": _policy_arguments,
    "replay_buffer_class": _buffer_class("replay"),
    "replay_buffer_kwargs": _buffer_arguments("replay"),
    "rollout_buffer_class": _buffer_class("rollout"),
    "rollout_buffer_kwargs": _buffer_arguments("rollout"),
    "seed": _seed,
    "vec_env_wrapper": _vector_wrappers,
}
