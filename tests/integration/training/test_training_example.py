"""`examples/own_training_script.py`, on fakes."""

from __future__ import annotations

import runpy
from pathlib import Path

import pytest
from stable_baselines3 import PPO

from palaestra_trainer.configuration import load
from palaestra_trainer.environments import configured

SCRIPT = Path(__file__).parents[3] / "examples" / "own_training_script.py"


@pytest.mark.filterwarnings("ignore:.*not wrapped.*")
def test_a_script_of_one_s_own_trains_in_the_configured_simulators(
    write_job, fakes, tmp_path, monkeypatch, capsys
):
    """It needs nothing but gymnasium, Stable-Baselines3 and the two variables."""
    job = write_job(collectors=2, steps=100)
    (tmp_path / "run").mkdir()
    monkeypatch.setenv("PALAESTRA_CONFIG", str(job))
    monkeypatch.setenv("PALAESTRA_RUN", str(tmp_path / "run"))
    handed_out = iter(fakes.make_members(load(job)))
    monkeypatch.setattr(configured, "configured_simulators", lambda: handed_out)
    monkeypatch.setattr("signal.signal", lambda *_: None)

    runpy.run_path(str(SCRIPT), run_name="__main__")

    assert PPO.load(tmp_path / "run" / "model.zip").num_timesteps == 1024
    assert "mean return" in capsys.readouterr().out
    assert next(handed_out, None) is None
