"""The commands against a real API server, as a user types them."""

import json
import os
import subprocess
import sys
from contextlib import suppress

import pytest
import yaml

from palaestra.cli import main
from palaestra.cluster.resources import TRAINING_JOBS

TRIAL = """\
apiVersion: palaestra.dev/v1alpha1
kind: TrainingJob
metadata: {name: trial}
spec:
  backoffLimit: 0
"""
REPLICA = {
    "index": 0,
    "phase": "Running",
    "step": 12000,
    "target": 50000,
    "reason": "Training",
    "message": "the trainer runs",
}


def test_get_lists_with_the_columns_of_the_definition(typed, place, tell):
    """A user who knows `kubectl get tj` must find the same columns."""
    place.train("a")
    place.train("b")
    tell("b", "Running", step=12000)

    code, [headings, *rows], [unseen] = typed("get")

    assert code == 0
    assert unseen.startswith(
        "a: no operator has reconciled it; check that the operator runs and watches this"
    )
    assert headings.split()[:6] == ["NAME", "STATUS", "REASON", "REPLICAS", "STEP", "TARGET"]
    assert [row.split()[:5] for row in rows] == [["a", *"----"], ["b", "Running", "Because", "-", "12000"]]
    assert "ALGORITHM" in typed("get", "-o", "wide")[1][0]


def test_describe_and_watch_take_a_job_whose_name_the_api_server_made(typed, place, tell):
    """`kubectl create` leaves generateName in the object, which the commands must accept."""
    made = place.create(TRAINING_JOBS, {**yaml.safe_load(TRIAL), "metadata": {"generateName": "try-"}})
    name = made["metadata"]["name"]
    tell(name, "Succeeded")

    described, watched = typed("describe", name), typed("watch", name)

    assert (described[0], watched[0]) == (0, 0), (described, watched)
    assert name in described[1][0]


def test_get_of_all_namespaces_names_them(typed, place):
    """A user expects the namespaces in the first column, as with kubectl."""
    place.train("a")

    _, [headings, *rows], _ = typed("get", "-A")

    assert headings.startswith("NAMESPACE")
    assert [row.split()[1] for row in rows if row.startswith(f"{place.name} ")] == ["a"]


def test_get_without_jobs_says_so_instead_of_headings_alone(typed, place):
    """The message goes to standard error, so that a script which counts lines counts zero."""
    assert typed("get") == (0, [], [f"no TrainingJobs in namespace {place.name}"])
    assert typed("get", "-l", "a=b") == (
        0,
        [],
        [f"no TrainingJobs with labels a=b in namespace {place.name}"],
    )


@pytest.mark.parametrize("form", [(), ("-o", "json")])
def test_get_in_a_namespace_that_does_not_exist_says_so(control_plane, capsys, form):
    """With only an empty list, a user would not notice a misspelled namespace."""
    code = main(["get", *form, f"--kubeconfig={control_plane.kubeconfig}", "--namespace=nosuch"])

    out, err = capsys.readouterr()
    assert (code, out) == (1, "")
    assert err.startswith("namespace nosuch: does not exist; ")


@pytest.mark.parametrize("name", [(), ("a",)])
def test_get_for_programs_is_what_the_api_server_has(typed, place, name):
    """The output for one job is a single object, so that a user can apply it elsewhere."""
    place.train("a", seed=7)

    names = typed("get", *name, "-o", "name")[1]
    from_json = json.loads("\n".join(typed("get", *name, "-o", "json")[1]))
    [from_yaml] = yaml.safe_load_all("\n".join(typed("get", *name, "-o", "yaml")[1]))

    assert names == ["trainingjob.palaestra.dev/a"]
    assert (from_json if name else from_json["items"][0])["spec"]["seed"] == 7
    assert from_yaml["metadata"]["name"] == "a"


@pytest.mark.parametrize(
    "command", ["get", "describe", "events", "logs", "watch", "suspend", "delete", "fetch"]
)
def test_a_job_that_is_not_there_is_one_line_and_1(typed, command):
    """A user reads one line, and a script uses the exit code."""
    code, out, [line] = typed(command, "none")

    assert code == 1
    assert out == []
    assert line.startswith("job none: does not exist in namespace ")


