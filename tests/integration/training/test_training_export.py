"""An exported policy is one file, and its actions equal those of the policy in its run."""

import hashlib
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import gymnasium
import numpy as np
import onnx
import onnxruntime
import pytest
from safetensors import safe_open

from palaestra_protocol.policy_package import MANIFEST, read_package
from palaestra_trainer import exporting, load_policy
from palaestra_trainer.cli.export import export
from palaestra_trainer.errors import ConfigurationError, ExportError
from palaestra_trainer.exporting import onnx_file
from palaestra_trainer.job.run_directory import RunDirectory
from palaestra_trainer.testing import fake_arena, fake_seeing

PPO = {"name": "PPO", "hyperparameters": {"n_steps": 64, "batch_size": 32, "n_epochs": 2}}
OFF_POLICY = {"learning_starts": 20, "batch_size": 16, "policy_kwargs": {"net_arch": [32]}}
CONTINUOUS = {"id": "MoveToTargetEnv-v0", "options": {"max_steps": 30, "actions": "continuous"}}
SEEING = {"id": "SeeTarget-v0", "options": {"max_steps": 20}}
EXAMPLE = Path(__file__).parents[3] / "examples" / "exported_policy.py"
CASES = {
    "PPO": {"algorithm": PPO | {"normalize": {}}},
    "PPO-continuous": {"algorithm": PPO | {"normalize": {"rewards": False}}, "environment": CONTINUOUS},
    "A2C": {"algorithm": {"name": "A2C"}},
    "DQN": {"algorithm": {"name": "DQN", "hyperparameters": OFF_POLICY}},
    "SAC": {"algorithm": {"name": "SAC", "hyperparameters": OFF_POLICY}, "environment": CONTINUOUS},
    "REINFORCE": {"algorithm": {"name": "REINFORCE", "hyperparameters": {"episodes_per_update": 1}}},
    "images": {"algorithm": PPO | {"cnn": "small"}, "environment": SEEING},
}


@pytest.fixture
def trained(write_job, play, tmp_path):
    """Return a function that trains a short run and returns the run directory.

    Its keywords are fields of the job.
    """

    def run(**changes):
        wanted = {"steps": 128, "evaluation": {"everySteps": 64, "episodes": 2, "confirmEpisodes": 3}}
        assert play(write_job(**wanted | changes))[0] == 0
        return tmp_path / "run"

    return run


@pytest.mark.parametrize("case", CASES)
def test_onnxruntime_acts_as_the_policy_in_the_environment(trained, case):
    """The export compares random observations, but a robot sees those of an environment."""
    run = trained(**CASES[case])

    written = exporting.export(run, "onnx")

    policy, session = load_policy(run), onnxruntime.InferenceSession(written.path)
    fake = fake_seeing if case == "images" else fake_arena
    env = gymnasium.make(policy.environment_id, simulator=fake, **policy.environment_options)
    observation, _ = env.reset(seed=1)
    for _ in range(20):
        (actions,) = session.run(["action"], {"observation": observation[None]})
        expected, _ = policy.predict(observation)
        assert np.allclose(actions[0], expected, atol=1e-5)
        observation, *_ = env.step(actions[0])
    assert written.observations == 1000
    assert written.largest_difference <= (1e-5 if "Box" in str(env.action_space) else 0)


def test_the_data_sheet_explains_numbers_actions_and_origin(trained):
    """A user who has only the file must learn the inputs, their units and the success rate."""
    run = trained(**CASES["PPO"])

    written = exporting.export(run, "onnx")

    (prop,) = onnx.load(written.path).metadata_props
    sheet = json.loads(prop.value)
    assert prop.key == "palaestra"
    assert sheet["environment"]["id"] == "MoveToTargetEnv-v0"
    assert sheet["environment"]["options"] == {"max_steps": 30}
    assert sheet["observations"]["spaces"]["observation"]["shape"] == [16]
    assert sheet["observations"]["tables"][0][0]["unit"] == "0.37 m"
    assert sheet["actions"]["space"] == {
        "kind": "Discrete",
        "shape": [],
        "dtype": "int64",
        "n": 7,
        "start": 0,
    }
    assert sheet["actions"]["tables"][0][1]["movement"] == "FORWARD"
    assert sheet["normalized"] == {"observation": {"clip": 10.0, "epsilon": 1e-8}}
    assert sheet["steps"] in (64, 128)
    assert sheet["success_interval"]["episodes"] == 3


