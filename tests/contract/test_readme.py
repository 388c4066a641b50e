"""The examples in the README and on the first pages match the project."""

import re
from pathlib import Path

import yaml

import palaestra.api
from tests.pages import blocks

ROOT = Path(__file__).parents[2]
README = (ROOT / "README.md").read_text()
CLUSTER = (ROOT / "docs/start/cluster.md").read_text()
NOTEBOOK = (ROOT / "docs/start/notebook.md").read_text()
FIGURES = "".join((ROOT / f"docs/explain/{name}.md").read_text() for name in ("reliability", "tasks"))


# The format of `palaestra.local.progress_line`.
PROGRESS = re.compile(
    r"step [\d,]+ of [\d,]+ · \d+ % \(\d+ to \d+\) of \d+ episodes · \d+ steps/s · "
    r"\d+ faults? · \d+ (s|min) left"
)


def block(language):
    """Return the README's first block of a language."""
    return blocks(README, language)[0].removesuffix("\n")


def test_the_first_command_stands_within_25_lines():
    """A new reader decides within one screen whether to try the project."""
    lines = README.splitlines()

    assert any(line.startswith("make run") for line in lines[:25])
    assert len(lines) <= 120


def test_the_job_shown_is_the_minimal_example():
    """The tests of the examples run this job, so the README shows a job that works."""
    text = (ROOT / "manifests/examples/minimal.yaml").read_text().rstrip()

    assert block("yaml") == text
    palaestra.api.load(text, "minimal.yaml")


def test_the_script_for_a_notebook_is_the_facade_example():
    """The example has a test of its own, so the page shows a script that works."""
    [script] = blocks(NOTEBOOK, "python with-a-simulator")

    assert (ROOT / "examples/facade.py").read_text().endswith(script)


def test_the_lines_shown_are_of_words_that_the_programs_print():
    """The lines come from a real run, so the README must be renewed after an event is renamed."""
    folders = (ROOT / "trainer/src", ROOT / "operator/src")
    sources = "".join(path.read_text() for folder in folders for path in folder.rglob("*.py"))
    lines = block("text").splitlines()

    progress = [line for line in lines if line.startswith("step ")]
    events = [found[1] for line in lines if (found := re.match(r"warning: (.+?): ", line))]
    titles = [found[1] for line in lines if (found := re.match(r"  (\w[\w ]+?)  ", line))]

    assert [line for line in progress if not PROGRESS.fullmatch(line)] == []
    assert (len(progress), len(events), len(titles)) == (2, 1, 3)
    assert [words for words in (*events, *titles) if f'"{words}"' not in sources] == []


def test_every_figure_comes_with_the_command_that_measures_it():
    """A reader can repeat the measurement, and finds the same figure on the page about it."""
    bullets = re.findall(r"^- \*\*It .+`python -m (tests\.\w+ \w+)`$", README, re.MULTILINE)

    assert [command for command in bullets if f"`python -m {command}`" not in FIGURES] == []
    assert len(bullets) == 3
    assert [figure for figure in ("0.64 s", "0.07 s", "all 30") if figure not in FIGURES] == []
    assert "| 99 | 98 | 98 | 97 | 98 |" in FIGURES


def test_the_citation_names_the_paper_as_the_readme_does():
    """Tools read CITATION.cff and people read the README, so both must name the same paper."""
    cited = yaml.safe_load((ROOT / "CITATION.cff").read_text())
    paper = cited["preferred-citation"]
    chart = yaml.safe_load((ROOT / "charts/palaestra/Chart.yaml").read_text())

    assert f"*{paper['title']}* ({paper['year']})" in README
    assert [author["family-names"] for author in paper["authors"]] == ["Haubold", "Linke"]
    assert cited["version"] == chart["version"]


def test_what_is_typed_for_a_cluster_fits_together():
    """A reader types the lines in this order, and each line needs the results of the earlier ones."""
    (shown,) = (block for block in blocks(CLUSTER, "console") if block.startswith("make cluster "))
    cluster, operator, job, end = (line.partition("#")[0].split() for line in shown.splitlines())

    installed = {each["kind"] for each in yaml.safe_load_all((ROOT / operator[-1]).read_text())}
    trained = palaestra.api.load((ROOT / job[-1]).read_text(), job[-1])
    assert cluster == ["make", "cluster"]
    assert operator[:-1] == job[:-1] == ["kubectl", "apply", "-f"]
    assert {"CustomResourceDefinition", "Deployment"} <= installed
    assert end[:4] == ["kubectl", "wait", "--for=condition=Succeeded", f"tj/{trained.metadata.name}"]
    assert "\ncluster:" in (ROOT / "Makefile").read_text()


def test_every_verb_of_the_makefile_is_documented():
    """`make help` prints the text after `##`, so a target without the text would be missing there."""
    makefile = (ROOT / "Makefile").read_text()
    verbs = re.search(r"^\.PHONY: (.*)$", makefile, re.MULTILINE)[1].split()

    assert [verb for verb in verbs if not re.search(rf"^{verb}:.*## ", makefile, re.MULTILINE)] == []
