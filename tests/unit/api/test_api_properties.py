"""Any job stays equal when it is written and read; any damaged job is accepted or refused with messages."""

import re
from copy import deepcopy

import yaml
from hypothesis import given
from hypothesis import strategies as st

from palaestra.api import as_data, dump, load, validate
from palaestra.errors import SpecErrors
from tests.jobs import make_job

NAMES = st.from_regex(r"[a-z][a-z0-9]{0,8}", fullmatch=True)
COUNTS = st.integers(1, 10_000)
TEXTS = st.text(st.characters(exclude_categories=["Cs"]), max_size=20)
NUMBERS = st.floats(allow_nan=False, allow_infinity=False)
FREE = st.dictionaries(
    NAMES, st.integers() | NUMBERS | TEXTS | st.booleans() | st.lists(NUMBERS, max_size=3),
    max_size=4,
)  # fmt: skip
VARIABLES = st.lists(
    st.fixed_dictionaries({"name": NAMES, "value": TEXTS})
    | st.fixed_dictionaries(
        {"name": NAMES, "secretKeyRef": st.fixed_dictionaries({"name": NAMES, "key": NAMES})}
    ),
    max_size=3,
    unique_by=lambda variable: variable["name"],
)
QUANTITIES = st.sampled_from([1, 8, "500m", "0.5", "512Mi", "2Gi"])
RESOURCES = st.fixed_dictionaries(
    {}, optional={"limits": st.dictionaries(st.sampled_from(["cpu", "memory"]), QUANTITIES)}
)
RECYCLING = st.fixed_dictionaries(
    {},
    optional={
        "afterResets": st.integers(0, 10_000),
        "afterMinutes": COUNTS,
        "aboveMemory": st.sampled_from(["400Mi", "2Gi"]),
    },
).filter(bool)
WORLDS = st.sampled_from(
    [
        {"builtin": "arena"},
        {"inline": "#VRML_SIM R2023b utf8\nWorldInfo { }\n"},
        {"configMap": {"name": "worlds", "key": "hall.wbt"}},
        {"file": "/worlds/hall.wbt"},
        {"file": "/lab/worlds/hall.wbt", "root": "/lab"},
    ]
)
DRIVERS = st.sampled_from(
    [{"driver": "stub"}, {"driver": "mujoco"}, {"driver": "webots", "image": "webots:1"},
     {"driver": "command", "image": "mine:1", "command": ["simulate", "no", "5e-4"]}]
)  # fmt: skip


def groups(role: str) -> st.SearchStrategy[dict]:
    """Return groups of one role; each is named after its role."""
    optional = {
        "count": st.integers(1, 16),
        "world": WORLDS,
        "recycle": RECYCLING,
        "reset": st.sampled_from(["Reset", "Reload"]),
        "standby": st.booleans(),
        "minSimulators": st.just(1),
        "restart": st.fixed_dictionaries({}, optional={"limit": st.integers(0, 9)}),
        "startDeadlineSeconds": COUNTS,
        "env": VARIABLES,
        "resources": RESOURCES,
        "options": st.lists(TEXTS.filter(bool), max_size=3),
    }
    fixed = st.fixed_dictionaries({"name": st.just(role.lower()), "role": st.just(role)}, optional=optional)
    return st.builds(lambda group, driver: group | driver, fixed, DRIVERS)


TRAINERS = st.fixed_dictionaries(
    {},
    optional={
        "environment": st.fixed_dictionaries(
            {}, optional={"reward": st.sampled_from(["Dense", "Sparse"]), "options": FREE}
        ),
        "algorithm": st.fixed_dictionaries(
            {"name": st.sampled_from(["DQN", "PPO", "A2C", "REINFORCE"])},
            optional={"hyperparameters": FREE},
        ),
        "steps": COUNTS,
        "evaluation": st.fixed_dictionaries(
            {}, optional={"everySteps": COUNTS, "stopAtSuccessRate": st.floats(0.01, 1)}
        ),
        "command": st.lists(TEXTS.filter(bool), max_size=3),
        "env": VARIABLES,
        "resources": RESOURCES,
    },
)
SPECS = st.fixed_dictionaries(
    {"simulators": st.tuples(groups("Collect"), groups("Evaluate")).map(list)},
    optional={
        "replicas": st.integers(1, 100),
        "seed": COUNTS,
        "trainer": TRAINERS,
        "storage": st.sampled_from(
            [{"ephemeral": True}, {"size": "2Gi"}, {"existingClaim": "a", "resumeFrom": "b"}]
        ),
        "suspend": st.booleans(),
        "activeDeadlineSeconds": COUNTS,
        "scheduling": st.fixed_dictionaries(
            {}, optional={"nodeSelector": st.dictionaries(NAMES, NAMES, max_size=3), "affinity": FREE}
        ),
        "imagePullSecrets": st.just([{"name": "pull"}]),
    },
)
JOBS = st.fixed_dictionaries(
    {
        "apiVersion": st.just("palaestra.dev/v1alpha1"),
        "kind": st.just("TrainingJob"),
        "metadata": st.fixed_dictionaries(
            {"name": NAMES}, optional={"labels": st.dictionaries(NAMES, NAMES, max_size=3)}
        ),
        "spec": SPECS,
    }
)
RUBBISH = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=10),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=5), inner,
                                                                max_size=3),
    max_leaves=6,
)  # fmt: skip

