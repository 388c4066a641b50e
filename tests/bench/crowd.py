"""Many jobs at once, as bare Jobs, as the four objects of a plan, and as TrainingJobs."""

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
TEMPLATE = "planned-once"  # replaced by each job's own name


def training_job(name, namespace):
    """Return the smallest TrainingJob."""
    job = yaml.safe_load(MINIMAL.read_text())
    return job | {"metadata": {"name": name, "namespace": namespace}}


def create_training_jobs(api, namespace, count):
    """Create TrainingJobs, several at a time."""
    jobs = [training_job(name, namespace) for name in names(count)]
    in_parallel(lambda job: api.create(TRAINING_JOBS, job), jobs)


def create_all_objects(api, namespace, count):
    """Create what the operator creates for that many jobs: four objects each, several jobs at a time."""
    template = planned(namespace)

    def create(name):
        for obj in renamed(template, name):
            api.create(resource_of(obj), obj)

    in_parallel(create, names(count))


def create_bare_jobs(api, namespace, count):
    """Create only the Jobs; their pods are made although the objects that they mount are missing."""
    template = planned(namespace)[-1:]  # the Job is last, after the objects that its pods mount
    jobs = [obj for name in names(count) for obj in renamed(template, name)]
    in_parallel(lambda job: api.create(JOBS, job), jobs)


def planned(namespace):
    """Return the objects of one TrainingJob as text.

    They have no owner and labels, so operators ignore them.
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
    """Return the names of some jobs."""
    return [f"job-{number:05d}" for number in range(count)]


def in_parallel(do, items):
    """Do something with each item, several at a time; raise the first error."""
    with ThreadPoolExecutor(CLIENTS) as pool:
        list(pool.map(do, items))


def wait_for_account(api, namespace):
    """Return when a new namespace has its service account, without which it accepts no pods."""
    wait_for_count(api, ACCOUNTS, namespace, 1)


def wait_for_count(api, resource, namespace, count):
    """Return when a kind has so many objects.

    Raises:
        TooLate: this takes more than twenty minutes.
    """
    eventually(lambda: len(api.list(resource.only_metadata(), namespace)) >= count, DEADLINE_S, LOOK_EVERY_S)


def wait_for_silence(plane):
    """Return after ten seconds in which the operator sent only watches and requests for the Lease."""

    def silent():
        before = sum(each.counts for each in asked(plane))
        time.sleep(SILENCE_S)  # the test waits for a period without requests
        return sum(each.counts for each in asked(plane)) == before

    eventually(silent, DEADLINE_S)
