"""The commands of `palaestra`: their input, their output and their exit codes."""

import os
import re
from pathlib import Path

import pytest
import yaml

from palaestra.cli import main
from palaestra_protocol.package_archive import archived
from palaestra_protocol.policy_package import MANIFEST, manifest_text
from palaestra_sim.world import builtin, robots

JOB = """\
apiVersion: palaestra.dev/v1alpha1
kind: TrainingJob
metadata:
  name: a
spec:
  replicas: 2
"""
WRONG = """\
apiVersion: palaestra.dev/v1alpha1
kind: TrainingJob
metadata:
  name: A
spec:
  seed: -1
  replica: 2
  simulators:
    - {name: collect, role: Collect}
    - {name: evaluate, role: Eval}
  trainer:
    steps: many
"""


@pytest.fixture
def job(tmp_path):
    """Return the path of a file with a valid job."""
    path = tmp_path / "job.yaml"
    path.write_text(JOB)
    return path


@pytest.fixture
def fails(capsys):
    """Return a function that runs a command, requires exit code 2, and returns the lines of stderr."""

    def run(*arguments):
        code = main([str(each) for each in arguments])
        out, err = capsys.readouterr()
        assert code == 2
        assert out == ""
        return err.splitlines()

    return run


@pytest.mark.parametrize("command", ["plan", "--help"])
def test_output_that_nobody_reads_is_no_error(command, job, monkeypatch, capsys):
    """A person who types `| head` has seen enough, and a traceback would say that something is broken."""
    reader, writer = os.pipe()
    os.close(reader)
    with os.fdopen(writer, "w") as output:
        monkeypatch.setattr("sys.stdout", output)
        assert main([command, str(job)]) == 0

    assert capsys.readouterr().err == ""


@pytest.mark.parametrize("command", ["plan", "--help"])
def test_output_on_a_full_disk_is_one_sentence(command, job, monkeypatch, capsys):
    """Without the error, a script would go on with half a file."""
    with Path("/dev/full").open("w") as output:
        monkeypatch.setattr("sys.stdout", output)
        assert main([command, str(job)]) == 1

    sentence = "standard output: No space left on device; free some space, or write to another disk\n"
    assert capsys.readouterr().err == sentence


@pytest.mark.parametrize("command", [["plan"], ["run"], ["sweep"], ["world", "--check"]])
@pytest.mark.parametrize("endless", [False, True], ids=["a disk image", "a device without end"])
def test_a_file_too_large_for_what_it_should_be_is_refused_by_its_size(fails, tmp_path, command, endless):
    """Before this limit, such a file filled the memory of a laptop before its content was checked."""
    file = tmp_path / "disk.img"
    if endless:
        file.symlink_to("/dev/zero")
    else:
        with file.open("wb") as image:
            image.truncate(2**30)

    [line] = fails(*command, file)

    assert re.fullmatch(
        rf"{file}: is larger than (8|64) MiB, the limit for such a file; name another file", line
    )


def test_text_of_others_gives_a_terminal_no_orders(fails, tmp_path):
    """A file name or a pod's message may have escape sequences that rename a window or hide lines."""
    [line] = fails("plan", tmp_path / "\x1b]0;mine\x07\x1b[2J.yaml")

    assert line.isprintable()


def test_plan_prints_the_objects_of_every_replica_for_kubectl(job, capsys):
    """`palaestra plan FILE | kubectl apply -f -` creates the objects that the operator would create."""
    assert main(["plan", str(job)]) == 0

    kinds = [each["kind"] for each in yaml.safe_load_all(capsys.readouterr().out)]
    assert kinds == ["NetworkPolicy", *["ConfigMap", "PersistentVolumeClaim", "Job"] * 2]


def test_plan_can_print_what_run_would_do_here(job, tmp_path, capsys):
    """A user can inspect the plan before `palaestra run` executes it on this machine."""
    main(["plan", str(job), "--layout", "local", "--dir", str(tmp_path)])

    assert f"value: {tmp_path}/a/1" in capsys.readouterr().out


def test_plan_quotes_text_that_kubectl_would_take_for_a_number(tmp_path, capsys):
    """Some YAML parsers read `5e-4` as a number and others as text."""
    path = tmp_path / "job.yaml"
    path.write_text(JOB + "  trainer: {env: [{name: RATE, value: '5e-4'}]}\n")

    main(["plan", str(path)])

    assert "value: '5e-4'" in capsys.readouterr().out