def test_options_that_exclude_each_other_are_2(typed):
    """The command must report the mistake before it sends a request."""
    code, _, [line] = typed("get", "a", "-A")

    assert code == 2
    assert line == "NAME: cannot be combined with -A or -l; remove NAME or the options"


def test_describe_tells_status_and_events(typed, place, tell):
    """A user runs one command to see everything about a job."""
    place.train("a")
    tell("a", "Running", replicas=[REPLICA])
    place.complain({"metadata": {"name": "a-0-x7k2p", "uid": "u"}}, "BackOff", "no such image")

    code, out, _ = typed("describe", "a")

    assert code == 0
    assert "Step:   12,000 of 50,000 (24%)" in " ".join(out)
    assert "no such image" in out[-1]


@pytest.mark.parametrize(("phase", "code"), [("Succeeded", 0), ("Failed", 1)])
def test_watch_ends_with_the_job_and_says_how(typed, place, tell, phase, code):
    """A script uses the exit code to decide whether the training succeeded."""
    place.train("a")
    tell("a", phase, replicas=[REPLICA | {"phase": phase}])

    ended, out, _ = typed("watch", "a")

    assert ended == code
    assert out == [f"{phase}; 0: {phase} 12,000 of 50,000 (24%)", f"a: {phase}; Because: so it is"]


@pytest.mark.parametrize("phase", [None, "Running"])
def test_watch_of_a_job_that_is_deleted_says_so_and_ends_with_1(control_plane, place, tell, phase):
    """The result of a deleted job is unknown, so a script must not take it as a success."""
    place.train("a")
    if phase:
        tell("a", phase, replicas=[REPLICA])

    with started(control_plane, place, "watch", "a", "--timeout=30") as process:
        process.stdout.readline()  # wait until the command has seen the job
        place.api.delete(TRAINING_JOBS, place.name, "a")
        out, _ = process.communicate(timeout=30)

    assert process.returncode == 1
    assert out == "a: was deleted\n"


def test_a_trial_that_is_stopped_leaves_nothing(control_plane, place, tmp_path):
    """Kubelets and Helm end a pod with SIGTERM, and the job of the trial must not stay."""
    file = tmp_path / "job.yaml"
    file.write_text(TRIAL)

    with started(control_plane, place, "try", str(file)) as process:
        line = process.stdout.readline()
        [job] = place.all(TRAINING_JOBS)
        process.terminate()
        process.communicate(timeout=30)

    assert line == f"{place.name}/{job['metadata']['name']}: Pending\n"
    assert process.returncode == 130
    assert place.all(TRAINING_JOBS) == []


def test_a_trial_of_a_wrong_file_asks_nothing(typed, place, tmp_path):
    """A wrong file must create no job in the cluster.

    As for every mistake in a command line, the exit code is 2.
    """
    file = tmp_path / "job.yaml"
    file.write_text(TRIAL + "  seed: -1\n")

    code, out, [line] = typed("try", str(file))

    assert (code, out) == (2, [])
    assert line.startswith("spec.seed: ")
    assert place.all(TRAINING_JOBS) == []


def started(control_plane, place, *arguments):
    """Start a command in a separate process; the test reads its output while it runs."""
    return subprocess.Popen(
        [
            *(sys.executable, "-c", "import sys; from palaestra.cli import main; sys.exit(main())"),
            *(*arguments, f"--kubeconfig={control_plane.kubeconfig}", f"--namespace={place.name}"),
        ],
        stdout=subprocess.PIPE,
        text=True,
    )


def test_watch_draws_where_there_is_a_terminal(control_plane, place, tell):
    """On a terminal a user sees a picture that changes.

    The last picture stays on the screen, followed by the line about the end of the job.
    """
    place.train("a")
    tell("a", "Succeeded", replicas=[REPLICA | {"successRate": 0.5}])
    ours, theirs = os.openpty()

    with subprocess.Popen(
        [
            *(sys.executable, "-c", "import sys; from palaestra.cli import main; sys.exit(main())"),
            *("watch", "a", f"--kubeconfig={control_plane.kubeconfig}", f"--namespace={place.name}"),
        ],
        stdout=theirs,
        stderr=theirs,
        env={"TERM": "xterm", "COLUMNS": "80", "LINES": "24"},
    ) as process:
        os.close(theirs)
        seen = b""
        with suppress(OSError):  # EIO: the other end is closed
            while part := os.read(ours, 4096):
                seen += part
        code = process.wait(30)
    os.close(ours)

    text = seen.decode()
    assert code == 0, text
    assert "12,000 of 50,000 (24%)" in text
    assert "success" in text
    assert text.rstrip().endswith("a: Succeeded; Because: so it is")


