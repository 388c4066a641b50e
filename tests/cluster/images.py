"""Write the images of a node's own pods: the control plane, kube-proxy, CoreDNS and volumes.

python3 -m tests.cluster.images PROGRAMS TREE OUT writes one OCI archive per image into OUT. PROGRAMS is the
folder of built programs, and TREE is the node's Debian tree. The program uses only the standard library,
because it runs before any package is installed.
"""

from __future__ import annotations

import re
import subprocess
import sys
from itertools import chain
from pathlib import Path, PurePosixPath

from tests.cluster.archive import Image, write_archive

PAUSE = "registry.k8s.io/pause:3.10.2"
HELPER = "palaestra.dev/busybox:1.37.0"
# The program iptables reads its command from the name under which it is called.
IPTABLES = (
    "iptables",
    "iptables-save",
    "iptables-restore",
    "ip6tables",
    "ip6tables-save",
    "ip6tables-restore",
)
HELPER_COMMANDS = ("sh", "mkdir", "rm", "du")


def version_of(module: str, package: str) -> str:
    """Return the version of `package` in programs/`module`/go.mod, such as "v1.36.4".

    Raises:
        LookupError: the file does not require the package.
    """
    text = (Path(__file__).parent / "programs" / module / "go.mod").read_text(encoding="utf-8")
    found = re.search(rf"^(?:require|\s)\s*{re.escape(package)} (v\S+)", text, re.MULTILINE)
    if found is None:
        message = f"programs/{module}/go.mod does not ask for {package}."
        raise LookupError(message)
    return found[1]


def single_programs(programs: Path) -> list[Image]:
    """Return the images that each contain only one static program of `programs`."""
    kubernetes = version_of("kubernetes", "k8s.io/kubernetes")
    etcd = version_of("etcd", "go.etcd.io/etcd/server/v3").removeprefix("v")
    coredns = version_of("coredns", "github.com/coredns/coredns")
    volumes = version_of("local-path-provisioner", "github.com/rancher/local-path-provisioner")
    parts = ("kube-apiserver", "kube-controller-manager", "kube-scheduler")
    return [
        *(_single(f"registry.k8s.io/{part}:{kubernetes}", programs / part) for part in parts),
        _single(f"registry.k8s.io/etcd:{etcd}-0", programs / "etcd"),
        _single(f"registry.k8s.io/coredns/coredns:{coredns}", programs / "coredns", folder="/"),
        _single(f"palaestra.dev/local-path-provisioner:{volumes}", programs / "local-path-provisioner"),
    ]


def kube_proxy(programs: Path, tree: Path) -> Image:
    """Return kube-proxy's image, with iptables, nft and their libraries from `tree`."""
    extensions = sorted((tree / "usr/lib/x86_64-linux-gnu/xtables").glob("*.so"))
    called = [tree / "usr/sbin/xtables-nft-multi", tree / "usr/sbin/nft"]
    programs_and_extensions = [*called, *(path for path in extensions if not path.is_symlink())]
    files = {_place(path, tree): path for path in programs_and_extensions}
    # The libraries of the extensions (libm) are needed too: without them, Services with two endpoints
    # sometimes fail.
    for library in set(chain.from_iterable(_libraries(path, tree) for path in programs_and_extensions)):
        files[PurePosixPath(library.lstrip("/"))] = _resolved(library, tree)
    links = {_place(path, tree): str(path.readlink()) for path in extensions if path.is_symlink()}
    links |= {PurePosixPath("usr/sbin", name): "xtables-nft-multi" for name in IPTABLES}
    name = f"registry.k8s.io/kube-proxy:{version_of('kubernetes', 'k8s.io/kubernetes')}"
    files[PurePosixPath("usr/local/bin/kube-proxy")] = programs / "kube-proxy"
    return Image(name=name, entrypoint="/usr/local/bin/kube-proxy", files=files, links=links)


def helper(tree: Path) -> Image:
    """Return the image of the pods that create and remove the folders of volumes; it contains one busybox."""
    links = {PurePosixPath("bin", command): "busybox" for command in HELPER_COMMANDS}
    files = {PurePosixPath("bin/busybox"): tree / "usr/bin/busybox"}
    return Image(name=HELPER, entrypoint="/bin/sh", files=files, links=links)


def _single(name: str, program: Path, folder: str = "/usr/local/bin") -> Image:
    place = PurePosixPath(folder, program.name)
    return Image(name=name, entrypoint=str(place), files={place.relative_to("/"): program})


def _place(path: Path, tree: Path) -> PurePosixPath:
    return PurePosixPath(path.relative_to(tree))


def _libraries(path: Path, tree: Path) -> set[str]:
    command = ["chroot", str(tree), "ldd", f"/{_place(path, tree)}"]
    # For a static program, ldd exits with 1.
    listing = subprocess.run(command, check=False, capture_output=True, text=True).stdout
    return set(re.findall(r"(/\S+)", listing)) - {f"/{_place(path, tree)}:"}


def _resolved(library: str, tree: Path) -> Path:
    """Return the file in `tree` of a library's absolute path, with links resolved inside the tree."""
    command = ["chroot", str(tree), "realpath", library]
    inside = subprocess.run(command, check=True, capture_output=True, text=True).stdout.strip()
    return tree / inside.lstrip("/")


def main() -> None:
    """Write all images; the command line is in the module's docstring."""
    programs, tree, out = map(Path, sys.argv[1:])
    pause = _single(PAUSE, programs / "pause", folder="/")
    for image in (*single_programs(programs), kube_proxy(programs, tree), helper(tree), pause):
        write_archive(image, out / (image.name.rpartition("/")[2].replace(":", "-") + ".tar"))


if __name__ == "__main__":
    main()