def test_world_prints_the_world_of_one_simulator(tmp_path, capsys):
    """The author of a world can see how the file that Webots reads differs from the original."""
    path = tmp_path / "my.wbt"
    path.write_bytes(builtin("arena"))

    main(["world", str(path), "--job", "j", "--replica", "3", "--group", "g", "--index", "1"])

    [robot] = robots(capsys.readouterr().out.encode())
    assert robot.ros_name.startswith("j_r3_g_1a_robotino_")


def test_world_puts_in_what_a_world_for_ros_lacks(tmp_path, capsys):
    """Most worlds with the `ros` controller lack both options.

    The command adds them and must not change the rest of the file.
    """
    path = tmp_path / "plain.wbt"
    path.write_text('#VRML_SIM R2023b utf8\nE-puck {\n  controller "ros"\n}\n')

    main(["world", str(path), "--job", "j", "--group", "g"])

    printed = capsys.readouterr().out
    [robot] = robots(printed.encode())
    assert robot.ros_name.startswith("j_r0_g_0a_E_puck_")
    assert printed == path.read_text().replace(
        "\n}", f'\n  controllerArgs [\n    "--name={robot.ros_name}"\n    "--synchronize"\n  ]\n}}'
    )


def test_world_points_at_the_place_of_a_mistake(tmp_path, fails):
    """The message has the line and the column, like a compiler's message."""
    path = tmp_path / "broken.wbt"
    path.write_text("#VRML_SIM R2023b utf8\nRobot { name [ }\n")

    [line] = fails("world", path, "--job", "j", "--group", "g")

    assert line.startswith(f"{path}:2:")


def test_world_refuses_a_world_without_a_robot_that_ros_drives(tmp_path, fails):
    """The command would change nothing in this world, and no trainer could drive its robot."""
    path = tmp_path / "silent.wbt"
    path.write_bytes(builtin("arena").replace(b'controller "ros"', b'controller "void"'))

    [line] = fails("world", path, "--job", "j", "--group", "g")

    assert line.startswith(f"{path}:")
    assert 'no robot has the controller "ros": there are "robotino" (controller "void"); set' in line


def test_world_without_a_job_is_refused(tmp_path, fails):
    """The ROS names of the robots contain the job's name, so only `--check` works without a job."""
    path = tmp_path / "my.wbt"
    path.write_bytes(builtin("arena"))

    [line] = fails("world", path, "--group", "g")

    assert line == "--job and --group: at least one of them is missing; give both, or use --check"


