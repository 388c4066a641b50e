"""JobSet and Kubeflow Trainer next to a control plane without nodes: their programs and their objects.

Each program has the configuration, the definitions and the webhooks of its Go module's manifests, with these
differences. It listens only on the loopback interface, where the API server calls its webhooks. It serves
them with the API server's certificate. Leader election and metrics are off. It connects as an administrator.
"""

import base64
import json
import os
import subprocess
import urllib.request
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from urllib.error import URLError

import yaml

from palaestra.cluster import Resource
from palaestra.local.ports import LOOPBACK, HeldPorts
from tests.bench import crowd
from tests.control_plane.programs import MISSING, SCRIPTS, NoPrograms
from tests.waiting import eventually

BUILD_DEADLINE_S = 3600
READY_S = 120
ADMINISTRATORS = "system:masters"
JOB_SETS = Resource(api_version="jobset.x-k8s.io/v1alpha2", kind="JobSet", plural="jobsets")
TRAINER_API = "trainer.kubeflow.org/v1alpha1"
TRAIN_JOBS = Resource(api_version=TRAINER_API, kind="TrainJob", plural="trainjobs")
RUNTIMES = Resource(api_version=TRAINER_API, kind="TrainingRuntime", plural="trainingruntimes")
# The selector that JobSet's Kustomize patches add to its webhooks for pods.
OF_A_JOB_SET = {"matchExpressions": [{"key": "jobset.sigs.k8s.io/jobset-name", "operator": "Exists"}]}
STEP = {"trainer.kubeflow.org/trainjob-ancestor-step": "trainer"}
CONTAINER = "node"  # the name that Kubeflow Trainer requires
RUNTIME = "bench"


@dataclass(frozen=True, slots=True, kw_only=True)
class ForeignOperator:
    """An operator of another project.

    Attributes:
        program: its name in tests/cluster/programs/list, and of its folder next to that file.
        module: its Go module, which contains the following paths.
        definitions: the folder with the definitions of its kinds.
        webhooks: the file with its webhooks.
        configuration: the file with its configuration.
        certificates: the field of the configuration that makes the program create its own certificates.
    """

    program: str
    module: str
    definitions: str
    webhooks: str
    configuration: str
    certificates: str

    @property
    def user(self):
        """The user that sends the program's requests."""
        return f"bench:{self.program}"


JOB_SET = ForeignOperator(
    program="jobset",
    module="sigs.k8s.io/jobset",
    definitions="config/components/crd/bases",
    webhooks="config/components/webhook/manifests.yaml",
    configuration="config/components/manager/controller_manager_config.yaml",
    certificates="internalCertManagement",
)
TRAINER = ForeignOperator(
    program="kubeflow-trainer",
    module="github.com/kubeflow/trainer/v2",
    definitions="manifests/base/crds",
    webhooks="manifests/base/webhook/manifests.yaml",
    configuration="manifests/base/manager/controller_manager_config.yaml",
    certificates="certManagement",
)


def programs(*, build):
    """Return the folder of both programs.

    Raises:
        NoPrograms: a program is missing and `build` is false, or the build failed.
    """
    names = (JOB_SET.program, TRAINER.program)
    command = [str(SCRIPTS / "programs.sh"), *([] if build else ["--built"]), *names]
    done = subprocess.run(command, capture_output=True, text=True, timeout=BUILD_DEADLINE_S, check=False)
    if done.returncode == MISSING:
        raise NoPrograms(
            f"programs are not built; build them with tests/cluster/programs.sh {' '.join(names)}"
        )
    if done.returncode:
        raise NoPrograms(f"{' '.join(command)} failed: {done.stderr[-2000:]}")
    return Path(done.stdout.strip().splitlines()[-1])


def versions():
    """Return the version of each operator by the name of its program."""
    return {each.program: _of_module(each, "Version") for each in (JOB_SET, TRAINER)}


@contextmanager
def running_foreign(plane, operators):
    """Define the kinds of operators and run their programs until the block ends; yield their process IDs.

    The kinds of the last operator need those of the first.
    """
    binaries, processes = programs(build=True), {}
    try:
        with HeldPorts() as ports:
            for each in operators:
                source = _source(each)
                _define(plane, source / each.definitions)
                webhooks, health = ports.any(), ports.any()
                configuration = _configuration(each, source, webhooks, health)
                processes[each.program] = _start(plane, each, binaries, configuration)
                eventually(lambda port=health: _ready(port), READY_S)
                _apply(plane, _webhooks(plane, each, source, webhooks))
            yield {program: process.pid for program, process in processes.items()}
    finally:
        for process in processes.values():
            process.kill()
            process.wait()


def create_job_sets(api, namespace, count):
    """Create JobSets with one replicated Job each; the Job has the spec that a TrainingJob's Job has."""
    spec = json.loads(crowd.planned(namespace)[-1])["spec"]
    jobs = {"name": "replica", "replicas": 1, "template": {"spec": spec}}
    _create(api, JOB_SETS, namespace, count, {"replicatedJobs": [jobs]})


