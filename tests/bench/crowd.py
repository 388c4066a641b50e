"""Many jobs at once: as Jobs alone, as the four objects of a plan, or as TrainingJobs."""

import json
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import yaml

from palaestra.api import validate
from palaestra.cluster import Resource
from palaestra.cluster.resources import JOBS, TRAINING_JOBS, resource_of
from palaestra.plan import ClusterLayout, Images, identified, plan
from tests.integration.operator.installed import asked
from tests.waiting import eventually

MINIMAL = Path(__file__).parents[2] / "manifests" / "examples" / "minimal.yaml"
ACCOUNTS = Resource(api_version="v1", kind="ServiceAccount", plural="serviceaccounts")
CLIENTS = 8
DEADLINE_S = 1200
SILENCE_S = 10
LOOK_EVERY_S = 0.5
PER_OBJECT_S = 0.0005  # a long list keeps the API server busy, so it is read less often
TEMPLATE = "planned-once"  # `renamed` replaces this text by the name of a job


def training_job(name, namespace):
    """Return the smallest TrainingJob."""
    job = yaml.safe_load(MINIMAL.read_text())
    return job | {"metadata": {"name": name, "namespace": namespace}}


def create_training_jobs(api, namespace, count):
    """Create TrainingJobs, several at a time."""
    jobs = [training_job(name, namespace) for name in names(count)]
    in_parallel(lambda job: api.create(TRAINING_JOBS, job), jobs)


def create_all_objects(api, namespace, count):
    """Create the four objects that the operator creates for each job, for several jobs at a time."""
    template = planned(namespace)

    def create(name):
        for obj in renamed(template, name):
            api.create(resource_of(obj), obj)

    in_parallel(create, names(count))


def create_bare_jobs(api, namespace, count):
    """Create only the Jobs; Kubernetes creates their pods even though the mounted objects are missing."""
    template = planned(namespace)[-1:]  # the plan ends with the Job, after the objects that its pods mount
    jobs = [obj for name in names(count) for obj in renamed(template, name)]
    in_parallel(lambda job: api.create(JOBS, job), jobs)


def planned(namespace):
    """Return the objects of one TrainingJob as text.

    Owner and labels are removed, so that operators ignore the objects.
    """
    uid = "00000000-0000-0000-0000-000000000000"
    job = identified(validate(training_job(TEMPLATE, namespace)), uid)
    images = Images(trainer="trainer:bench", stub="stub:bench", mujoco="mujoco:bench", webots="webots:bench")
    objects = [dict(each) for each in plan(job, ClusterLayout(images=images)).objects]
    for obj in objects:
        obj["metadata"] = {key: held for key, held in obj["metadata"].items() if key != "ownerReferences"}
    return [json.dumps(each).replace("palaestra.dev/", "bench.example/") for each in objects]


def renamed(template, name):
    """Return planned objects under the name of another job."""
    return [json.loads(text.replace(TEMPLATE, name)) for text in template]


def names(count):
    """Return the names of `count` jobs."""
    return [f"job-{number:05d}" for number in range(count)]


def in_parallel(do, items):
    """Call `do` with each item, several at a time; raise the first error."""
    with ThreadPoolExecutor(CLIENTS) as pool:
        list(pool.map(do, items))


def wait_for_account(api, namespace):
    """Wait until a new namespace has its service account, without which it accepts no pods."""
    wait_for_count(api, ACCOUNTS, namespace, 1)


def wait_for_count(api, resource, namespace, count):
    """Wait until a namespace contains `count` objects of a kind.

    Raises:
            TooLate: the objects do not exist after twenty minutes.
    """
    pace_s = max(LOOK_EVERY_S, PER_OBJECT_S * count)
    eventually(lambda: len(api.list(resource.only_metadata(), namespace)) >= count, DEADLINE_S, pace_s)


def wait_for_silence(plane):
    """Wait until, for ten seconds, the operator has sent only watches and requests for the Lease."""

    def silent():
        before = sum(each.counts for each in asked(plane))
        time.sleep(SILENCE_S)  # the period in which no request may arrive
        return sum(each.counts for each in asked(plane)) == before

    eventually(silent, DEADLINE_S)
