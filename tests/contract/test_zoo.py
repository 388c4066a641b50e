"""The trainer accepts the jobs that `palaestra from-zoo` writes from files of RL-Baselines3-Zoo."""

import pytest
import yaml

from palaestra.api import load
from palaestra.cli import main
from palaestra.zoo import convert
from palaestra.zoo.expressions import SHORT
from palaestra_protocol.foreign_words import ELSEWHERE
from palaestra_trainer.algorithms.hyperparameters import CLASSES
from palaestra_trainer.algorithms.make_model import check
from palaestra_trainer.job.configuration import Algorithm

FILE = """\
default:
  n_timesteps: !!float 1e6
  policy: 'MlpPolicy'
a-v0:
  n_timesteps: !!float 1e6
  policy: 'MlpPolicy'
  learning_rate: lin_7.3e-4
  gamma: 0.98
  policy_kwargs: "dict(activation_fn=nn.GELU, net_arch=[64],
                       optimizer_class=RMSpropTFLike, optimizer_kwargs=dict(eps=1e-5))"
"""


def test_classes_have_the_short_names_that_the_trainer_knows():
    """The trainer rejects an unknown name, and the short name of another class would change the training."""
    known = {name for names in CLASSES.values() for name in names}

    assert set().union(*SHORT.values()) == known


@pytest.mark.parametrize(
    "algorithm", ["dqn", "sac", "td3", "ddpg", "qrdqn", "tqc", "crossq", "ppo", "a2c", "trpo"]
)
def test_the_trainer_accepts_the_hyperparameters_of_a_converted_entry(algorithm):
    """Files of Zoo contain schedules and PyTorch classes, which the command must convert."""
    written = load(convert(FILE, f"{algorithm}.yml", env="a-v0").text).spec.trainer.algorithm

    assert check(Algorithm(name=written.name, hyperparameters=written.hyperparameters, policy=written.policy))


def test_no_word_that_lives_elsewhere_becomes_a_hyperparameter():
    """Words such as `n_timesteps` are other fields of a job; the trainer rejects them as hyperparameters."""
    words = "".join(f"  {word}: null\n" for word in ELSEWHERE if word not in {"n_timesteps", "policy"})

    written = load(convert(f"a-v0:\n  n_timesteps: 5\n  policy: MlpPolicy\n{words}", "sac.yml").text)

    assert written.spec.trainer.algorithm.hyperparameters.keys() == set()


def test_the_written_job_can_be_planned(tmp_path, capsys):
    """After the conversion, a user runs `palaestra plan` or `palaestra run` with the job."""
    (tmp_path / "ppo.yml").write_text(FILE)
    out = tmp_path / "job.yaml"

    assert main(["from-zoo", str(tmp_path / "ppo.yml"), "--env", "a-v0", "--out", str(out)]) == 0
    assert "environment: a-v0 must accept robot or scene" in capsys.readouterr().err
    assert main(["plan", str(out)]) == 0
    assert len(list(yaml.safe_load_all(capsys.readouterr().out))) > 1


def test_an_existing_file_is_not_replaced(tmp_path, capsys):
    """A user may have edited the existing file, so the command must not overwrite it."""
    (tmp_path / "ppo.yml").write_text(FILE)

    assert main(["from-zoo", str(tmp_path / "ppo.yml"), "--out", str(tmp_path / "ppo.yml")]) == 2

    assert "already exists; name another file, or remove this one" in capsys.readouterr().err
    assert (tmp_path / "ppo.yml").read_text() == FILE
