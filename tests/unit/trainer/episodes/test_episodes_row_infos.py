"""The infos of rows that are made from the info of a batched step."""

import numpy as np
import pytest

from palaestra_trainer.environments.infos import OURS, TRUNCATED
from palaestra_trainer.episodes.row_infos import row_infos
from palaestra_trainer.errors import ConfigurationError

WHOLE = np.array([False, False])


def test_each_row_has_its_own_values_also_of_nested_parts():
    """Callbacks read `info["reward_terms"]` of one row, as from a single environment."""
    info = {"is_success": np.array([True, False]), "reward_terms": {"goal": np.array([1.0, 0.0])}}

    first, second = row_infos(info, 2, np.array([False, True]))

    assert first == {
        "is_success": True,
        "reward_terms": {"goal": 1.0},
        TRUNCATED: False,
        OURS: {"valid": True},
    }
    assert (second["reward_terms"], second[TRUNCATED]) == ({"goal": 0.0}, True)


def test_a_part_without_values_is_an_empty_part_of_each_row():
    """An environment without reward terms has the key, and a program may change the info of one row."""
    first, second = row_infos({"reward_terms": {}}, 2, np.array([False, False]))

    first["reward_terms"]["own"] = 1.0
    assert second["reward_terms"] == {}


def test_the_keys_of_stable_baselines3_are_hidden():
    """Stable-Baselines3 reads a dict in `episode`; the rule is the same as for a single environment."""
    first, second = row_infos({"episode": np.array([3, 4]), "lap": np.array([1, 2])}, 2, WHOLE)

    assert first == {"lap": 1, TRUNCATED: False, OURS: {"valid": True, "hidden": {"episode": 3}}}
    assert second["lap"] == 2


@pytest.mark.parametrize(
    ("value", "fact"),
    [(3, "a int in 'lap'"), ([1, 2], "a list in 'lap'"), (np.zeros(3), r"the shape \(3,\) in 'lap'")],
)
def test_a_value_that_is_not_one_for_each_row_is_refused(value, fact):
    """The message names the key and the number of rows, which the author of the environment needs."""
    for info in ({"lap": value}, {"terms": {"lap": value}}):
        with pytest.raises(ConfigurationError, match=rf"{fact}; .* each of the 2 rows"):
            row_infos(info, 2, WHOLE)