def test_suspend_and_resume_change_the_spec(typed, place):
    """The operator acts on the spec of a job.

    As with kubectl, a user may name several jobs in one command.
    """
    for name in ("a", "b"):
        place.train(name)

    assert typed("suspend", "a", "b")[0] == 0
    suspended = [place.get(TRAINING_JOBS, name)["spec"]["suspend"] for name in ("a", "b")]
    assert typed("resume", "a")[0] == 0

    assert suspended == [True, True]
    assert place.get(TRAINING_JOBS, "a")["spec"]["suspend"] is False


@pytest.mark.parametrize("command", ["suspend", "resume"])
def test_suspending_a_job_with_a_queue_says_that_kueue_decides_and_how_to_stop_it(typed, place, command):
    """`Invalid (422)` would look like a mistake in the job, and only Kueue can resume this job."""
    place.train("a", scheduling={"queueName": "robots"})

    code, out, [line] = typed(command, "a")

    assert (code, out) == (1, [])
    assert line.startswith("job a: Kueue decides when it runs, because it is in queue robots; ")
    assert f"`kubectl get workloads -n {place.name}`" in line


@pytest.mark.parametrize("command", ["suspend", "resume"])
def test_a_job_that_has_ended_is_neither_suspended_nor_resumed(typed, place, tell, command):
    """An ended job never becomes Suspended. A user's `kubectl wait` for that condition would last forever."""
    place.train("a")
    tell("a", "Succeeded")

    code, out, [line] = typed(command, "a")

    assert (code, out) == (1, [])
    assert line.startswith("job a: has ended (Succeeded), so it cannot be ")
    assert not place.get(TRAINING_JOBS, "a")["spec"].get("suspend")


def test_restart_refuses_a_job_that_has_lost_nothing(typed, place, tell):
    """A request that stays in the job would restart the run at a later loss, without the user's consent."""
    place.train("a")
    tell("a", "Running", replicas=[REPLICA])

    code, out, [line] = typed("restart", "a")

    assert (code, out) == (1, [])
    assert line.startswith("job a: no replica has the reason RunLost, so no run is restarted; ")
    assert "annotations" not in place.get(TRAINING_JOBS, "a")["metadata"]


def test_delete_says_what_stays(typed, place):
    """The results of a run may be valuable, so the user must learn that its claim still exists."""
    uid = place.train("a")["metadata"]["uid"]
    place.train("b", storage={"ephemeral": True})

    code, [of_a, of_b], _ = typed("delete", "a", "b")

    assert code == 0
    assert of_a.endswith(f"`kubectl delete pvc -n {place.name} -l palaestra.dev/job-uid={uid}` deletes them")
    assert of_b == "b: deleted"
    assert place.all(TRAINING_JOBS) == []


def test_kubectl_finds_the_plugin_and_hands_it_its_options(control_plane, place, tmp_path):
    """With the plugin, a user types `kubectl palaestra get` with the options of `palaestra get`."""
    place.train("a")
    plugin = tmp_path / "kubectl-palaestra"
    program = tmp_path / "program.py"
    program.write_text("import sys\nfrom palaestra.cli import main\nsys.exit(main())\n")
    plugin.write_text(f'#!/bin/sh\nexec "{sys.executable}" "{program}" "$@"\n')
    plugin.chmod(0o755)

    done = subprocess.run(
        [control_plane.binaries / "kubectl", "palaestra", "get", "-o", "name", f"--namespace={place.name}"],
        env={"KUBECONFIG": str(control_plane.kubeconfig), "PATH": str(tmp_path)},
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )

    assert (done.returncode, done.stdout) == (0, "trainingjob.palaestra.dev/a\n"), done.stderr
