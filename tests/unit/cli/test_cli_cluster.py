"""The commands that use a cluster, as far as tests can check them without one."""

import pytest

from palaestra.cli import main

COMMANDS = [
    *("get", "describe", "watch", "logs", "events"),
    *("suspend", "resume", "restart", "delete", "fetch", "try", "doctor"),
]


@pytest.mark.parametrize("name", COMMANDS)
def test_help_says_what_is_read_and_how_it_ends(name, capsys):
    """Every command has kubectl's options that select a cluster, and its help lists the exit codes."""
    with pytest.raises(SystemExit) as ended:
        main([name, "--help"])

    out = " ".join(capsys.readouterr().out.split())
    assert ended.value.code == 0
    assert "--context" in out
    assert "--kubeconfig" in out
    assert "1 the cluster has no such job" in out


@pytest.mark.parametrize("name", COMMANDS)
def test_without_a_cluster_a_line_says_how_to_name_one(name, tmp_path, capsys):
    """A person must see one line with a remedy, not a library's traceback."""
    job = [] if name in {"get", "doctor"} else ["job"]

    code = main([name, *job, f"--kubeconfig={tmp_path}/none"])

    assert code == 2
    [line] = capsys.readouterr().err.splitlines()
    assert line.startswith(f"{tmp_path}/none: ")
    assert "--kubeconfig" in line


def test_a_context_that_is_not_there_is_named(tmp_path, capsys):
    """The message has the name of the context, so that a person can find the mistyped letter."""
    kubeconfig = tmp_path / "kubeconfig"
    kubeconfig.write_text(
        "{current-context: a, contexts: [{name: a, context: {cluster: c, user: u}}],"
        " clusters: [{name: c, cluster: {server: 'http://127.0.0.1:1'}}], users: [{name: u, user: {}}]}"
    )

    assert main(["get", f"--kubeconfig={kubeconfig}", "--context=b"]) == 2
    assert "b" in capsys.readouterr().err


@pytest.mark.parametrize("option", ["-n", "--namespace=lab", "--context", "--kubeconfig"])
def test_the_error_for_an_option_before_the_command_shows_where_it_goes(option, monkeypatch, capsys):
    """Users of kubectl write options before the command. Then argparse takes the namespace for a command."""
    monkeypatch.setattr("sys.argv", ["/usr/bin/kubectl-palaestra"])

    with pytest.raises(SystemExit) as ended:
        main([option, "lab", "get"])

    name = option.partition("=")[0]
    line = capsys.readouterr().err.splitlines()[-1]
    assert ended.value.code == 2
    assert line.endswith(f"{name}: must come after the command, as in `kubectl palaestra get {name} ...`")


@pytest.mark.parametrize(
    ("program", "shown"),
    [("kubectl-palaestra", "usage: kubectl palaestra"), ("palaestra", "usage: palaestra")],
)
def test_help_is_typed_as_it_was_called(program, shown, monkeypatch, capsys):
    """If kubectl runs the command as a plugin, users can paste the examples of its help."""
    monkeypatch.setattr("sys.argv", [f"/usr/bin/{program}"])

    with pytest.raises(SystemExit):
        main(["--help"])

    assert capsys.readouterr().out.startswith(shown)