def test_safetensors_have_the_names_of_the_policy_and_its_normalizer(trained):
    """A user can load the tensors by name into the same network in another program."""
    run = trained(**CASES["PPO"])

    written = exporting.export(run, "safetensors", run / "of my own.safetensors")

    with safe_open(written.path, "numpy") as file:
        names, sheet = set(file.keys()), json.loads(file.metadata()["palaestra"])
        weights = file.get_tensor("policy.action_net.weight")
    assert {"normalizers.0.mean", "normalizers.0.variance", "policy.value_net.weight"} <= names
    assert np.array_equal(weights, load_policy(run).model.policy.action_net.weight.detach().numpy())
    assert sheet["algorithm"] == "PPO"


def test_a_file_that_acts_differently_is_not_written(trained, monkeypatch):
    """The export must detect an error of a converter before the policy reaches a robot.

    An earlier file stays unchanged.
    """
    run = trained(**CASES["A2C"])
    (run / "policy.onnx").write_bytes(b"before")
    right = onnx_file.runner

    def wrong(file, acting):
        return lambda *inputs: tuple((actions + 1) % 7 for actions in right(file, acting)(*inputs))

    monkeypatch.setattr(onnx_file, "runner", wrong)

    with pytest.raises(ExportError, match="acts differently on 1000 of 1000 numbers"):
        exporting.export(run, "onnx")

    assert (run / "policy.onnx").read_bytes() == b"before"
    assert [path.name for path in run.iterdir() if "policy" in path.name] == ["policy.onnx"]


def test_the_program_prints_where_the_file_is(trained, capsys):
    """A script reads the path and the largest difference as JSON."""
    run = trained(**CASES["A2C"])

    assert export([str(run), "--to", "safetensors"]) == 0

    printed = json.loads(capsys.readouterr().out)
    assert printed["path"] == str(run / "policy.safetensors")
    assert printed["largest_difference"] == 0


def test_a_folder_without_a_model_is_refused(tmp_path, capsys):
    """The user gets the remedy, and the exit code for wrong input."""
    assert export([str(tmp_path), "--to", "onnx"]) == 2

    assert "model.zip: does not exist; train first" in capsys.readouterr().err


def test_the_example_drives_a_simulated_robot_without_pytorch(trained):
    """The user's robot needs only onnxruntime and the facades, and neither PyTorch nor Stable-Baselines3."""
    written = exporting.export(trained(**CASES["PPO"]), "onnx")
    environment = {name: value for name, value in os.environ.items() if not name.startswith("ROS_")}
    alone = (
        f"import runpy, sys; sys.argv = ['', {str(written.path)!r}]; runpy.run_path({str(EXAMPLE)!r}); "
        "print(sorted({'torch', 'stable_baselines3'} & sys.modules.keys()))"
    )

    result = subprocess.run(
        [sys.executable, "-c", alone],
        check=False,
        capture_output=True,
        text=True,
        timeout=100,
        env=environment,
    )

    assert result.returncode == 0, result.stderr
    outcome, rest = result.stdout.splitlines()
    assert outcome.split()[0] in {"reached", "collided", "time_up"}
    assert rest == "[]"