def test_world_can_be_checked_by_each_simulator(tmp_path, capsys):
    """The author of a world sees which simulators accept it, and need not start a simulator."""
    path = tmp_path / "my.wbt"
    path.write_bytes(builtin("arena"))
    assert main(["world", str(path), "--check"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == "stub: starts as it is"
    assert lines[1].startswith('  robot "robotino": controller "ros", omnidirectional drive on 3 wheels')
    assert lines[2] == "mujoco: starts as it is"
    assert lines[3].startswith('  robot "robotino": controller "ros", ')
    assert lines[4].startswith("webots: ")

    path.write_text("#VRML_SIM R2023b utf8\nColosseum { }\n")
    assert main(["world", str(path), "--check"]) == 2
    assert "  my.wbt:2:1: the stub simulates no Colosseum; left out" in capsys.readouterr().out.splitlines()


def test_mujoco_is_asked_only_where_it_is_installed(tmp_path, capsys, monkeypatch):
    """MuJoCo is an optional extra, so a world for the stub must be checked without it."""
    path = tmp_path / "my.wbt"
    path.write_bytes(builtin("arena"))
    monkeypatch.setattr("importlib.util.find_spec", lambda _: None)

    assert main(["world", str(path), "--check"]) == 0
    assert "mujoco:" not in capsys.readouterr().out


def test_a_simulator_that_is_not_installed_says_so(tmp_path, capsys, monkeypatch):
    """The operator's image has the command but no simulator."""
    path = tmp_path / "my.wbt"
    path.write_bytes(builtin("arena"))
    for module in ("simulators", "world_check"):
        monkeypatch.setattr(f"palaestra.local.{module}.program_path", lambda: str(tmp_path))

    assert main(["world", str(path), "--check"]) == 2
    assert "  palaestra-stub is not installed on this machine" in capsys.readouterr().out.splitlines()


def test_world_s_help_names_all_that_changes(capsys):
    """The author of a world compares the two files and expects only the changes that the help lists."""
    with pytest.raises(SystemExit) as ended:
        main(["world", "--help"])

    words = " ".join(capsys.readouterr().out.split())
    assert ended.value.code == 0
    assert 'Only the controllerArgs of robots whose controller is "ros" change' in words
    assert "--name= is set, --synchronize is added, and --clock is removed" in words


def test_crd_prints_a_custom_resource_definition(capsys):
    """A user can apply the definition of the installed release without a copy of the repository."""
    assert main(["crd"]) == 0

    crd = yaml.safe_load(capsys.readouterr().out)
    assert crd["metadata"]["name"] == "trainingjobs.palaestra.dev"


@pytest.mark.parametrize("command", ["run", "plan"])
def test_all_mistakes_of_a_wrong_job_are_printed(command, tmp_path, fails, monkeypatch):
    """A user can correct all five mistakes at once. The command starts and writes nothing."""
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "wrong.yaml"
    path.write_text(WRONG)

    lines = fails(command, path)

    assert len(lines) == 5
    assert any("spec.simulators[1].role" in line for line in lines)
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize(
    ("spec", "line"),
    [
        ("storage: {existingClaim: a, resumeFrom: b}", "spec.storage.resumeFrom: names a run on a claim"),
        ("suspend: true", "spec.suspend: is true"),
        ("trainer: {env: [{name: A, secretKeyRef: {name: b, key: c}}]}", "env A of container trainer: "),
    ],
)
def test_what_is_not_done_here_is_refused_before_anything_is_written(
    spec, line, tmp_path, fails, monkeypatch
):
    """The command creates no run directory and no lock.

    Even with `--fresh` the old run stays in its folder.
    """
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "job.yaml"
    path.write_text(f"{JOB}  {spec}\n")
    old = tmp_path / "runs" / "a" / "0"
    old.mkdir(parents=True)

    [told] = fails("run", path, "--fresh")

    assert told.startswith(line)
    assert sorted(tmp_path.rglob("*")) == [path, old.parents[1], old.parent, old]


def test_a_file_that_is_not_there_is_one_line(tmp_path, fails):
    """A typing error must not cause a traceback."""
    assert fails("run", tmp_path / "no.yaml") == [
        f"{tmp_path}/no.yaml: No such file or directory; name a readable file"
    ]


def test_a_file_that_is_no_text_is_one_line(tmp_path, fails):
    """A person may name a checkpoint instead of a job."""
    path = tmp_path / "model.zip"
    path.write_bytes(b"PK\xff\xfe")

    assert fails("plan", path) == [f"{path}: is not UTF-8; save it as UTF-8"]


def test_a_replica_that_the_job_does_not_have_is_refused(job, tmp_path, fails):
    """A user may count the replicas from 1, so the message shows the numbers that exist."""
    [line] = fails("run", job, "--replica", "2", "--dir", tmp_path / "runs")

    assert line == "--replica 2: the job has 2 replicas; use 0 to 1, or raise spec.replicas"


def test_an_operator_that_cannot_be_is_not_started(fails):
    """The command exits before it connects to a cluster."""
    told = "--metrics-address: '8080' is not an address; write it as 0.0.0.0:8080"
    assert fails("operator", "--metrics-address=8080") == [told]


A_KEY = "use a key such as example.com/team, or a domain such as example.com/"


@pytest.mark.parametrize(
    ("command", "wrong"),
    [
        ("run FILE --ros-port=65536", "--ros-port: 65536 is refused; give 1 to 65535"),
        ("run FILE --replica=-1", "--replica: -1 is refused; give 0 or more"),
        ("world FILE --job=a --group=collect --index=-1", "--index: -1 is refused; give 0 or more"),
        ("operator --workers=0", "--workers: 0 is refused; give 1 or more"),
        ("operator --resync=nan", "--resync: nan is refused; give a finite number"),
        ("operator --allow-pod-label=*", f"--allow-pod-label: '*' is not a key; {A_KEY}"),
        (
            "operator --allow-priority-class=High",
            "--allow-priority-class: 'High' is not the name of an object; use a-z, 0-9, '-' and '.'",
        ),
        (
            "operator --node-selector=gpu",
            "--node-selector: 'gpu' is not a label; use a label such as kubernetes.io/arch=amd64",
        ),
        ("try FILE --within=0", "--within: 0 is refused; give a number above 0"),
        ("delete a --timeout=soon", "--timeout: 'soon' is not a number"),
        ("logs a --tail=-3", "--tail: -3 is refused; give 0 or more"),
        ("fetch a --replica=1.5", "--replica: '1.5' is not a whole number"),
    ],
)
def test_what_cannot_be_meant_is_refused_where_it_is_typed(command, wrong, capsys):
    """FILE does not exist, so the error must come before the command reads a file or sends a request."""
    with pytest.raises(SystemExit) as ended:
        main(command.split())

    assert ended.value.code == 2
    assert capsys.readouterr().err.splitlines()[-1].endswith(f"error: argument {wrong}")


@pytest.mark.parametrize("option", ["--agent=zero", "--episodes=3", "--json"])
def test_what_is_tried_here_is_not_an_option_of_a_cluster(job, fails, option):
    """A person who forgets `--local` would otherwise start the trial in a cluster."""
    [line] = fails("try", job, option)

    assert line == "--agent, --episodes, --json: work only with --local; add --local, or remove them"


def test_a_simulator_of_ones_own_cannot_be_tried_here(job, fails):
    """The command starts nothing and prints one line, which contains the remedy."""
    job.write_text(
        JOB
        + "  simulators:\n"
        + "    - {name: collect, role: Collect, driver: command, command: [sim, '{world}'], image: sim:1}\n"
        + "  trainer: {evaluation: {everySteps: 0}}\n"
    )

    [line] = fails("try", "--local", job)

    assert line.startswith(
        "spec.simulators[0].driver: episodes cannot be tried with command; set stub, mujoco or webots"
    )


def test_an_operator_without_a_cluster_says_how_to_name_one(tmp_path, fails):
    """A person must see a message with a remedy, not a library's traceback."""
    [line] = fails("operator", f"--kubeconfig={tmp_path}/none", "--metrics-address=127.0.0.1:0")

    assert line.startswith(f"{tmp_path}/none: ")
    assert "--kubeconfig" in line


def test_the_first_help_has_the_exit_codes_of_all_commands(capsys):
    """The first help once listed only the exit codes of `run`, but commands such as `get` have others."""
    with pytest.raises(SystemExit):
        main(["--help"])

    out = " ".join(capsys.readouterr().out.split())
    assert "exit codes of all commands: 0 done 1 failed, or the cluster has no such job" in out
    assert "75 of `run` and `sweep`: interrupted after a checkpoint 80 of `run`, `compare` and" in out
    assert "`COMMAND --help` explains the exit codes of one command" in out


@pytest.mark.parametrize(
    "arguments", [["--version"], ["run", "--help"], ["plan", "--help"], ["operator", "--help"]]
)
def test_help_and_version_say_what_they_are(arguments, capsys):
    """`--version` prints the release, and every help ends with the exit codes."""
    with pytest.raises(SystemExit) as ended:
        main(arguments)

    assert ended.value.code == 0
    out = capsys.readouterr().out
    assert out.startswith("palaestra 0.") or "75   interrupted after a checkpoint" in out


def test_export_is_the_trainers_program_with_its_exit_code(tmp_path, capfd):
    """Only the trainer's program has PyTorch, so the command runs it and returns its exit code."""
    assert main(["export", str(tmp_path / "none"), "--to", "onnx"]) == 2

    out, err = capfd.readouterr()
    assert out == ""
    assert "none: does not exist; train first" in err


def test_export_without_the_trainer_is_refused(tmp_path, monkeypatch, capsys):
    """The operator's image has the command but not the trainer."""
    monkeypatch.setattr("palaestra.cli.export.PROGRAM", "palaestra-none")

    assert main(["export", str(tmp_path), "--to", "onnx"]) == 2

    assert "palaestra-none is not a program on this machine; install it" in capsys.readouterr().err


@pytest.mark.parametrize("name", ["package", "package.zip"])
def test_a_run_does_not_begin_with_a_damaged_package(job, tmp_path, capsys, name):
    """If one weight of the policy were wrong, the run would continue the training without an error."""
    package = tmp_path / name
    files = {"model.zip": b"another model", MANIFEST: manifest_text({}, {"model.zip": b"the model"})}
    if package.suffix:
        package.write_bytes(archived(files))
    else:
        package.mkdir()
        for file, content in files.items():
            (package / file).write_bytes(content)

    code = main(["run", str(job), "--dir", str(tmp_path / "runs"), "--initial-policy", str(package)])

    assert code == 2
    assert "model.zip: is not the file that was exported; copy the whole package" in capsys.readouterr().err
    assert not (tmp_path / "runs").exists()
