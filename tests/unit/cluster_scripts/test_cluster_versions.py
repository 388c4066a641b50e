"""All files of the test cluster name the same programs, versions, images and addresses."""

import ipaddress
import re
from pathlib import Path

import pytest

from tests.cluster import images
from tests.cluster.kueue import manager

CLUSTER = Path(images.__file__).parent
ROWS = [line.split() for line in (CLUSTER / "programs/list").read_text().splitlines() if line[0] != "#"]
MODULES = sorted({module for _, module, _ in ROWS if not (CLUSTER / "programs" / module / "debian").exists()})
BLOCK = ipaddress.ip_network("198.18.0.0/15")


def go_mod(module):
    """Return the text of a module's go.mod."""
    return (CLUSTER / "programs" / module / "go.mod").read_text()


def image_names(tmp_path):
    """Return the names of all images that a node is created with, without building them."""
    for folder in ("usr/lib/x86_64-linux-gnu/xtables", "usr/sbin"):
        (tmp_path / folder).mkdir(parents=True)
    kubernetes = images.version_of("kubernetes", "k8s.io/kubernetes")
    single = {image.name for image in images.single_programs(tmp_path)}
    return single | {images.PAUSE, images.HELPER, f"registry.k8s.io/kube-proxy:{kubernetes}"}


@pytest.mark.parametrize("module", MODULES)
def test_a_module_has_the_packages_of_the_list_as_its_tools(module):
    """`go mod tidy` keeps the dependencies of a `tool` line and removes all others."""
    text = go_mod(module)
    block = re.search(r"^tool \((.*?)^\)", text, re.MULTILINE | re.DOTALL)
    tools = set(block[1].split()) if block else set(re.findall(r"^tool (\S+)$", text, re.MULTILINE))

    assert tools == {package for _, its_module, package in ROWS if its_module == module}


def test_the_parts_of_kubernetes_are_all_of_one_release():
    """Staging modules of different releases compile together, but the programs fail at run time."""
    release = images.version_of("kubernetes", "k8s.io/kubernetes").removeprefix("v1.")

    replaced = re.findall(
        r"^\s*k8s\.io/(\S+) => k8s\.io/(\S+) v0\.(\S+)$", go_mod("kubernetes"), re.MULTILINE
    )

    assert len(replaced) == 33
    assert all(left == right and version == release for left, right, version in replaced)


def test_a_version_that_no_module_asks_for_is_an_error():
    """Without the error a misspelled module would give an image without a version."""
    with pytest.raises(LookupError, match=r"programs/etcd/go\.mod does not ask for example\.org/other"):
        images.version_of("etcd", "example.org/other")


def test_the_images_that_a_node_names_are_brought_along(tmp_path):
    """A node would try to pull an image of another version, and a node here cannot reach a registry."""
    node = "".join(path.read_text() for path in sorted((CLUSTER / "node").rglob("*")) if path.is_file())
    named = set(re.findall(r"(?:registry\.k8s\.io|palaestra\.dev)/[\w./-]+:v?\d[\w.-]*", node))

    assert len(named) == 3
    assert named <= image_names(tmp_path)


def test_kubeadm_is_configured_with_the_bundled_etcd(tmp_path):
    """By default kubeadm would use another version of etcd, which the node does not have."""
    tag = re.search(r"imageTag: ([\w.-]+)\}", (CLUSTER / "node/kind-patches.yaml").read_text())[1]

    assert f"registry.k8s.io/etcd:{tag}" in image_names(tmp_path)


def test_the_page_about_queues_installs_the_kueue_that_is_tested():
    """A user must not install a version of Kueue with which no test ran."""
    page = (CLUSTER.parents[1] / "docs/howto/queues.md").read_text()
    version = images.version_of("kueue", "sigs.k8s.io/kueue").removeprefix("v")

    assert re.findall(r"(?:--version|tested with Kueue) (\d+\.\d+\.\d+)", page) == [version, version]


def test_kueue_runs_as_nobody(tmp_path):
    """The security context of Kueue's chart refuses an image that runs as root."""
    image = manager(tmp_path / "kueue")

    assert image.name == f"registry.k8s.io/kueue/kueue:{images.version_of('kueue', 'sigs.k8s.io/kueue')}"
    assert image.user == "65532:65532"


def test_every_address_is_from_the_block_kept_for_benchmarks():
    """An address of a private network could be in use in the network of this machine."""
    text = "".join(
        path.read_text()
        for path in sorted(CLUSTER.rglob("*"))
        if path.suffix in {".sh", ".yaml", ".conflist"}
    )
    addresses = {ipaddress.ip_address(found) for found in re.findall(r"\b\d+\.\d+\.\d+\.\d+\b", text)}

    elsewhere = {a for a in addresses if a not in BLOCK and not a.is_loopback and not a.is_unspecified}
    assert len(addresses) > 5
    assert elsewhere == set()
