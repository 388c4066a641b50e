"""The README's examples match the project."""

import re
from pathlib import Path

import yaml

import palaestra.api
from tests.pages import blocks

ROOT = Path(__file__).parents[2]
README = (ROOT / "README.md").read_text()


def block(language):
    """Return the first block of a language."""
    return blocks(README, language)[0].removesuffix("\n")


def test_the_first_command_stands_within_25_lines():
    """A new reader decides in one screen."""
    lines = README.splitlines()

    assert any(line.startswith("make run") for line in lines[:25])
    assert len(lines) <= 120


def test_the_job_shown_is_the_minimal_example():
    """The tests of the examples run it too."""
    text = (ROOT / "manifests/examples/minimal.yaml").read_text().rstrip()

    assert block("yaml") == text
    palaestra.api.load(text, "minimal.yaml")


def test_the_script_shown_is_the_facade_example():
    """It has its own test."""
    script = (ROOT / "examples/facade.py").read_text()

    assert script.endswith(block("python") + "\n")


def test_what_is_typed_for_a_cluster_fits_together():
    """The order is cluster, operator, job and end: each line needs the results of those before it."""
    (shown,) = (block for block in blocks(README, "console") if block.startswith("make cluster "))
    cluster, operator, job, end = (line.partition("#")[0].split() for line in shown.splitlines())

    installed = {each["kind"] for each in yaml.safe_load_all((ROOT / operator[-1]).read_text())}
    trained = palaestra.api.load((ROOT / job[-1]).read_text(), job[-1])
    assert cluster == ["make", "cluster"]
    assert operator[:-1] == job[:-1] == ["kubectl", "apply", "-f"]
    assert {"CustomResourceDefinition", "Deployment"} <= installed
    assert end[:4] == ["kubectl", "wait", "--for=condition=Succeeded", f"tj/{trained.metadata.name}"]
    assert "\ncluster:" in (ROOT / "Makefile").read_text()


def test_every_verb_of_the_makefile_is_documented():
    """`make help` prints the text after `##`."""
    makefile = (ROOT / "Makefile").read_text()
    verbs = re.search(r"^\.PHONY: (.*)$", makefile, re.MULTILINE)[1].split()

    assert [verb for verb in verbs if not re.search(rf"^{verb}:.*## ", makefile, re.MULTILINE)] == []
