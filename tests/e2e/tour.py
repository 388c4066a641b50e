"""Actions of a person in a namespace, after which an operator has used each of its permissions.

The list consists of actions, and not of permissions, so that unnecessary permissions are found.
"""

from palaestra.plan.job import QUEUE_LABEL
from palaestra_sim.world import builtin
from tests.e2e.cluster import Object
from tests.e2e.jobs import LITTLE, WAIT, make_claim, tiny_job
from tests.e2e.namespace import LONG_S, OPERATOR, Namespace, named

FOR_JOBS = {"palaestra.dev/for-jobs": "true"}
WORLD = {"configMap": {"name": "worlds", "key": "arena.wbt"}}
SPENT = {"metadata": {"name": "spent"}, "spec": {"hard": {"pods": "0"}}}


def tour(place: Namespace, operators: str) -> None:
    """Make the operator do all its work in `place`; the operator's pods are in the namespace `operators`."""
    refer(place)
    wait_in_queue(place)  # the operator requests the reason after 5 s; the next actions take longer
    give_up(place)
    stop_suspended(place)
    delete_unbound(place)
    suspend(place, flag=False)
    replace_pod(place)
    suspend(place, flag=True)
    replace_operator(place, operators)
    suspend(place, flag=False)  # the new operator must read and count the events of the old operator
    suspend(place, flag=True)
    place.create("resourcequotas", SPENT)
    place.apply(tiny_job("refused", script="exit 0"))
    place.wait(lambda: "PodsRefused" in place.reasons("refused"), LONG_S)


def refer(place: Namespace) -> None:
    """Create jobs that use an existing claim and an existing world, and a job whose Job name is taken."""
    place.create("persistentvolumeclaims", make_claim("shared", labels=FOR_JOBS))
    world = {"arena.wbt": builtin("arena").decode()}
    place.create("configmaps", {"metadata": {"name": "worlds", "labels": FOR_JOBS}, "data": world})
    place.create("jobs", somebody_s("taken-0"))
    place.apply(tiny_job("claimed", script="exit 0", suspend=True, storage={"existingClaim": "shared"}))
    place.apply(tiny_job("mapped", script="exit 0", suspend=True, simulator={"world": WORLD}))
    place.apply(tiny_job("taken", script="exit 0"))
    place.apply(tiny_job("paused", script=WAIT, suspend=True))
    for name in ("claimed", "mapped", "paused"):
        place.wait(lambda name=name: place.select("jobs", name), LONG_S)
    place.wait(lambda: "NameTaken" in place.reasons("taken"), LONG_S)


def wait_in_queue(place: Namespace) -> None:
    """Label a suspended Job with a queue, as Kueue does in a namespace with a default queue.

    Kueue never admits the Job.
    """
    place.cluster.patch("jobs", place.name, "mapped-0", {"metadata": {"labels": {QUEUE_LABEL: "default"}}})
    place.wait(lambda: "Queued" in place.reasons("mapped"), LONG_S)


def give_up(place: Namespace) -> None:
    """Create a job that fails at once and is deleted by its TTL."""
    place.apply(tiny_job("brief", trainer={"algorithm": {"name": "SAC"}}, ttlSecondsAfterFinished=1))
    place.wait(lambda: place.get("trainingjobs", "brief") is None, LONG_S)


def stop_suspended(place: Namespace) -> None:
    """Let a job's deadline pass while one of its Jobs is suspended; the operator then deletes that Job."""
    place.apply(tiny_job("over", script=WAIT, replicas=2, activeDeadlineSeconds=15))
    place.wait(lambda: len(place.pods("over")) == 2, LONG_S)
    place.cluster.patch("jobs", place.name, "over-0", {"spec": {"suspend": True}})
    place.wait(lambda: place.get("jobs", "over-0") is None, LONG_S)


def delete_unbound(place: Namespace) -> None:
    """Delete a job whose claim was never bound; the operator then deletes the claim."""
    place.apply(tiny_job("unbound", script=WAIT, suspend=True))
    [claim] = place.wait(lambda: place.select("persistentvolumeclaims", "unbound"), LONG_S)
    place.cluster.delete("trainingjobs", place.name, "unbound")
    place.wait(lambda: place.get("persistentvolumeclaims", named(claim)) is None, LONG_S)


def suspend(place: Namespace, *, flag: bool) -> None:
    """Suspend or resume a job, and wait until its Job follows."""
    place.patch("paused", suspend=flag)
    place.wait(lambda: (place.get("jobs", "paused-0") or {})["spec"]["suspend"] is flag, LONG_S)


def replace_pod(place: Namespace) -> None:
    """Make the operator replace a job's pod, by the annotation that a killed operator leaves."""
    pod = place.wait(lambda: next(iter(place.pods("paused")), None), LONG_S)
    mark = f"1 {pod['metadata']['uid']} Stalled: it stands still"
    annotations = {"metadata": {"annotations": {"palaestra.dev/replaced": mark}}}
    place.cluster.patch("jobs", place.name, "paused-0", annotations)
    place.wait(lambda: place.get("pods", named(pod)) is None, LONG_S)


def replace_operator(place: Namespace, operators: str) -> None:
    """Delete the operator's pods and its Lease, so that the next operator creates a Lease."""
    before = place.cluster.select("pods", operators, "app.kubernetes.io/component=operator")
    for pod in before:
        place.cluster.delete("pods", operators, named(pod))
        place.wait(lambda pod=pod: place.cluster.get("pods", operators, named(pod)) is None, LONG_S)
    place.cluster.delete("leases", operators, OPERATOR)
    place.cluster.rolled_out(operators, OPERATOR)


def somebody_s(name: str) -> Object:
    """Return a Job that is unrelated to Palaestra."""
    container = {"name": "main", "image": "theirs:1", "resources": LITTLE}
    template = {"spec": {"restartPolicy": "Never", "containers": [container]}}
    return {"metadata": {"name": name}, "spec": {"suspend": True, "template": template}}
