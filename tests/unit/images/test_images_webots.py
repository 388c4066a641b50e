"""The image of Webots is built from an archive that a user provides; the tests use one of the same layout."""

import hashlib
import os
import re
import shutil
import subprocess
import tarfile
import zipfile
from pathlib import Path

import pytest

from palaestra.plan import Images
from tests.fake_webots.home import make_home
from tools.images import webots
from tools.images.__main__ import main
from tools.images.errors import ImagesError

ROOT = Path(__file__).parents[3]
INSTALL, START = (ROOT / file for file in webots.RECIPE.files)
RELEASE = "R2025a"
NAME = f"webots-{RELEASE}-x86-64.tar.bz2"
ASSET = "0033b105637903b72be80210f36ad6d4efac8813"
PRINTS = '#!/bin/sh\necho "$DISPLAY" "$@"\n'
XVFB = """#!/bin/sh
echo "$@" >"$RECORD"
echo 7 >&3
"""


@pytest.fixture(scope="module")
def unpacked(tmp_path_factory):
    """Return a folder with the layout of a release, whose programs and library can be loaded."""
    if shutil.which("gcc") is None:
        pytest.skip("needs a compiler; `make test-packages` installs it")
    home = make_home(tmp_path_factory.mktemp("release"), RELEASE)
    program(home / "webots", PRINTS)
    (home / "bin").mkdir()
    shutil.copy("/bin/sh", home / "bin" / "webots-bin")
    return home


@pytest.fixture
def archive(unpacked, tmp_path):
    """Return a function that packs the release without some files, and with other texts in some files."""

    def pack(*without, **texts):
        home = tmp_path / "webots"
        shutil.copytree(unpacked, home)
        for name in without:
            (home / name).unlink()
        for name, text in texts.items():
            next(home.rglob(f"{name}.txt")).write_text(text)
        with tarfile.open(tmp_path / NAME, "w:bz2") as packed:
            packed.add(home, "webots")
        return tmp_path / NAME

    return pack


@pytest.fixture
def container(unpacked, tmp_path):
    """Return the environment of a container with the release, and with an X server that only records."""
    program(tmp_path / "bin" / "Xvfb", XVFB)
    return {
        "PATH": f"{tmp_path}/bin:{os.environ['PATH']}",
        "HOME": str(tmp_path / "home"),
        "RECORD": str(tmp_path / "record"),
        "WEBOTS_HOME": str(unpacked),
        "WEBOTS_ASSETS": str(tmp_path / "assets"),
    }


def program(path, text):
    """Write a program."""
    path.parent.mkdir(exist_ok=True)
    path.write_text(text)
    path.chmod(0o755)


def digest(file):
    """Return the SHA-256 of a file."""
    return hashlib.sha256(file.read_bytes()).hexdigest()


def install(archive, target, *assets, release=RELEASE, sha256=None):
    """Run the step of the Dockerfile that unpacks the archive."""
    return subprocess.run(
        [INSTALL, archive, sha256 or digest(archive), release, target, *assets],
        check=False,
        capture_output=True,
        text=True,
        timeout=60,
    )


def start(environment, *arguments):
    """Run the program `webots` of the image."""
    done = subprocess.run(
        [START, *arguments], env=environment, capture_output=True, text=True, check=True, timeout=30
    )
    return done.stdout.strip()


def test_a_release_is_unpacked_into_its_folder(archive, tmp_path):
    """The archive has one folder `webots`, whose contents become WEBOTS_HOME."""
    done = install(archive(), tmp_path / "home")

    assert (done.returncode, done.stderr) == (0, "")
    assert (tmp_path / "home/resources/version.txt").read_text() == f"{RELEASE}\n"
    assert (tmp_path / "home/lib/controller/libController.so").is_file()


@pytest.mark.parametrize("version", [f"{RELEASE} revision 1\n", f"{RELEASE}\nmore"])
def test_a_revision_of_the_release_is_accepted(archive, tmp_path, version):
    """An archive may have the name of the release although it contains a revision of this release."""
    assert install(archive(version=version), tmp_path / "home").returncode == 0


def test_another_digest_is_refused(archive, tmp_path):
    """An incomplete download must not become an image."""
    done = install(archive(), tmp_path / "home", sha256="0" * 64)

    assert done.returncode == 1
    assert "does not have the SHA-256" in done.stderr
    assert not (tmp_path / "home").exists()


def test_another_release_is_refused(archive, tmp_path):
    """A renamed archive would give an image whose tag names the wrong release."""
    done = install(archive(), tmp_path / "home", release="R2023b")

    assert "is Webots R2025a, not R2023b; give the archive of R2023b" in done.stderr
    assert done.returncode == 1


@pytest.mark.parametrize(
    ("missing", "message"),
    [
        ("resources/version.txt", "has no webots/resources/version.txt"),
        ("bin/webots-bin", "has no program webots/bin/webots-bin"),
        ("webots", "has no program webots/webots"),
        ("lib/controller/libController.so", "libController.so: cannot be loaded"),
    ],
)
def test_an_archive_without_a_part_of_webots_is_refused(archive, tmp_path, missing, message):
    """The release has other archives, such as the assets, which look alike."""
    done = install(archive(missing), tmp_path / "home")

    assert message in done.stderr
    assert done.returncode == 1


