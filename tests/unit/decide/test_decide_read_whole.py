"""The operator reads a whole job only to plan it, and plans it only after its worlds were checked."""

from dataclasses import replace

import pytest

from palaestra.api.status import Phase
from palaestra.decide import accept, prepare, wants_whole, worlds_to_check
from palaestra.observe import Lacking, Objects, observe, references
from palaestra.plan import WorldVerdict

INITIAL = {"initialPolicy": {"claim": "runs", "path": "a/model.zip"}}
OPEN = {"palaestra.dev/for-jobs": "true"}
GROUPS = [{"name": "collect", "role": "Collect"}, {"name": "evaluate", "role": "Evaluate"}]
WORLD = [{**GROUPS[0], "world": {"configMap": {"name": "worlds", "key": "hall.wbt"}}}, GROUPS[1]]
WORLD_TEXT = """#VRML_SIM R2023b utf8
WorldInfo { }
Robot { name "one" supervisor TRUE controller "ros" }
"""


def config_map(data=None, labels=None):
    """Return a ConfigMap."""
    return {"metadata": {"name": "worlds", "labels": OPEN if labels is None else labels}, "data": data or {}}


def observed(scene):
    """Return the job of a scene, its observed state and the layout."""
    job = accept(scene.raw)
    sources = {each: scene.there.get((each.kind.value, each.name)) for each in references(job)}
    return job, replace(observe(job, Objects(**scene.objects)), sources=sources), scene.layout


def test_a_job_is_read_whole_when_it_is_planned_and_not_before(make_scene, accepted):
    """The cache holds only digests of large fields, and a whole read may transfer a megabyte."""
    to_plan, planned, waits = make_scene(), accepted(), make_scene(simulators=WORLD)

    assert wants_whole(*observed(to_plan), Lacking.TEXTS)
    assert not wants_whole(*observed(to_plan), None)
    assert not wants_whole(*observed(planned), Lacking.FIELDS)
    assert not wants_whole(*observed(waits), Lacking.TEXTS)


def test_a_job_that_lacks_references_is_read_whole_even_while_it_waits(make_scene):
    """The cached job lacks references, one of which may name the object that the job waits for."""
    assert wants_whole(*observed(make_scene(simulators=WORLD)), Lacking.FIELDS)


def test_a_job_that_has_failed_is_not_read_again(make_scene):
    """The operator never creates objects for a refused job, so it does not need the whole job."""
    scene = make_scene(simulators=[{**GROUPS[0], "world": {"inline": "no world"}}, GROUPS[1]])
    scene.settle()

    assert not wants_whole(*observed(scene), Lacking.FIELDS)


def test_a_claim_that_only_the_initial_policy_names_counts_as_there(make_scene):
    """The operator does not create this claim, so a Job that mounts it lacks no object."""
    scene = make_scene(trainer=INITIAL)
    scene.there[("PersistentVolumeClaim", "runs")] = {"metadata": {"name": "runs", "labels": OPEN}}
    scene.settle()

    assert scene.settle().actions == ()


COSTLY = "spec.simulators[0].world.inline: its check takes more than its budget"


@pytest.mark.parametrize(
    ("verdict", "reason", "phase"),
    [
        pytest.param(None, "CheckingWorlds", Phase.PENDING, id="not yet"),
        pytest.param(WorldVerdict(), "Accepted", Phase.PENDING, id="fine"),
        pytest.param(WorldVerdict(problem="a fact"), "WorldInvalid", Phase.FAILED, id="wrong"),
        pytest.param(
            WorldVerdict(problem=COSTLY, too_costly=True), "WorldTooCostly", Phase.FAILED, id="costly"
        ),
    ],
)
def test_the_verdict_on_a_world_decides(make_scene, verdict, reason, phase):
    """Another process checks the world, so the decision uses its verdict and does not read the world."""
    scene = make_scene(simulators=[{**GROUPS[0], "world": {"inline": "not read"}}, GROUPS[1]])
    job = accept(scene.raw)
    [world] = worlds_to_check(job, observe(job, Objects()), scene.layout)
    scene.verdicts = {} if verdict is None else {world.digest: verdict}

    scene.settle()

    accepted = scene.status.conditions[0]
    assert (accepted.reason, scene.status.phase) == (reason, phase)
    assert verdict is None or not verdict.problem or accepted.message == verdict.problem


def test_a_costly_world_of_a_config_map_is_final_too(make_scene):
    """If the job could be retried, each change of the ConfigMap would cause another costly check."""
    scene = make_scene(simulators=WORLD)
    scene.there[("ConfigMap", "worlds")] = config_map({"hall.wbt": WORLD_TEXT})
    job = accept(scene.raw)
    sources = {each: config_map({"hall.wbt": WORLD_TEXT}) for each in references(job)}
    observed = replace(observe(job, Objects()), sources=sources)
    [world] = worlds_to_check(job, observed, scene.layout)
    scene.verdicts = {world.digest: WorldVerdict(problem=COSTLY, too_costly=True)}

    scene.settle()

    assert scene.status.phase is Phase.FAILED


def test_a_job_whose_worlds_wait_is_not_read_again(make_scene):
    """The job may be large, and the operator decides nothing before the worlds are checked."""
    scene = make_scene(simulators=WORLD)
    job = accept(scene.raw)
    observed = replace(observe(job, Objects()), worlds_wait=True)

    for lacks in Lacking:
        assert not wants_whole(job, observed, scene.layout, lacks)
    assert worlds_to_check(job, observed, scene.layout) == ()
    hold = prepare(job, observed, scene.layout).hold
    assert hold is not None
    assert (hold.explanation.reason.value, hold.final) == ("CheckingWorlds", False)
