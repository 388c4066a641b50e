"""A run on a claim gets a link with the name of its job; where links are impossible, the run trains."""

from __future__ import annotations

import errno
import os
from concurrent.futures import ThreadPoolExecutor

import pytest
from structlog.testing import capture_logs

from palaestra_trainer.job.run_directory import RunDirectory
from palaestra_trainer.run.tensorboard_link import link_curves

UID = "0d1f3e5a-7c2b-4d68-9a40-c3b2a1908f7e"
OTHER = "9b8c7d6e-7c2b-4d68-9a40-c3b2a1908f7e"


@pytest.fixture
def volume(tmp_path):
    """Return the folder of an empty claim."""
    path = tmp_path / "volume"
    path.mkdir()
    return path


@pytest.fixture
def start(volume, make_configuration):
    """Return a function that starts a replica on the claim, and returns its log lines."""

    def begin(uid=UID, replica=0):
        directory = RunDirectory(volume / uid / str(replica))
        directory.tensorboard.mkdir(parents=True, exist_ok=True)
        with capture_logs() as logs:
            link_curves(directory, make_configuration(uid=uid, replica=replica))
        return logs

    return begin


def shown(volume):
    """Return the links that TensorBoard finds, with their target folders."""
    links = (path for path in (volume / "tensorboard").rglob("*") if path.is_symlink())
    return {str(link.relative_to(volume / "tensorboard")): link.resolve() for link in links}


def test_a_run_on_a_claim_is_linked_under_the_name_of_its_job(play, job, volume):
    """The name of the run's folder is the UID of the job, and a UID means nothing to a person."""
    directory = RunDirectory(volume / UID / "0")

    assert play(job(uid=UID), into=directory)[0] == 0

    assert shown(volume) == {"corridor-0d1f3e5a/0": directory.tensorboard}
    assert any(directory.tensorboard.iterdir())


def test_the_link_holds_wherever_the_claim_is_mounted(start, volume):
    """TensorBoard mounts the claim at /runs, and the trainer mounts it at /var/lib/palaestra."""
    start()
    elsewhere = volume.rename(volume.with_name("runs"))

    assert shown(elsewhere) == {"corridor-0d1f3e5a/0": elsewhere / UID / "0" / "tensorboard"}


def test_jobs_of_one_name_and_their_replicas_are_distinguished(start, volume):
    """A job that was deleted and created again has a new UID."""
    for uid, replica in ((UID, 0), (UID, 1), (OTHER, 0)):
        assert start(uid, replica) == []

    assert sorted(shown(volume)) == ["corridor-0d1f3e5a/0", "corridor-0d1f3e5a/1", "corridor-9b8c7d6e/0"]


def test_replicas_that_start_at_once_are_all_linked(start, volume):
    """Each of these replicas may be the first that needs the folder."""
    with ThreadPoolExecutor(8) as threads:
        list(threads.map(start, [UID] * 8, range(8)))

    assert len(shown(volume)) == 8


def test_a_restart_leaves_the_link_as_it_is(start, volume):
    """TensorBoard may read the link at this moment, so a restart must not replace it."""
    start()
    made = os.lstat(volume / "tensorboard/corridor-0d1f3e5a/0")

    assert start() == []
    assert os.lstat(volume / "tensorboard/corridor-0d1f3e5a/0") == made


def test_a_link_that_leads_elsewhere_is_replaced(start, volume):
    """The name of the link has the UID of the job, so only the run of this job is its right target."""
    (volume / "tensorboard/corridor-0d1f3e5a").mkdir(parents=True)
    (volume / "tensorboard/corridor-0d1f3e5a/0").symlink_to("../../gone")

    assert start() == []
    assert shown(volume) == {"corridor-0d1f3e5a/0": volume / UID / "0" / "tensorboard"}


@pytest.mark.parametrize("make", ["write_text", "mkdir"])
def test_what_is_no_link_stays(start, volume, make):
    """A person may have put a file or a folder there."""
    place = volume / "tensorboard/corridor-0d1f3e5a/0"
    place.parent.mkdir(parents=True)
    {"write_text": lambda: place.write_text("mine"), "mkdir": place.mkdir}[make]()

    assert [line["link"] for line in start()] == ["tensorboard/corridor-0d1f3e5a/0"]
    assert place.exists()
    assert not place.is_symlink()


@pytest.mark.parametrize("replaced", ["tensorboard", "tensorboard/corridor-0d1f3e5a"])
def test_a_folder_that_another_job_replaced_by_a_link_is_not_followed(start, volume, tmp_path, replaced):
    """If the link were followed, the other job would decide where this trainer writes."""
    outside = tmp_path / "outside"
    outside.mkdir()
    (volume / replaced).parent.mkdir(exist_ok=True)
    (volume / replaced).symlink_to(outside)

    assert [line["event"] for line in start()] == ["run not linked for TensorBoard"]
    assert list(outside.iterdir()) == []


@pytest.mark.parametrize("number", [errno.EPERM, errno.ENOSYS, errno.EROFS, errno.EOPNOTSUPP])
def test_a_file_system_without_links_costs_one_warning(play, job, volume, monkeypatch, number):
    """SMB has no links, unless it is mounted with the option mfsymlinks."""

    def refuse(*_, **__):
        raise OSError(number, os.strerror(number))

    monkeypatch.setattr(os, "symlink", refuse)

    with capture_logs() as logs:
        code, _ = play(job(uid=UID), into=RunDirectory(volume / UID / "0"))

    [warning] = [line for line in logs if line["log_level"] == "warning"]
    assert code == 0
    assert warning["event"] == "run not linked for TensorBoard"
    assert os.strerror(number) in warning["error"]


def test_a_local_run_has_no_link(tmp_path, make_configuration):
    """A local run is at <dir>/<job>/<replica>, so the job's name is already in its path."""
    for uid in (UID, ""):
        directory = RunDirectory(tmp_path / "corridor" / "0")
        link_curves(directory, make_configuration(uid=uid))

    assert not any(tmp_path.rglob("tensorboard"))
