"""The hyperparameters that choose a buffer; their names are those of Stable-Baselines3 and RL-Zoo.

A job may choose HerReplayBuffer, or a buffer class of its author as `module:Class`.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from gymnasium import spaces
from stable_baselines3.common.buffers import BaseBuffer, ReplayBuffer, RolloutBuffer

from palaestra_trainer.algorithms import her, own_buffers
from palaestra_trainer.algorithms.constructor_params import parameters
from palaestra_trainer.algorithms.hyperparameters import FIELD
from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.job.configuration import nearest
from palaestra_trainer.job.user_code import imports


@dataclass(frozen=True, slots=True)
class BufferKind:
    """A type of buffer, and the two hyperparameters that choose a buffer of this type.

    Attributes:
        chooser: the hyperparameter that names a class.
        options: the hyperparameter that holds the keyword arguments of that class.
        base: the class that the named class must extend.
        by_name: names of the classes that a job names without a module.
    """

    chooser: str
    options: str
    base: type[BaseBuffer]
    by_name: tuple[str, ...] = ()

    @property
    def names(self) -> tuple[str, str]:
        """The names of the two hyperparameters."""
        return self.chooser, self.options


REPLAY = BufferKind("replay_buffer_class", "replay_buffer_kwargs", ReplayBuffer, (her.NAME,))
ROLLOUT = BufferKind("rollout_buffer_class", "rollout_buffer_kwargs", RolloutBuffer)
KINDS = (REPLAY, ROLLOUT)
NAMES = (*REPLAY.names, *ROLLOUT.names)


def mistakes(given: Mapping[str, Any]) -> Iterator[str]:
    """Yield a message with field, fact and remedy for each wrong hyperparameter of a buffer."""
    for kind in KINDS:
        yield from _mistakes(kind, given.get(kind.chooser), given.get(kind.options))


def arguments(given: Mapping[str, Any], observation: spaces.Space[Any]) -> dict[str, Any]:
    """Return the keyword arguments that these hyperparameters set for the algorithm's class.

    Raises:
        ConfigurationError: the buffer does not accept the environment's observation.
    """
    found: dict[str, Any] = {}
    for kind in KINDS:
        chosen = given.get(kind.chooser)
        if chosen == her.NAME:
            her.refuse_other_observations(observation)
            found[kind.chooser] = her.ValidHerReplayBuffer
        elif chosen is not None:
            found[kind.chooser] = _own(kind, chosen)
            own_buffers.refuse_other_observations(found[kind.chooser], observation)
        if chosen is not None:
            found[kind.options] = dict(given.get(kind.options) or {})
    return found


def _mistakes(kind: BufferKind, chosen: Any, options: Any) -> Iterator[str]:
    known: dict[str, object] | None = None
    if imports.names_class(chosen):
        try:
            known = _options(_own(kind, chosen))
        except ConfigurationError as error:
            yield str(error)
    elif chosen not in (None, *kind.by_name):
        named = " or ".join((*kind.by_name, "module:Class"))
        yield f"{FIELD}.{kind.chooser}: {chosen!r} is not a buffer; write {named}, or leave it out"
    if options is None:
        return
    if chosen is None:
        yield (
            f"{FIELD}.{kind.options}: has no effect without {kind.chooser}; "
            f"set {kind.chooser}, or remove this field"
        )
    if not isinstance(options, dict):
        yield f"{FIELD}.{kind.options}: {options!r} is refused; give a mapping"
    elif known is not None:
        yield from _unknown(f"{FIELD}.{kind.options}", options, known)
    elif kind is REPLAY and not imports.names_class(chosen):
        yield from her.mistakes(options, f"{FIELD}.{kind.options}")


def _unknown(field: str, options: Mapping[str, Any], known: Mapping[str, object]) -> Iterator[str]:
    for name in options:
        if name not in known:
            remedy = (
                nearest(str(name), known)
                if known
                else "the class of the buffer has no options of its own, so remove it"
            )
            yield f"{field}.{name}: is not an option of this buffer; {remedy}"


def _own(kind: BufferKind, name: str) -> type[BaseBuffer]:
    """Return a subclass of the class `name`; the subclass stores or samples only valid rows."""
    return own_buffers.with_valid_rows(imports.class_named(name, f"{FIELD}.{kind.chooser}", kind.base))


def _options(cls: type[BaseBuffer]) -> dict[str, object]:
    """Return the keyword arguments that an author's class adds to those that the algorithm sets."""
    given = {*parameters(ReplayBuffer), *parameters(RolloutBuffer)}
    return {name: found for name, found in parameters(cls).items() if name not in given}
