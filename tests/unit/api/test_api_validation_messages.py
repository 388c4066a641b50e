"""Each kind of mistake in a field has its own message for the author of the job."""

import json

import pytest

from palaestra.api import validate
from palaestra.errors import SpecErrors

LONG = "x" * 2000

SENTENCES = [
    # A value outside its choices.
    ({"simulators.1.role": "Eval"},
     'spec.simulators[1].role: "Eval" is not a role; use Collect or Evaluate'),
    ({"simulators.0.driver": "gazebo"},
     'spec.simulators[0].driver: "gazebo" is not a driver; use stub, mujoco, webots or command'),
    ({"simulators.0.world": {"builtin": "maze"}},
     'spec.simulators[0].world.builtin: "maze" is not a builtin; use arena, seeing, court or pen'),
    ({"trainer.algorithm.name": "TD4"},
     ('spec.trainer.algorithm.name: "TD4" is not an algorithm; '
     "use DQN, PPO, A2C, SAC, TD3, DDPG, QRDQN, TQC, TRPO, CrossQ, RecurrentPPO, MaskablePPO, REINFORCE "
      "or module:Class")),
    ({"trainer.algorithm.name": "HER"},
     ('spec.trainer.algorithm.name: "HER" cannot be used: HER is a replay buffer; '
     "use SAC, TD3, DDPG, TQC, DQN or QRDQN with replay_buffer_class: HerReplayBuffer")),
    ({"trainer.robot": "Robotinoo"},
     'spec.trainer.robot: "Robotinoo" is not a robot; use Robotino, TurtleBot3Burger, EPuck or module:Class'),
    ({"trainer.algorithm.policy": "my policy"},
     ('spec.trainer.algorithm.policy: "my policy" is not a policy; '
     "write MlpPolicy, CnnPolicy, MultiInputPolicy or module:Class")),
    ({"trainer.algorithm.cnn": "large"},
     'spec.trainer.algorithm.cnn: "large" is not a cnn; use small'),
    ({"trainer.algorithm.callbacks": [{"name": "Bored"}]},
     ('spec.trainer.algorithm.callbacks[0].name: "Bored" is not the name of a class; '
     "write it as module:Class")),
    ({"trainer.environment.reward": "dense"},
     'spec.trainer.environment.reward: "dense" is not a reward; use Dense or Sparse'),
    ({"trainer.imagePullPolicy": "Sometimes"},
     ('spec.trainer.imagePullPolicy: "Sometimes" is not an image pull policy; '
     "use Always, IfNotPresent or Never")),
    ({"storage.retain": True},
     "spec.storage.retain: true is not a retain; use Keep or Delete"),
    # A number outside its range.
    ({"trainer.steps": 0}, "spec.trainer.steps: 0 is less than 1; use 1 or more"),
    ({"replicas": 101}, "spec.replicas: 101 is more than 100; use 100 or less"),
    ({"trainer.evaluation.stopAtSuccessRate": 0},
     "spec.trainer.evaluation.stopAtSuccessRate: 0 is not more than 0; use more than 0"),
    ({"trainer.evaluation.stopAtSuccessRate": 95},
     "spec.trainer.evaluation.stopAtSuccessRate: 95 is more than 1; use 1 or less"),
    # A value of the wrong type, for example text that looks like a number in YAML.
    ({"trainer.steps": "50000"},
     'spec.trainer.steps: "50000" is text; write a whole number without quotes'),
    ({"trainer.steps": 1.5}, "spec.trainer.steps: 1.5 is not a whole number; write one"),
    ({"trainer.steps": True}, "spec.trainer.steps: true is not a whole number; write one"),
    ({"trainer.evaluation.stopAtSuccessRate": "0.9"},
     'spec.trainer.evaluation.stopAtSuccessRate: "0.9" is text; write a number without quotes'),
    ({"trainer.evaluation.stopAtSuccessRate": []},
     "spec.trainer.evaluation.stopAtSuccessRate: a list is not a number; write one"),
    ({"suspend": "yes"},
     'spec.suspend: "yes" is neither true nor false; write one of them, without quotes'),
    ({"simulators.0.env": [{"name": "SPEED", "value": 2}]},
     'spec.simulators[0].env[0].value: 2 is a number where text is needed; quote it: "2"'),
    ({"simulators.0.name": False},
     ("spec.simulators[0].name: false is not text "
     "(YAML reads yes, no, on and off as true or false); quote the word")),
    ({"simulators.0.name": ["a"]},
     "spec.simulators[0].name: a list is not text; write one text"),
    ({"trainer.resources": {"limits": {"cpu": 0.5}}},
     ("spec.trainer.resources.limits.cpu: 0.5 is a number where text is needed; "
     'quote it: "0.5"')),
    ({"trainer.command": "python train.py"},
     ('spec.trainer.command: "python train.py" is not a list; '
     """write ["python train.py"] or lines that begin with '- '""")),
    ({"simulators.0.options": {"a": 1}},
     ("spec.simulators[0].options: a mapping is not a list; "
     "write [...] or lines that begin with '- '")),
    ({"storage": "1Gi"},
     """spec.storage: "1Gi" is not a mapping; write lines of 'field: value'"""),
    ({"trainer.algorithm.hyperparameters": ["gamma"]},
     ("spec.trainer.algorithm.hyperparameters: a list is not a mapping; "
     "write lines of 'key: value'")),
    # No value where one is required.
    ({"trainer": None}, "spec.trainer: is empty; give a value or remove the line"),
    ({"simulators.0": {"role": "Collect"}}, "spec.simulators[0].name: is missing; add it"),
    ({"simulators.0.name": ""},
     "spec.simulators[0].name: is empty; give a value or remove the line"),
    # Text of the wrong form.
    ({"simulators.0.name": "Collect"},
     ('spec.simulators[0].name: "Collect" is not a name; '
     "use a-z first, then a-z, 0-9 and '-', no '-' at the end")),
    ({"simulators.0.name": "a" * 21},
     "spec.simulators[0].name: is longer than 20 characters; shorten it"),
    ({"storage.size": "1GB"},
     ('spec.storage.size: "1GB" is not a quantity; '
     "write a number and a unit, as 500m, 2, 512Mi or 1Gi")),
    ({"simulators.0.world": {"file": "hall.wbt"}},
     ('spec.simulators[0].world.file: "hall.wbt" is not the path of a world; '
     "give the absolute path of a .wbt or .xml file")),
    ({"simulators.0.world": {"file": "/lab/hall.wbt", "root": "/lab/"}},
     ('spec.simulators[0].world.root: "/lab/" is not the path of a folder; '
      "give an absolute path without a / at its end")),
    ({"trainer.environment.id": "Move To Target"},
     ('spec.trainer.environment.id: "Move To Target" is not the id of an environment; '
     "write it as in gymnasium's registry, such as MoveToTargetEnv-v0")),
    ({"storage": {"existingClaim": "runs", "resumeFrom": "../other"}},
     ('spec.storage.resumeFrom: "../other" is not the name of a folder; '
     "use letters, digits, '-', '_' and '.', no '/'")),
    ({"trainer.initialPolicy": {"claim": "a", "path": "../b/model.zip"}},
     ('spec.trainer.initialPolicy.path: "../b/model.zip" is not the path of a model.zip; give an absolute '
     "path; with a claim, give a path on the claim, without hidden folders and `..`")),
    ({"trainer.image": "my image"},
     'spec.trainer.image: "my image" is not an image; write it as registry/name:tag'),
    ({"managedBy": "me"},
     'spec.managedBy: "me" is not a name with a domain; write it as example.com/name'),
    ({"scheduling.podLabels": {"a.b/team": "a b"}},
     ('spec.scheduling.podLabels["a.b/team"]: "a b" is not the value of a label; '
     "use letters, digits, '-', '_' and '.'")),
    ({"trainer.env": [{"name": "2FAST", "value": ""}]},
     ('spec.trainer.env[0].name: "2FAST" is not the name of a variable; '
     "use letters, digits and '_', no digit first")),
    # A value, a list or a map that is too large, or a value that JSON cannot represent.
    ({"trainer.command": ["x"] * 65}, "spec.trainer.command: has more than 64 entries; remove some"),
    ({"scheduling.nodeSelector": {f"k{n}": "" for n in range(33)}},
     "spec.scheduling.nodeSelector: has more than 32 entries; remove some"),
    ({"scheduling.podAnnotations": {"note": LONG}},
     "spec.scheduling.podAnnotations.note: is longer than 1024 characters; shorten it"),
    ({"trainer.environment.options": {"a": json.loads("[" * 17 + "]" * 17)}},
     "spec.trainer.environment.options: is nested deeper than 16 levels; flatten it"),
    ({"trainer.environment.options": {"a": list(range(1000))}},
     "spec.trainer.environment.options: contains more than 1000 values; shorten it"),
    ({"trainer.environment.options": {"a": "x" * 5000}},
     "spec.trainer.environment.options: contains a text over 4096 characters; shorten it"),
    ({"trainer.algorithm.hyperparameters": {"gamma": float("nan")}},
     ("spec.trainer.algorithm.hyperparameters: contains a number that is not finite; "
     "use a finite one")),
    ({"trainer.algorithm.hyperparameters": {"gamma": {1: 2}}},
     "spec.trainer.algorithm.hyperparameters: has a key that is not text; quote it"),
    ({"trainer.algorithm.hyperparameters": {"gamma": {1, 2}}},
     ("spec.trainer.algorithm.hyperparameters: contains a value that JSON cannot represent; "
     "use text and numbers")),
    ({"simulators.0.recycle": {"aboveMemory": "400"}},
     ('spec.simulators[0].recycle.aboveMemory: "400" is not an amount of memory; '
     "write a whole number and a unit, as 400Mi or 2Gi")),
    # Duplicates.
    ({"imagePullSecrets": [{"name": "pull"}, {"name": "pull"}]},
     'spec.imagePullSecrets: "pull" is the name of two entries; make the names unique'),
    # Unknown fields, with the nearest known name.
    ({"trainer.stepps": 1}, "spec.trainer.stepps: is not a field; did you mean steps?"),
    ({"simulators.0.start_deadline_seconds": 1},
     ("spec.simulators[0].start_deadline_seconds: is not a field; "
     "did you mean startDeadlineSeconds?")),
    ({"steps": 1}, "spec.steps: is not a field here; did you mean spec.trainer.steps?"),
    # Terms of other projects, with the field to use instead.
    ({"trainer.n_timesteps": 1},
     ("spec.trainer.n_timesteps: is not a field; write trainer.steps "
     "(`palaestra from-zoo FILE` writes a job from a whole file of RL-Baselines3-Zoo)")),
    ({"trainer.algorithm.total_timesteps": 1},
     "spec.trainer.algorithm.total_timesteps: is not a field; write trainer.steps"),
    ({"trainer.n_steps": 1},
     ("spec.trainer.n_steps: is not a field; "
     "write a hyperparameter as spec.trainer.algorithm.hyperparameters.n_steps")),
    ({"trainer.algorithm.policy_kwargs": {}},
     ("spec.trainer.algorithm.policy_kwargs: is not a field; "
     "write a hyperparameter as spec.trainer.algorithm.hyperparameters.policy_kwargs")),
    ({"network": {"x": 1}}, "spec.network.x: is not a field; use egress"),
    ({"storage.x": 1},
     ("spec.storage.x: is not a field; use size, storageClassName, retain, ephemeral, "
     "existingClaim or resumeFrom")),
]  # fmt: skip


