"""Check that an algorithm supports the spaces of an environment, and choose its policy.

The checks need only the spaces, so a mismatch is refused before a simulator starts.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from gymnasium import spaces
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.policies import BasePolicy
from stable_baselines3.common.preprocessing import is_image_space, is_image_space_channels_first

from palaestra_trainer.algorithms.registry import RegisteredAlgorithm, entry_of
from palaestra_trainer.environments.space_flaws import KINDS, flaws_of_action, flaws_of_observation
from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.job.configuration import Algorithm, Cnn, nearest
from palaestra_trainer.job.user_code import imports

# The convolutions of each network need at least this number of pixels per side.
SMALLEST: Mapping[Cnn | None, int] = {None: 36, "small": 20}


def policy_of_spaces(
    algorithm: Algorithm, entry: RegisteredAlgorithm, seen: spaces.Space[Any], acted: spaces.Space[Any]
) -> str | type[BasePolicy]:
    """Return the policy of an algorithm for these observations and actions.

    Raises:
        ConfigurationError: the algorithm does not support the spaces; the message has one line for each
            reason.
    """
    refuse_spaces(algorithm, seen, acted)
    if lines := [*_about_images(algorithm, seen), *_about_normalization(algorithm, seen)]:
        raise ConfigurationError("\n".join(lines))
    return named_policy(algorithm, entry) or _usual_policy(algorithm.name, entry, seen)


def refuse_spaces(algorithm: Algorithm, seen: spaces.Space[Any], acted: spaces.Space[Any]) -> None:
    """Refuse spaces that the algorithm would misinterpret or does not support.

    Raises:
        ConfigurationError: a space is refused; the message has one line for each reason.
    """
    if lines := [*flaws_of_observation(seen), *_about_actions(algorithm.name, acted)]:
        raise ConfigurationError("\n".join(lines))


def named_policy(algorithm: Algorithm, entry: RegisteredAlgorithm) -> str | type[BasePolicy] | None:
    """Return the policy that the job names, as an alias or a class; None if the job names no policy.

    Raises:
        ConfigurationError: the name is neither an alias nor a class.
    """
    name = algorithm.policy
    known = aliases(entry.original)
    if name is None or name in known:
        return name
    if imports.names_class(name):
        return imports.class_named(name, "algorithm.policy", BasePolicy)
    raise ConfigurationError(
        f"algorithm.policy: {algorithm.name} has no policy {name}; {nearest(name, dict(known))}, "
        "or write module:Class"
    )


def aliases(cls: type[BaseAlgorithm]) -> Mapping[str, type[BasePolicy]]:
    """Return the policies of an algorithm by their names."""
    return cls.policy_aliases


def images_in(space: spaces.Space[Any]) -> list[spaces.Box]:
    """Return the spaces of images in an observation: the observation itself, or parts of a Dict."""
    parts = space.spaces.values() if isinstance(space, spaces.Dict) else [space]
    return [part for part in parts if isinstance(part, spaces.Box) and is_image_space(part)]


def scalable(space: spaces.Space[Any]) -> list[str] | bool:
    """Return the keys of a Dict that can be normalized, or whether another space can be normalized.

    Images are excluded because networks scale images themselves. Discrete is excluded because its numbers are
    labels without a scale.
    """
    if isinstance(space, spaces.Dict):
        return [key for key, part in space.spaces.items() if scalable(part)]
    return isinstance(space, spaces.Box) and not is_image_space(space)


def _about_actions(name: str, acted: spaces.Space[Any]) -> Iterator[str]:
    known = entry_of(name).actions or KINDS
    if not isinstance(acted, known):
        kinds = " or ".join(kind.__name__ for kind in known)
        fact = f"{name} needs {kinds} actions, not {type(acted).__name__}"
        yield f"algorithm.name: {fact}; use another algorithm"
    else:
        yield from flaws_of_action(acted)


def _about_images(algorithm: Algorithm, seen: spaces.Space[Any]) -> list[str]:
    images = images_in(seen)
    if algorithm.cnn and (not images or isinstance(seen, spaces.Dict)):
        what = "is a Dict" if isinstance(seen, spaces.Dict) else "is not an image"
        return [f"algorithm.cnn: has no effect, since the environment's observation {what}; remove it"]
    smallest = SMALLEST[algorithm.cnn]
    sides = [image.shape[1:] if is_image_space_channels_first(image) else image.shape[:2] for image in images]
    return [
        f"environment.id: its images have {rows} x {columns} pixels, and CnnPolicy needs "
        f"{smallest} x {smallest}; make them larger, or flatten them"
        for rows, columns in sides
        if min(rows, columns) < smallest and not _own_network(algorithm)
    ]


def _about_normalization(algorithm: Algorithm, seen: spaces.Space[Any]) -> list[str]:
    if not (algorithm.normalize and algorithm.normalize.observations) or scalable(seen):
        return []
    why = "CnnPolicy scales images itself" if images_in(seen) else f"a {type(seen).__name__} has no scale"
    return [f"algorithm.normalize.observations: {why}; set it to false"]


def _usual_policy(name: str, entry: RegisteredAlgorithm, seen: spaces.Space[Any]) -> str:
    if isinstance(seen, spaces.Dict):
        kind, what = "MultiInput", "a Dict"
    else:
        kind, what = ("Cnn", "images") if images_in(seen) else ("Mlp", "numbers")
    for alias in aliases(entry.original):
        if alias.startswith(kind):
            return alias
    raise ConfigurationError(
        f"algorithm.name: {name} has no policy for {what}; use another algorithm, or flatten the observation"
    )


def _own_network(algorithm: Algorithm) -> bool:
    policy = algorithm.hyperparameters.get("policy_kwargs") or {}
    return algorithm.policy is not None or "features_extractor_class" in policy