def create_train_jobs(api, namespace, count):
    """Create TrainJobs of one TrainingRuntime; its pods have the spec that a TrainingJob's pods have."""
    spec = json.loads(crowd.planned(namespace)[-1])["spec"]["template"]["spec"]
    spec["containers"][0]["name"] = CONTAINER
    job = {"metadata": {"labels": STEP}, "spec": {"backoffLimit": 3, "template": {"spec": spec}}}
    runtime = {
        "mlPolicy": {"numNodes": 1},
        "template": {"spec": {"replicatedJobs": [{"name": CONTAINER, "template": job}]}},
    }
    api.create(RUNTIMES, _object(RUNTIMES, namespace, RUNTIME, runtime))
    _create(api, TRAIN_JOBS, namespace, count, {"runtimeRef": {"name": RUNTIME, "kind": RUNTIMES.kind}})


def _create(api, resource, namespace, count, spec):
    """Create objects with one spec, several at a time."""
    objects = [_object(resource, namespace, name, spec) for name in crowd.names(count)]
    crowd.in_parallel(lambda obj: api.create(resource, obj), objects)


def _object(resource, namespace, name, spec):
    return {
        "apiVersion": resource.api_version,
        "kind": resource.kind,
        "metadata": {"name": name, "namespace": namespace},
        "spec": spec,
    }


def _source(operator):
    """Return the folder of a module's files; the build of the program downloaded it."""
    return Path(_of_module(operator, "Dir"))


def _of_module(operator, field):
    """Return a field of an operator's Go module, such as Version, as `go list -m` prints it."""
    folder = SCRIPTS / "programs" / operator.program
    command = ["go", "list", "-mod=readonly", "-m", "-f", f"{{{{.{field}}}}}", operator.module]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, check=True).stdout.strip()


def _define(plane, folder):
    """Create the definitions of a folder, and wait until the API server serves them."""
    documents = [yaml.safe_load(path.read_text()) for path in sorted(folder.glob("*_*.yaml"))]
    _apply(plane, documents)
    plane.await_kinds(*(f"crd/{each['metadata']['name']}" for each in documents))


def _apply(plane, documents):
    done = plane.kubectl("apply", "--server-side", "--filename=-", sent=yaml.safe_dump_all(documents))
    if done.returncode:
        raise RuntimeError(done.stderr)


def _configuration(operator, source, webhooks_port, health_port):
    """Return the configuration in a program's manifests, with the differences that the module names."""
    return yaml.safe_load((source / operator.configuration).read_text()) | {
        "webhook": {"host": LOOPBACK, "port": webhooks_port},
        "health": {"healthProbeBindAddress": f"{LOOPBACK}:{health_port}"},
        "metrics": {"bindAddress": "0"},
        "leaderElection": {"leaderElect": False},
        operator.certificates: {"enable": False},
    }


def _start(plane, operator, binaries, configuration):
    """Start a program; it ends at the latest with this process."""
    folder = plane.folder / operator.program
    certificates = folder / "k8s-webhook-server" / "serving-certs"  # where controller-runtime looks for them
    certificates.mkdir(parents=True)
    for kind in ("crt", "key"):
        (certificates / f"tls.{kind}").write_bytes((plane.folder / f"server.{kind}").read_bytes())
    (folder / "configuration.yaml").write_text(yaml.safe_dump(configuration))
    command = [str(binaries / operator.program), f"--config={folder / 'configuration.yaml'}"]
    kubeconfig = str(plane.kubeconfig_of(operator.user, ADMINISTRATORS))
    with (folder / "log").open("wb") as log:
        return subprocess.Popen(
            ["setpriv", "--pdeathsig", "KILL", "--", *command],
            env=os.environ | {"KUBECONFIG": kubeconfig, "TMPDIR": str(folder)},
            stdin=subprocess.DEVNULL,
            stdout=log,
            stderr=subprocess.STDOUT,
        )


def _webhooks(plane, operator, source, port):
    """Return an operator's webhook configurations, with the program's address instead of a Service."""
    authority = base64.b64encode(plane.authority.pair.certificate.read_bytes()).decode()
    found = list(yaml.safe_load_all((source / operator.webhooks).read_text()))
    for document in found:
        document["metadata"]["name"] = f"{operator.program}-{document['kind'].lower()}"
        for webhook in document["webhooks"]:
            path = webhook["clientConfig"]["service"]["path"]
            webhook["clientConfig"] = {"url": f"https://{LOOPBACK}:{port}{path}", "caBundle": authority}
            if webhook["rules"][0]["resources"] == ["pods"]:
                webhook["objectSelector"] = OF_A_JOB_SET
    return found


def _ready(port):
    with suppress(URLError, OSError):
        urllib.request.urlopen(f"http://{LOOPBACK}:{port}/readyz", timeout=2).close()
        return True
    return False
