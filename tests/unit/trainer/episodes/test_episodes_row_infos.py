"""The infos of rows that are made from the info of a batched step."""

import numpy as np

from palaestra_trainer.environments.infos import OURS, TRUNCATED
from palaestra_trainer.episodes.row_infos import row_infos


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