@pytest.mark.parametrize(("changes", "line"), SENTENCES, ids=[line[:60] for _, line in SENTENCES])
def test_an_error_has_path_fact_and_remedy(changes, line, problems) -> None:
    """One mistake gives one line, with all that the author needs to correct it."""
    assert problems(changes) == [line]


def test_a_path_with_a_key_that_is_no_word_shows_it_in_brackets(problems) -> None:
    """In brackets, the dot in a label's key does not look like a separator of fields."""
    assert problems({"scheduling.podLabels": {"a.b/c": 1}}) == [
        'spec.scheduling.podLabels["a.b/c"]: 1 is a number where text is needed; quote it: "1"'
    ]


def test_a_key_that_is_too_long_is_reported_at_its_map(problems) -> None:
    """The path ends with the key, so the author sees which key is too long."""
    line = problems({"scheduling.podLabels": {LONG: "a"}})[0]

    assert line.startswith("spec.scheduling.podLabels.xxx")
    assert line.endswith("is longer than 317 characters; shorten it")


def test_a_long_value_is_cut_in_the_sentence(problems) -> None:
    """The message must stay short, whatever value the author wrote."""
    (line,) = problems({"simulators.1.role": LONG})

    assert len(line) < 150
    assert "xxx..." in line


def test_line_breaks_in_a_value_or_a_key_do_not_break_the_line(problems) -> None:
    """A program that prints one line for each mistake must not print a line break from the job."""
    (line,) = problems({"trainer.a\nb": 1})

    assert "\n" not in line


def test_the_error_for_a_wrong_time_has_an_example(job_data) -> None:
    """The authors of programs that write a status read this message too."""
    with pytest.raises(SpecErrors, match=r'^status.startTime: "noon" is not a time; write it as'):
        validate(job_data() | {"status": {"startTime": "noon"}})
