"""`examples/own_training_script.py` in `palaestra run`, with real simulators that crash."""

from pathlib import Path

from stable_baselines3 import PPO

from tests.local_run import running
from tests.soak.jobs import tiny_job

SCRIPT = Path(__file__).parents[3] / "examples" / "own_training_script.py"
ROLLOUT = 512  # the script's PPO learns after this many steps
CRASH_AT = 200


def mended(training):
    """Return the status of a run in which a simulator was restarted, or None."""
    status = training.status()
    return status if status and status["simulators"] and status["simulators"][0]["restarts"] else None


def test_a_script_of_one_s_own_trains_in_the_simulators_of_its_job_through_their_faults():
    """Users copy the script, so it must survive faults and report the same result as the run directory."""
    job = tiny_job(
        faults=f"crash:step={CRASH_AT}",
        command=["python", str(SCRIPT)],
        steps=300,
        evaluation={"everySteps": 300, "episodes": 2, "confirmEpisodes": 2},
    )
    with running(job) as training:
        status = training.until(lambda: mended(training))
        code, output = training.end()

        assert code == 0, output
        assert PPO.load(training.directory / "model.zip", device="cpu").num_timesteps == ROLLOUT
        assert training.faults()["dead"] >= ROLLOUT // CRASH_AT

    said = output.splitlines()[-4:]
    assert "mean return" in said[0]
    assert said[0].endswith("over 2 episodes")
    assert said[1].split() == ["steps", str(ROLLOUT)]  # the script reported these steps
    assert said[2].split() == ["run", "directory", str(training.directory)]
    assert said[3].endswith(f"tensorboard --logdir {training.directory / 'tensorboard'}")
    assert [(it["name"], it["role"]) for it in status["simulators"]] == [("collect-0", "Collect")]
    assert status["faults"]["dead"] > 0
    assert status["steps_lost"] > 0
