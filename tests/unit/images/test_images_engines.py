"""Docker builds the images if it can; if not, the reason is found before a build starts."""

import os
from pathlib import Path

import pytest

from tools.images import programs
from tools.images.engines import Docker, Order
from tools.images.errors import ImagesError

# A fake `docker` that logs every call. It succeeds for the commands in DOCKER_KNOWS; others exit with code 1.
DOCKER = """#!/bin/bash
echo "$@" >>"$DOCKER_CALLS"
for word in $DOCKER_KNOWS; do [[ $word == "$1" || $word == "$1-$2" ]] && known=yes; done
[[ ${known:-} ]] || exit 1
case "$1-$2" in
  image-inspect) echo sha256:abc ;;
  save-*) echo saved >"${2#--output=}" ;;
esac
"""
EVERYTHING = "version buildx-version buildx-build image-inspect pull save"


@pytest.fixture
def docker(tmp_path, monkeypatch):
    """Return a function that sets the commands that `docker` knows, and returns the file of its calls."""
    program, calls = tmp_path / "bin" / "docker", tmp_path / "calls"
    program.parent.mkdir()
    program.write_text(DOCKER)
    program.chmod(0o755)
    calls.touch()
    monkeypatch.setenv("PATH", f"{program.parent}:{os.environ['PATH']}")
    monkeypatch.setenv("DOCKER_CALLS", str(calls))

    def knows(words):
        monkeypatch.setenv("DOCKER_KNOWS", words)
        return calls

    return knows


@pytest.fixture
def order(tmp_path):
    """Return an order to build an image."""
    return Order(
        reference="docker.io/library/palaestra-stub:1.2.3",
        dockerfile=Path("/context/Dockerfile"),
        context=Path("/context"),
        arguments={"VERSION": "1.2.3"},
        archive=tmp_path / "stub.tar",
        log=tmp_path / "stub.log",
    )


@pytest.mark.parametrize("lacking", ["version", "buildx-version"])
def test_without_an_engine_or_buildx_there_is_no_docker(docker, lacking):
    """Many machines have only Docker's client, and an old engine cannot mount files during a build."""
    docker(" ".join(word for word in EVERYTHING.split() if word != lacking))

    assert Docker.here() is None


def test_without_a_base_image_to_be_had_there_is_no_docker(docker):
    """If the registry is unreachable, buildah must build, because it creates its own base image."""
    calls = docker("version buildx-version")

    assert Docker.here() is None
    assert "pull --quiet docker.io/library/debian:trixie-slim" in calls.read_text()


def test_a_base_image_that_is_there_is_not_pulled(docker):
    """A build must work without a network, and registries limit the number of pulls."""
    calls = docker(EVERYTHING)
    found = Docker.here()

    assert found is not None
    assert found.base().digest == "sha256:abc"
    assert "pull" not in calls.read_text()


def test_docker_builds_with_the_arguments_and_saves_the_archive(docker, order):
    """A Dockerfile gets the version and the packages of its image from these build arguments."""
    calls = docker(EVERYTHING)
    Docker.here().build(order)

    assert order.archive.read_text() == "saved\n"
    assert "--build-arg=VERSION=1.2.3 /context" in calls.read_text()


def test_docker_loads_what_another_image_is_built_from(docker, tmp_path):
    """In Docker, the name of the base may belong to an older image from another checkout."""
    calls = docker(f"{EVERYTHING} load")
    Docker.here().load(tmp_path / "trainer.tar", tmp_path / "load.log")

    assert f"load --input={tmp_path / 'trainer.tar'}" in calls.read_text()


def test_a_failed_build_leaves_no_archive(docker, order):
    """An archive that exists must be complete, because it is never built again."""
    docker(EVERYTHING)
    engine = Docker.here()
    docker("save")

    with pytest.raises(ImagesError, match=r"docker: ended with 1; its whole output is in .*stub\.log"):
        engine.build(order)
    assert not order.archive.exists()


def test_a_failure_shows_the_last_lines(tmp_path):
    """The user reads the cause in the terminal and need not open the log."""
    with pytest.raises(ImagesError, match=r"(?s)sh: ended with 3; .*\nline 99$"):
        programs.run(
            ["sh", "-c", "for i in $(seq 99); do echo line $i; done; exit 3"],
            log=tmp_path / "log",
            deadline_s=30,
        )


def test_a_program_that_takes_too_long_is_ended(tmp_path):
    """A build that hangs must fail at its deadline."""
    with pytest.raises(ImagesError, match=r"sleep: was not done after 0 s"):
        programs.run(["sleep", "60"], log=tmp_path / "log", deadline_s=0.2)
