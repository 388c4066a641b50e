"""kubectl's kustomize builds the kustomize files of docs/howto/gitops.md."""

import subprocess
from pathlib import Path

import pytest
import yaml

from tests.control_plane.programs import programs
from tests.pages import blocks

PAGE = Path(__file__).parents[3] / "docs/howto/gitops.md"
JOB = """\
apiVersion: palaestra.dev/v1alpha1
kind: TrainingJob
metadata: {name: job}
spec:
  simulators:
  - {name: collect, role: Collect, world: {configMap: {name: worlds, key: hall.wbt}}}
  - name: evaluate
    role: Evaluate
    world: {configMap: {name: worlds, key: hall.wbt}}
    env: [{name: TOKEN, secretKeyRef: {name: keys, key: token}}]
  trainer: {env: [{name: TOKEN, secretKeyRef: {name: keys, key: token}}]}
  storage: {existingClaim: runs}
  imagePullSecrets: [{name: keys}]
"""
CLAIM = """\
apiVersion: v1
kind: PersistentVolumeClaim
metadata: {name: runs}
"""
MORE = {"secretGenerator": [{"name": "keys", "literals": ["token=x"]}], "namePrefix": "lab-"}


@pytest.fixture
def built(tmp_path):
    """Return the objects that kustomize builds, by kind.

    The fixture adds a Secret, a claim and a name prefix to the files of the page.
    """
    [references], [kustomization] = (
        blocks(PAGE.read_text(), f"yaml {name}") for name in ("references", "kustomization")
    )
    whole = yaml.safe_load(kustomization) | MORE
    whole["resources"] = [*whole["resources"], "claim.yaml"]
    files = {
        "references.yaml": references,
        "kustomization.yaml": yaml.safe_dump(whole),
        "job.yaml": JOB,
        "claim.yaml": CLAIM,
        "hall.wbt": "#VRML_SIM R2023b utf8\n",
    }
    for name, text in files.items():
        (tmp_path / name).write_text(text)
    kubectl = programs(("kubectl",)) / "kubectl"
    done = subprocess.run(
        [kubectl, "kustomize", tmp_path], capture_output=True, text=True, timeout=60, check=False
    )
    assert done.returncode == 0, done.stderr
    return {each["kind"]: each for each in yaml.safe_load_all(done.stdout)}


def test_names_that_kustomize_makes_reach_every_reference_of_a_job(built):
    """`kustomize` renames the ConfigMap `worlds` to a name such as `worlds-7h4fm2k9t6`.

    A job that still refers to `worlds` would wait for ever with the reason WorldMissing.
    """
    spec = built["TrainingJob"]["spec"]
    world, secret, claim = (
        built[kind]["metadata"]["name"] for kind in ("ConfigMap", "Secret", "PersistentVolumeClaim")
    )

    assert world.startswith("lab-worlds-")
    assert secret.startswith("lab-keys-")
    assert [each["world"]["configMap"]["name"] for each in spec["simulators"]] == [world, world]
    assert spec["simulators"][1]["env"][0]["secretKeyRef"]["name"] == secret
    assert spec["trainer"]["env"][0]["secretKeyRef"]["name"] == secret
    assert spec["imagePullSecrets"] == [{"name": secret}]
    assert spec["storage"]["existingClaim"] == claim == "lab-runs"


def test_a_world_that_kustomize_makes_is_open_to_jobs(built):
    """Without this label on the ConfigMap the operator would not start the job."""
    assert built["ConfigMap"]["metadata"]["labels"] == {"palaestra.dev/for-jobs": "true"}
