"""Files to which a world's nodes refer: only regular files inside the world's project are read."""

import os

import pytest

from palaestra_sim.world.project_files import ProjectFiles
from palaestra_sim.world.source import Source

WORLD = b"#VRML_SIM R2023b utf8\n"


@pytest.fixture
def project(tmp_path):
    """Return the folder of a world in a project, with a file in that folder and a file next to it."""
    folder = tmp_path / "football" / "worlds"
    (folder / "textures").mkdir(parents=True)
    (folder / "textures" / "line.png").write_bytes(b"line")
    (folder.parent / "field.png").write_bytes(b"field")
    (tmp_path / "secret.png").write_bytes(b"secret")
    (folder / "w.wbt").write_bytes(WORLD)
    return folder


def read(folder, address, namer=None):
    """Return the bytes of a file to which the world, or another file, refers."""
    files = ProjectFiles(folder / "w.wbt", WORLD)
    return files.read(namer or Source(data=WORLD, name="w.wbt"), address)


def test_an_address_counts_from_the_folder_of_the_world(project):
    """The project is the parent of that folder, so `..` is still inside."""
    assert read(project, "textures/line.png") == b"line"
    assert read(project, "../field.png") == b"field"


def test_an_address_in_a_proto_counts_from_the_file_of_the_proto(project):
    """Webots searches relative to the PROTO too, wherever the world is."""
    proto = Source(data=b"", name=str(project.parent / "protos" / "Field.proto"), kind="PROTO")

    assert read(project, "../worlds/textures/line.png", proto) == b"line"


@pytest.mark.parametrize(
    "address",
    [
        "../../secret.png",
        "textures/../../../secret.png",
        "/etc/hostname",
        "https://example.com/a.png",
        "a\0b",
    ],
)
def test_a_file_outside_of_the_project_is_not_read(project, address):
    """A world from the internet must not read other files of the pod."""
    with pytest.raises(OSError, match=r"outside|not a path"):
        read(project, address)


def test_the_whole_file_system_is_no_project(project):
    """Without this rule, a world with enough `../` in an address would make `/` its project."""
    climbing = "../" * len(project.parts) + "etc/hostname"
    world = WORLD + f'ImageTexture {{ url "{climbing}" }}'.encode()
    files = ProjectFiles(project / "w.wbt", world)

    with pytest.raises(OSError, match="outside"):
        files.read(Source(data=world, name="w.wbt"), climbing)


def test_a_link_that_leads_out_of_the_project_is_not_followed(project, tmp_path):
    """Both a link to a file and a link to a folder may lead outside."""
    (project / "textures" / "other.png").symlink_to(tmp_path / "secret.png")
    (project / "up").symlink_to("../..")

    for address in ("textures/other.png", "up/secret.png"):
        with pytest.raises(OSError, match="outside"):
            read(project, address)


def test_what_is_no_regular_file_is_not_read(project):
    """Opening a pipe would block for ever."""
    os.mkfifo(project / "pipe.png")

    for address in ("pipe.png", "textures"):
        with pytest.raises(OSError, match="not a regular file"):
            read(project, address)


def test_the_links_of_a_generated_world_lead_to_the_source_project(project, tmp_path):
    """The sidecar links files of the source project into the folder of a generated world.

    A link from the source project to another place is not followed.
    """
    generated = tmp_path / "work" / "project" / "worlds"
    generated.mkdir(parents=True)
    (generated / "textures").symlink_to(project / "textures")
    (generated.parent / "field.png").symlink_to(project.parent / "field.png")
    (project / "textures" / "other.png").symlink_to(tmp_path / "secret.png")

    assert read(generated, "textures/line.png") == b"line"
    assert read(generated, "../field.png") == b"field"
    with pytest.raises(OSError, match="outside"):
        read(generated, "textures/other.png")
