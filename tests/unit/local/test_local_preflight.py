"""`preflight` finds problems of a machine or a job before a run starts a process."""

import errno
import os
import zipfile

import pytest

from palaestra.api import validate
from palaestra.local import preflight
from palaestra.local.errors import RunRefused
from palaestra.local.preflight import PreflightRequest
from palaestra_protocol.package_archive import archived
from palaestra_protocol.policy_package import MANIFEST, manifest_text
from palaestra_sim.world import builtin
from tests.failing import failing

JOB = {"apiVersion": "palaestra.dev/v1alpha1", "kind": "TrainingJob", "metadata": {"name": "a"}}


@pytest.fixture
def request_for(tmp_path):
    """Return a function that returns a request to run a job with the given spec."""

    def make(**spec):
        return PreflightRequest(job=validate({**JOB, "spec": spec}), runs=tmp_path / "runs")

    return make


def collecting(**fields):
    """Return two groups of simulators; the first has the given fields."""
    first = {"name": "collect", "role": "Collect", **fields}
    return {"simulators": [first, {"name": "evaluate", "role": "Evaluate"}]}


def test_this_machine_can_run_the_minimal_job(request_for):
    """A false problem would keep every user from a first run.

    The checks must also leave no run directory behind.
    """
    request = request_for()

    preflight.check(request)

    assert not request.runs.exists()


def test_a_system_without_the_proc_of_linux_is_refused(request_for, monkeypatch, tmp_path):
    """Without /proc the run could not find and end the processes that a container leaves."""
    monkeypatch.setattr(preflight, "ENVIRONMENT", tmp_path / "environ")

    [problem] = preflight.processes_can_be_found(request_for())

    assert problem.startswith(f"{tmp_path}/environ: No such file or directory; run on Linux")


def test_a_module_that_shadows_another_is_named(request_for, monkeypatch, tmp_path):
    """A process of the pod gets the PYTHONPATH of the machine and that of the job."""
    for folder in ("machine", "job"):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "queue.py").touch()
    monkeypatch.setenv("PYTHONPATH", str(tmp_path / "machine"))
    own = {"name": "PYTHONPATH", "value": str(tmp_path / "job")}

    problems = sorted(preflight.no_module_is_shadowed(request_for(trainer={"env": [own]})))

    assert [problem.partition(":")[0] for problem in problems] == [
        f"{tmp_path}/job/queue.py",
        f"{tmp_path}/machine/queue.py",
    ]


def test_a_suspended_job_is_refused(request_for):
    """No program on this machine would ever resume the job."""
    [problem] = preflight.nothing_is_put_off(request_for(suspend=True))

    assert problem.startswith("spec.suspend: is true")


@pytest.mark.parametrize(
    ("spec", "problem"),
    [
        ({"trainer": {"command": ["no-such-program"]}}, "spec.trainer.command: no-such-program"),
        (collecting(driver="webots"), "spec.simulators[0]: webots is not a program"),
        (
            collecting(driver="command", image="a", command=["no-sim"]),
            "spec.simulators[0]: no-sim is not a program",
        ),
    ],
)
def test_a_program_that_does_not_exist_is_named_with_its_field(request_for, spec, problem, monkeypatch):
    """The message names the field, so the author of the job can correct it."""
    monkeypatch.setenv("PATH", "")

    assert any(each.startswith(problem) for each in preflight.programs_exist(request_for(**spec)))


def test_a_job_with_mujoco_runs_where_it_is_installed(request_for):
    """The development setup installs MuJoCo, so the check must find no problem."""
    assert not list(preflight.programs_exist(request_for(**collecting(driver="mujoco"))))


def test_the_error_for_a_missing_mujoco_names_the_package_and_the_extra(request_for, monkeypatch):
    """The program is always installed, but its library is an optional extra.

    Without this check the error would appear only in a simulator's log.
    """
    monkeypatch.setattr("importlib.util.find_spec", lambda _: None)

    [problem] = preflight.programs_exist(request_for(**collecting(driver="mujoco")))

    assert problem == (
        "spec.simulators[0]: palaestra-mujoco needs the Python package mujoco, which is not installed; "
        "install palaestra-sim[mujoco] (`make setup` does)"
    )


def test_the_error_for_a_missing_program_of_mujoco_names_the_package(request_for, monkeypatch, tmp_path):
    """An installation without the simulators' package lacks this program."""
    monkeypatch.setattr("palaestra.local.simulators.program_path", lambda: str(tmp_path))

    assert (
        "spec.simulators[0]: palaestra-mujoco is not a program on this machine; "
        "install palaestra-sim[mujoco] (`make setup` does)"
    ) in preflight.programs_exist(request_for(**collecting(driver="mujoco")))


def test_the_error_for_a_broken_world_file_has_line_and_column(request_for, tmp_path):
    """The sidecar would find the mistake too, but would report it only in a log."""
    world = tmp_path / "broken.wbt"
    world.write_text("#VRML_SIM R2023b utf8\nWorldInfo {\n  basicTimeStep [\n}\n")

    [problem] = preflight.worlds_are_right(request_for(**collecting(world={"file": str(world)})))

    assert problem.startswith(f"spec.simulators[0].world.file: {world}:")
    assert problem.split(f"{world}:")[1][0].isdigit()