LINE = re.compile(r"""(\w+|\[").*?: .+; .+""")  # `.` matches no line break, so each text is one line


def told(data: object) -> tuple[str, ...] | None:
    """Return the problems of a job, given as text or as data; None if it is valid."""
    try:
        load(data, "job.yaml") if isinstance(data, str) else validate(data)
    except SpecErrors as error:
        return error.problems
    return None


def well_told(problems: tuple[str, ...]) -> bool:
    """Return whether at least one problem is given, and each is a line with a path, a fact and a remedy."""
    return bool(problems) and all(LINE.fullmatch(line) for line in problems)


@given(JOBS)
def test_a_job_is_the_same_after_writing_and_reading(data) -> None:
    """The job that `palaestra` records must be the job that it ran."""
    job = validate(data)

    assert load(dump(job), "job.yaml") == job


@given(JOBS)
def test_defaults_are_resolved_once(data) -> None:
    """An API server stores a job with its defaults written out, and the job must keep its meaning."""
    resolved = as_data(validate(data))

    assert as_data(validate(resolved)) == resolved


@given(JOBS)
def test_a_job_does_not_change_what_it_was_read_from(data) -> None:
    """The data belongs to the caller, so `validate` must not change it."""
    before = deepcopy(data)

    validate(data)

    assert data == before


def places(data: object) -> list[tuple]:
    """Return the container and the key of each value in `data`."""
    if isinstance(data, dict):
        return [(data, key) for key in data] + [p for v in data.values() for p in places(v)]
    if isinstance(data, list):
        return [(data, index) for index in range(len(data))] + [p for v in data for p in places(v)]
    return []


@given(JOBS, st.data())
def test_a_mutilated_job_is_accepted_or_refused_in_words(job, draw) -> None:
    """Whatever value is put at any path, each error has a path, a fact and a remedy."""
    data = deepcopy(job)
    for _ in range(draw.draw(st.integers(1, 3))):
        holder, key = draw.draw(st.sampled_from(places(data)))
        if isinstance(holder, dict) and draw.draw(st.booleans()):
            key = draw.draw(st.text(max_size=8))
        holder[key] = draw.draw(RUBBISH)

    problems = told(data)

    assert problems is None or well_told(problems), problems


@given(JOBS, st.data())
def test_whatever_is_taken_from_a_job_file_the_reader_copes(job, draw) -> None:
    """An editor that crashes may leave half a file, which must give an error message and not a traceback."""
    text = yaml.safe_dump(job)
    start = draw.draw(st.integers(0, len(text)))
    end = draw.draw(st.integers(start, len(text)))

    problems = told(text[:start] + text[end:])

    assert problems is None or well_told(problems), problems


@given(RUBBISH.filter(lambda data: not isinstance(data, str)))
def test_rubbish_is_refused(data) -> None:
    """A value that is not a TrainingJob is never accepted as one."""
    problems = told(data)

    assert problems is not None
    assert well_told(problems), problems


# The limits are those of Kubernetes' own API (core/v1, Affinity).
EXPRESSIONS = st.lists(
    st.fixed_dictionaries(
        {"key": NAMES, "operator": st.just("In"), "values": st.lists(NAMES, min_size=1, max_size=2)}
    ),
    min_size=1,
    max_size=2,
)
SELECTORS = st.fixed_dictionaries(
    {}, optional={"matchLabels": st.dictionaries(NAMES, NAMES), "matchExpressions": EXPRESSIONS}
)
POD_TERMS = st.fixed_dictionaries(
    {"topologyKey": NAMES, "labelSelector": SELECTORS},
    optional={"namespaceSelector": SELECTORS, "namespaces": st.lists(NAMES, max_size=2)},
)
NODE_TERMS = st.fixed_dictionaries({}, optional={"matchExpressions": EXPRESSIONS, "matchFields": EXPRESSIONS})


def preferring(field: str, terms: st.SearchStrategy[dict]) -> st.SearchStrategy[list[dict]]:
    """Return lists of preferences, each with its weight."""
    return st.lists(
        st.fixed_dictionaries({"weight": st.integers(1, 100), field: terms}), min_size=1, max_size=2
    )


def near(terms: st.SearchStrategy[dict]) -> st.SearchStrategy[dict]:
    """Return affinities between pods."""
    return st.fixed_dictionaries(
        {"preferredDuringSchedulingIgnoredDuringExecution": preferring("podAffinityTerm", terms)},
        optional={"requiredDuringSchedulingIgnoredDuringExecution": st.lists(terms, max_size=2)},
    )


AFFINITIES = st.fixed_dictionaries(
    {"podAntiAffinity": near(POD_TERMS)},
    optional={
        "podAffinity": near(POD_TERMS),
        "nodeAffinity": st.fixed_dictionaries(
            {
                "preferredDuringSchedulingIgnoredDuringExecution": preferring("preference", NODE_TERMS),
                "requiredDuringSchedulingIgnoredDuringExecution": st.fixed_dictionaries(
                    {"nodeSelectorTerms": st.lists(NODE_TERMS, min_size=1, max_size=2)}
                ),
            }
        ),
    },
)


@given(AFFINITIES)
def test_any_affinity_of_a_pod_is_accepted(affinity):
    """The API server accepts in a job every affinity that it accepts in a pod.

    The models must accept it too, or the operator would refuse the job after `kubectl apply`.
    """
    job = validate(make_job(scheduling={"affinity": affinity}))

    assert job.spec.scheduling.affinity == affinity