def test_a_missing_shared_library_is_named(archive, tmp_path):
    """If the build accepted the image, Webots would fail only in a cluster, at the first start."""
    source = tmp_path / "lacking.c"
    source.write_text("int lacking(void) { return 0; }\n")
    lacking, binary = tmp_path / "liblacking.so", tmp_path / "binary.c"
    binary.write_text("int lacking(void);\nint main(void) { return lacking(); }\n")
    subprocess.run(["gcc", "-shared", "-fPIC", "-o", lacking, source], check=True)
    packed = archive()
    subprocess.run(["gcc", "-o", tmp_path / "webots/bin/webots-bin", binary, lacking], check=True)
    lacking.unlink()
    with tarfile.open(packed, "w:bz2") as again:
        again.add(tmp_path / "webots", "webots")

    done = install(packed, tmp_path / "home")

    assert re.search(r"webots-bin: needs \S*liblacking\.so, which the image lacks", done.stderr)
    assert done.returncode == 1


@pytest.mark.parametrize("folder", ["", "assets/"])
def test_assets_are_unpacked_without_their_folder(archive, tmp_path, folder):
    """Webots looks for the files in its cache, and not in a subfolder `assets` of the archive."""
    packed = tmp_path / "assets.zip"
    with zipfile.ZipFile(packed, "w") as assets:
        assets.writestr(f"{folder}{ASSET}", "asset")

    done = install(archive(), tmp_path / "home", packed, digest(packed), tmp_path / "cache")

    assert (done.returncode, done.stderr) == (0, "")
    assert (tmp_path / "cache" / ASSET).read_text() == "asset"


def test_webots_gets_an_x_server_and_its_arguments(container):
    """Webots does not start without an X server, even if it shows no window."""
    assert start(container, "--batch", "world.wbt") == ":7 --batch world.wbt"
    assert "-displayfd 3" in Path(container["RECORD"]).read_text()


def test_an_x_server_of_the_user_is_used(container):
    """A server with a graphics card has an X server that renders faster."""
    assert start({**container, "DISPLAY": ":1"}) == ":1"
    assert not Path(container["RECORD"]).exists()


def test_an_x_server_that_does_not_start_is_an_error(container, tmp_path):
    """Without this check, Webots would wait for a display, or print many lines of Qt."""
    program(tmp_path / "bin" / "Xvfb", '#!/bin/sh\necho "no space" >&2\nexit 1\n')

    done = subprocess.run([START], check=False, env=container, capture_output=True, text=True, timeout=30)

    assert done.returncode == 1
    assert done.stderr.startswith("webots: Xvfb did not start: no space; set DISPLAY")


def test_webots_finds_the_assets_of_the_image(container, tmp_path):
    """In a pod the home folder is an empty volume, so the program links the assets into Webots' cache."""
    (tmp_path / "assets").mkdir()
    (tmp_path / "assets" / ASSET).write_text("asset")

    start(container)
    start(container)

    cache = tmp_path / "home/.cache/Cyberbotics/Webots"
    assert (cache / "assets" / ASSET).read_text() == "asset"
    (cache / "assets" / "new").write_text("a file of the network")
    assert [path.name for path in cache.iterdir()] == ["assets"]


def test_preferences_of_the_user_stay(container, tmp_path):
    """A user may mount preferences, for example with other shadows."""
    start(container)
    preferences = tmp_path / f"home/.config/Cyberbotics/Webots-{RELEASE}.conf"
    assert "cacheSize=8192" in preferences.read_text()
    preferences.write_text("[OpenGL]\n")

    start(container)

    assert preferences.read_text() == "[OpenGL]\n"


def test_the_recipe_has_release_and_digests_of_the_archives(tmp_path):
    """The Dockerfile checks both. A builder with a cache notices a new archive by the changed digest."""
    archive, assets = tmp_path / "webots-R2023b-x86-64_ubuntu-22.04.tar.bz2", tmp_path / "assets.zip"
    archive.write_bytes(b"archive")
    assets.write_bytes(b"assets")

    recipe = webots.of_archive(archive, assets, digest(archive).upper(), "x86_64")

    assert recipe.arguments == {
        "WEBOTS": "R2023b",
        "WEBOTS_SHA256": digest(archive),
        "ASSETS_SHA256": digest(assets),
    }
    assert recipe.given == {"webots.tar.bz2": archive, "assets.zip": assets}


@pytest.mark.parametrize(
    ("name", "sha256", "machine", "message"),
    [
        ("webots.tar.bz2", None, "x86_64", "is not the name of an archive of Webots"),
        (NAME, "1" * 64, "x86_64", "has the SHA-256"),
        (NAME, None, "aarch64", "is built for x86_64 only"),
        ("webots-R2024a-x86-64.tar.bz2", None, "x86_64", "No such file or directory; give a file"),
    ],
)
def test_a_wrong_archive_is_refused_before_the_build(tmp_path, name, sha256, machine, message):
    """A build takes minutes, and a message inside its log is hard to find."""
    for made in ("webots.tar.bz2", NAME):
        (tmp_path / made).write_bytes(b"archive")

    with pytest.raises(ImagesError, match=message):
        webots.of_archive(tmp_path / name, None, sha256, machine)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--webots-sha256", "0" * 64], "need --webots ARCHIVE"),
        (["stub", "webots"], "webots: needs the archive of Webots; replace the name with --webots ARCHIVE"),
    ],
)
def test_webots_without_an_archive_is_refused(capsys, arguments, message):
    """Without an error, the command would end successfully and the image of Webots would be missing."""
    with pytest.raises(SystemExit):
        main(arguments)

    assert message in capsys.readouterr().err


def test_the_image_has_the_name_that_a_job_may_give():
    """A job of Webots names an image, so the built image must have the name that this project documents."""
    assert webots.RECIPE.reference("1.2.3") == f"docker.io/library/{Images.of_release('1.2.3').webots}"
