"""`examples/own_training_script.py` in `palaestra run`, with real simulators."""

from pathlib import Path

from stable_baselines3 import PPO

SCRIPT = Path(__file__).parents[3] / "examples" / "own_training_script.py"
ROLLOUT = 512  # steps that the script's PPO learns from at once


def test_a_script_of_one_s_own_trains_in_the_simulators_of_its_job(run):
    """People copy this script, so it must work; the summary at its end must match the run directory."""
    training = run(
        "tiny", command=["python", str(SCRIPT)], steps=300, evaluation={"everySteps": 300, "episodes": 2}
    )

    code, output = training.start().end()

    assert code == 0, output
    assert PPO.load(training.directory / "model.zip", device="cpu").num_timesteps == ROLLOUT
    said = output.splitlines()[-4:]
    assert "mean return" in said[0]
    assert said[0].endswith("over 2 episodes")
    assert said[1].split() == ["steps", str(ROLLOUT)]  # as the script has reported
    assert said[2].split() == ["run", "directory", str(training.directory)]
    assert said[3].endswith(f"tensorboard --logdir {training.directory / 'tensorboard'}")