def test_a_world_file_that_is_right_passes(request_for, tmp_path):
    """A correct world file must not be refused because of the files to which it refers."""
    world = tmp_path / "arena.wbt"
    world.write_bytes(builtin("arena"))

    assert not list(preflight.worlds_are_right(request_for(**collecting(world={"file": str(world)}))))


def test_the_error_for_a_missing_world_file_has_its_path(request_for):
    """The message also quotes the error of the operating system."""
    [problem] = preflight.worlds_are_right(request_for(**collecting(world={"file": "/no/such.wbt"})))

    assert "/no/such.wbt: No such file or directory" in problem


def test_a_world_without_an_end_is_refused(request_for, tmp_path):
    """A device without an end would fill the memory, and a pipe would block the check when it is opened."""
    device, pipe = tmp_path / "device.wbt", tmp_path / "pipe.wbt"
    device.symlink_to("/dev/zero")
    os.mkfifo(pipe)

    for path in (device, pipe):
        [problem] = preflight.worlds_are_right(request_for(**collecting(world={"file": str(path)})))
        assert f"{path}: is not a regular file; name a world" in problem


def test_a_root_that_does_not_hold_what_the_world_names_is_refused(request_for, tmp_path):
    """The sidecar would refuse the world only after the start, and would be restarted for a minute."""
    world = tmp_path / "lab" / "worlds" / "arm.xml"
    world.parent.mkdir(parents=True)
    (tmp_path / "arm.xml").write_text("<mujocoinclude/>")
    world.write_text('<mujoco><include file="../../arm.xml"/></mujoco>')
    group = collecting(world={"file": str(world), "root": str(tmp_path / "lab")})

    [problem] = preflight.worlds_are_right(request_for(**group))

    assert problem.startswith(
        f"spec.simulators[0].world.file: {world}:1:9: '../../arm.xml' leads to {tmp_path}"
    )


def test_a_nearly_full_disk_is_refused(request_for, monkeypatch):
    """The run would fail later, while it writes a checkpoint."""
    monkeypatch.setattr(preflight, "LEAST_FREE", 2**62)

    with pytest.raises(RunRefused, match=r"MiB are free, but a run needs .*--dir"):
        preflight.check(request_for())


def test_a_file_system_without_locks_is_refused(request_for, monkeypatch, tmp_path):
    """The check comes before the run directory is created, and leaves no file."""
    monkeypatch.setattr("fcntl.flock", failing(errno.ENOLCK))

    [problem] = preflight.locks_work(request_for())

    assert problem.startswith(f"{tmp_path}: the file system has no locks (No locks available)")
    assert problem.endswith("; choose a folder on a local disk with --dir")
    assert list(tmp_path.iterdir()) == []


def test_all_problems_are_reported_at_once(request_for, monkeypatch):
    """The author of a job can then correct all problems in one edit."""
    monkeypatch.setattr(preflight, "LEAST_FREE", 2**62)

    with pytest.raises(RunRefused) as refused:
        preflight.check(request_for(trainer={"command": ["no-such-program"]}))

    assert len(str(refused.value).splitlines()) == 2


def test_an_initial_policy_must_be_a_model_on_this_machine(request_for, tmp_path):
    """Like a wrong world, a wrong file is reported before a simulator starts."""

    def problems(path):
        return list(preflight.initial_policy_is_there(request_for(trainer={"initialPolicy": {"path": path}})))

    (tmp_path / "text.zip").write_text("no zip")
    with zipfile.ZipFile(tmp_path / "model.zip", "w") as archive:
        archive.writestr("policy.pth", b"")
    field = "spec.trainer.initialPolicy.path: "

    assert problems(f"{tmp_path}/none.zip") == [
        f"{field}{tmp_path}/none.zip: No such file or directory; name a model.zip"
    ]
    assert problems(f"{tmp_path}/text.zip") == [
        f"{field}{tmp_path}/text.zip: is not a model of Stable-Baselines3; name a model.zip"
    ]
    assert problems(f"{tmp_path}/model.zip") == []


def test_a_package_as_an_initial_policy_must_be_whole(request_for, tmp_path):
    """A job may name a package of another person as a zip."""
    place, model = tmp_path / "package.zip", {"model.zip": b"the model"}

    def problems(files):
        place.write_bytes(archived(files))
        wanted = request_for(trainer={"initialPolicy": {"path": str(place)}})
        return list(preflight.initial_policy_is_there(wanted))

    whole = problems(model | {MANIFEST: manifest_text({}, model)})
    [problem] = problems({"model.zip": b"another", MANIFEST: manifest_text({}, model)})

    assert whole == []
    assert "model.zip: is not the file that was exported; copy the whole package again" in problem


def test_an_initial_policy_may_be_gone_once_the_run_has_a_checkpoint(request_for):
    """The run resumes from its checkpoint and no longer needs the initial policy, which may be deleted."""
    request = request_for(trainer={"initialPolicy": {"path": "/deleted/model.zip"}})
    before = list(preflight.initial_policy_is_there(request))

    (request.runs / "a/0/checkpoints/100").mkdir(parents=True)

    assert len(before) == 1
    assert list(preflight.initial_policy_is_there(request)) == []
