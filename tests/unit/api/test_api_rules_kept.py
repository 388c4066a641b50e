"""A rule accepts every job that keeps it, even if a small change of the job would break the rule."""

import pytest

COMMAND = {"name": "collect", "role": "Collect", "driver": "command"}

# Changes to the same fields that break no rule.
KEPT = {
    "no evaluation at all": {
        "simulators": [{"name": "collect", "role": "Collect"}],
        "trainer.evaluation": {"everySteps": 0},
    },
    "as many as a pod takes": {
        "simulators": [
            {"name": "a", "role": "Collect", "count": 16},
            {"name": "b", "role": "Evaluate", "count": 16},
        ]
    },
    "suspended by its author": {"suspend": True},
    "suspended by Kueue": {"scheduling.queueName": "robots"},
    "a program of one's own": {
        "simulators.0": {**COMMAND, "image": "mine:1", "command": ["simulate", "--fast"]}
    },
    "never recycled": {"simulators.0.recycle": {"afterResets": 0}},
    "recycled by its memory alone": {"simulators.0.recycle": {"aboveMemory": "400Mi"}},
    "recycled by its age alone": {"simulators.0.recycle": {"afterMinutes": 30}},
    "a new process for each episode": {
        "simulators.0.reset": "Restart",
        "simulators.0.recycle": {"aboveMemory": "400Mi"},
    },
    "all of a group are enough": {"simulators.0.count": 2, "simulators.0.minSimulators": 2},
    "a world in the image": {"simulators.0.world": {"file": "/worlds/hall.wbt"}},
    "a world below a root": {"simulators.0.world": {"file": "/lab/worlds/hall.wbt", "root": "/lab"}},
    "a world in the job": {"simulators.0.world": {"inline": "#VRML_SIM R2023b utf8\n"}},
    "a world in a ConfigMap": {"simulators.0.world": {"configMap": {"name": "worlds", "key": "hall.wbt"}}},
    "an empty variable": {"trainer.env": [{"name": "A", "value": ""}]},
    "a secret variable": {"trainer.env": [{"name": "A", "secretKeyRef": {"name": "keys", "key": "a"}}]},
    "a variable that is nearly ours": {"trainer.env": [{"name": "MY_ROS_", "value": "1"}]},
    "SAC with twists": {
        "trainer.algorithm.name": "SAC",
        "trainer.environment.options": {"actions": "continuous"},
    },
    "an algorithm of one's own": {"trainer.algorithm.name": "my_lab.learning:Ours"},
    "a robot that ships": {"trainer.robot": "EPuck"},
    "a robot of one's own": {"trainer.robot": "my_lab.robots:Ours"},
    "SAC in a task that we do not know": {
        "trainer.algorithm.name": "SAC",
        "trainer.environment.id": "mine:Hall-v1",
    },
    "PPO with twists": {
        "trainer.algorithm.name": "PPO",
        "trainer.environment.options": {"actions": "continuous"},
    },
    "everything normalized": {"trainer.algorithm.normalize": {}},
    "rewards normalized and clipped": {
        "trainer.algorithm.normalize": {"observations": False, "clipRewards": 5}
    },
    "kept nowhere": {"storage.ephemeral": True},
    "another job's run": {"storage": {"existingClaim": "runs", "resumeFrom": "5a0c"}},
    "a policy of a claim": {"trainer.initialPolicy": {"claim": "runs", "path": "5a0c/0/model.zip"}},
    "a policy in the image": {"trainer.initialPolicy": {"path": "/opt/my policy.zip"}},
    "a class of one's own": {"scheduling.priorityClassName": "urgent"},
    "a label under a domain": {"scheduling.podLabels": {"example.com/team": "robots"}},
    "a note, and word to an autoscaler": {
        "scheduling.podAnnotations": {"note": "x", "cluster-autoscaler.kubernetes.io/safe-to-evict": "false"}
    },
    "any value of a taint": {"scheduling.tolerations": [{"key": "gpu", "operator": "Exists"}]},
    "a taint for a minute": {
        "scheduling.tolerations": [{"key": "gpu", "effect": "NoExecute", "tolerationSeconds": 60}]
    },
}


@pytest.mark.parametrize("name", KEPT)
def test_what_keeps_the_rules_is_accepted(name, problems) -> None:
    """A rule must not refuse more than its message says."""
    assert problems(KEPT[name]) == []
