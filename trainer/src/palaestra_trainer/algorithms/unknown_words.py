"""Find the remedy for a name that is not a hyperparameter of the algorithm.

The remedy for a misspelled name is the most similar hyperparameter. Some names are similar to a
hyperparameter, but have another meaning: `n_timesteps` is not `n_steps`. For such a name, the remedy is the
field of the job for that value.
"""

from __future__ import annotations

from collections.abc import Container, Iterable, Iterator, Mapping
from types import MappingProxyType

from palaestra_protocol.foreign_words import ELSEWHERE, FROM_ZOO, OF_ZOO
from palaestra_trainer.algorithms.registry import ALGORITHMS, RegisteredAlgorithm
from palaestra_trainer.job.configuration import nearest

# A name with at least this similarity to a hyperparameter counts as misspelled, such as gama for gamma. The
# similarity of n_timesteps or n_epochs to n_steps is lower.
_MISSPELLED = 0.85
# Other libraries use the names on the left for the hyperparameters on the right.
_SAME: Mapping[str, str] = MappingProxyType(
    {
        "clip_coef": "clip_range",
        "cliprange": "clip_range",
        "entropy_coef": "ent_coef",
        "lam": "gae_lambda",
        "lambda": "gae_lambda",
        "lr": "learning_rate",
        "memory_size": "buffer_size",
        "minibatch_size": "batch_size",
        "noptepochs": "n_epochs",
        "replay_size": "buffer_size",
        "sgd_minibatch_size": "batch_size",
        "target_network_update_freq": "target_update_interval",
        "train_frequency": "train_freq",
        "update_epochs": "n_epochs",
        "value_coef": "vf_coef",
    }
)


def mistakes(
    algorithm: str, entry: RegisteredAlgorithm, of_policy: Container[str], given: Iterable[str], field: str
) -> Iterator[str]:
    """Yield a message with field, fact and remedy for each name that is not a hyperparameter.

    Args:
        algorithm: name of the algorithm in the job.
        entry: entry of the algorithm.
        of_policy: the arguments of the algorithm's policy.
        given: the names that the job sets.
        field: the field of the job that holds these names.
    """
    known = entry.known
    unknown = [word for word in given if word not in known]
    for word in unknown:
        yield f"{field}.{word}: {_fact(algorithm, known, of_policy, word)}"
    if not OF_ZOO.isdisjoint(unknown):
        yield f"{field}: has words of RL-Baselines3-Zoo; {FROM_ZOO}"


def _fact(algorithm: str, known: list[str], of_policy: Container[str], word: str) -> str:
    if word in ELSEWHERE:
        return f"is not a hyperparameter here; {ELSEWHERE[word]}"
    if word in of_policy:
        return f"is an argument of the policy; write it in policy_kwargs.{word}"
    fact = f"{algorithm} has no such hyperparameter"
    if (same := _SAME.get(word)) in known:
        return f"{fact}; write {same}"
    if others := [name for name, other in ALGORITHMS.items() if word in other.known]:
        return f"{fact}, unlike {', '.join(others)}; leave it out, or {nearest(word, known, 1.0)}"
    return f"{fact}; {nearest(word, known, _MISSPELLED)}"