def test_a_package_has_all_that_a_robot_and_a_reader_need(trained):
    """A program on the robot reads the rate and the limits; a person reads the success."""
    run = trained(**CASES["PPO-continuous"])
    source = {"of": "lab_task", "commit": "0" * 40, "dirty": False}
    for _ in range(2):
        RunDirectory(run).begin_attempt("", "resumed", source=source)

    written = exporting.export(run, "package")
    manifest = read_package(written.path)

    files = {entry["name"] for entry in manifest["files"]}
    assert files == {"model.zip", "policy.onnx", "training.yaml"}
    assert {path.name for path in written.path.iterdir()} == files | {MANIFEST}
    assert manifest["robot"] == {"class": "Robotino", "definition": "ROBOTINO", "period_s": 0.192}
    assert manifest["policy"]["environment"]["id"] == CONTINUOUS["id"]
    assert manifest["policy"]["actions"]["space"]["low"] == -1.0
    assert manifest["evaluated"][0]["simulators"] == ["stub"]
    assert manifest["commit"][-1] == source
    assert (written.path / "model.zip").read_bytes() == (run / "model.zip").read_bytes()
    session = onnxruntime.InferenceSession(written.path / "policy.onnx")
    assert [it.name for it in session.get_inputs()] == manifest["policy"]["inputs"]

    again = exporting.export(run, "package")

    assert read_package(again.path)["policy"] == manifest["policy"]
    assert list(written.path.glob(".*")) == []


def test_a_package_has_the_results_of_its_policy_in_several_simulators(trained, tmp_path):
    """A person judges whether the policy depends on one simulator; another policy's results would mislead."""
    run = trained(**CASES["PPO-continuous"])
    mujoco = {
        "simulators": ["mujoco"],
        "worlds": ["arena.wbt"],
        "episodes": 100,
        "success_rate": 0.9,
        "success_interval": {"low": 0.82, "high": 0.95, "episodes": 100},
        "seeds": "B",
        "versions": {"mujoco": "3.3.0"},
    }
    known = mujoco | {"model": hashlib.sha256((run / "model.zip").read_bytes()).hexdigest(), "seconds": 3.1}
    results = tmp_path / "results.jsonl"
    results.write_text(json.dumps(known))

    written = exporting.export(run, "package", results=results)

    own, other = read_package(written.path)["evaluated"]
    assert (own["simulators"], own["episodes"]) == (["stub"], 3)
    assert own["success_interval"]["episodes"] == 3
    assert "palaestra-trainer" in own["versions"]
    assert other == mujoco
    for text, fact in (
        (json.dumps(known | {"model": "0" * 64}), "line 1: is a result of another policy, not of model.zip"),
        (json.dumps(known | {"success_rate": 90}), "line 1: is not a result of a policy"),
        ("", "is empty; write the file with `palaestra-eval"),
    ):
        results.write_text(text)
        with pytest.raises(ConfigurationError, match=fact):
            exporting.export(run, "package", results=results)


def test_a_package_as_a_zip_begins_another_run_and_has_the_same_bytes_again(trained, play, write_job):
    """A person sends one file; its checksum must not depend on the time of the export."""
    run = trained(**CASES["PPO-continuous"])
    first, second = run.parent / "first.zip", run.parent / "second.zip"

    for place in (first, second):
        exporting.export(run, "package", place)
    shutil.rmtree(run)
    code, output = play(write_job(**CASES["PPO-continuous"], steps=64, initialPolicy=str(first)))

    assert first.read_bytes() == second.read_bytes()
    assert read_package(first)["robot"]["class"] == "Robotino"
    assert code == 0, output
    assert "begins from a policy" in output


def test_a_zip_that_is_no_package_is_not_replaced(trained):
    """The zip next to the run may be a person's only copy of a model."""
    run = trained(**CASES["A2C"])

    with pytest.raises(
        ConfigurationError, match=r"model\.zip: exists and is not a package; choose another file"
    ):
        exporting.export(run, "package", run / "model.zip")


def test_a_folder_that_is_no_package_is_not_replaced(trained, tmp_path):
    """An export must not remove the files of a person."""
    other = tmp_path / "thesis"
    other.mkdir()
    (other / "chapter.tex").write_text("words")

    with pytest.raises(ConfigurationError, match=r"contains chapter\.tex, which no package has; name"):
        exporting.export(trained(**CASES["A2C"]), "package", other)

    assert (other / "chapter.tex").read_text() == "words"
