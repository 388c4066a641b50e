"""PROTO files next to a world are found by EXTERNPROTO lines and read from the disk only."""

from collections.abc import Mapping
from pathlib import Path

import pytest

from palaestra_sim.world import Protos, WorldError, local_protos, parse

HEADER = "#VRML_SIM R2023b utf8\n"
WORLD = Path("/project/worlds/room.wbt")


def found(world: str, files: Mapping[str, str], **options: object) -> Protos:
    """Return the PROTOs of a world whose files are in memory, without their first lines."""

    def read(path: Path) -> bytes:
        text = files.get(
            str(path).replace("/project/worlds/../", "/project/").replace("/protos/./", "/protos/")
        )
        if text is None:
            raise FileNotFoundError(2, "No such file or directory")
        return (HEADER + text).encode()

    source = (HEADER + world).encode()
    return local_protos(WORLD, parse(source), name="room.wbt", read=read, **options)  # type: ignore[arg-type]


def proto(name: str, *externs: str) -> str:
    """Return a PROTO of one Solid that refers to other files."""
    return (
        "".join(f'EXTERNPROTO "{address}"\n' for address in externs) + f"PROTO {name} [ ] {{ Solid {{ }} }}"
    )


def refusals(result: Protos) -> dict[str, str]:
    """Return the message for each type that was rejected."""
    return {name: str(error) for name, error in result.refused.items()}


def test_relative_addresses_count_from_the_file_that_names_them() -> None:
    """A PROTO finds the files next to it, whatever folder the world is in."""
    result = found(
        'EXTERNPROTO "../protos/Stool.proto"',
        {
            "/project/protos/Stool.proto": proto("Stool", "parts/Leg.proto", "./Seat.proto"),
            "/project/protos/parts/Leg.proto": proto("Leg"),
            "/project/protos/Seat.proto": proto("Seat"),
        },
    )

    assert list(result.local) == ["Stool", "Leg", "Seat"]
    assert result.refused == {}


def test_an_address_with_a_scheme_is_a_name_only() -> None:
    """Webots provides these PROTOs, so only their names count; nothing is loaded from a network."""
    result = found(
        'EXTERNPROTO "https://example.com/objects/protos/WoodenBox.proto"\n'
        'IMPORTABLE EXTERNPROTO "webots://projects/objects/floors/protos/Floor.proto"\n'
        'EXTERNPROTO "Stool.proto"',
        {"/project/worlds/Stool.proto": proto("Stool", "webots://projects/appearances/protos/Pine.proto")},
    )

    assert result.remote == {"WoodenBox", "Floor", "Pine"}
    assert list(result.local) == ["Stool"]


def test_a_file_that_several_name_is_read_once() -> None:
    """Both spellings of the address lead to one file, which must not count as two files of a type."""
    result = found(
        'EXTERNPROTO "../protos/A.proto"\nEXTERNPROTO "../protos/Leg.proto"',
        {
            "/project/protos/A.proto": proto("A", "./Leg.proto"),
            "/project/protos/Leg.proto": proto("Leg"),
        },
    )

    assert list(result.local) == ["A", "Leg"]
    assert result.refused == {}


def test_a_missing_file_is_refused_at_the_line_that_names_it() -> None:
    """The position in the error is that of the EXTERNPROTO line, in a world or in a PROTO."""
    result = found(
        'EXTERNPROTO "Gone.proto"\nEXTERNPROTO "Stool.proto"',
        {"/project/worlds/Stool.proto": proto("Stool", "Leg.proto")},
    )

    assert refusals(result) == {
        "Gone": "room.wbt:2:13: /project/worlds/Gone.proto cannot be read: No such file or directory; "
        "correct the address; it is relative to the folder of this file",
        "Leg": "/project/worlds/Stool.proto:2:13: /project/worlds/Leg.proto cannot be read: "
        "No such file or directory; correct the address; it is relative to the folder of this file",
    }
    assert list(result.local) == ["Stool"]


def test_protos_that_are_made_of_each_other_are_refused_with_both_names() -> None:
    """An instance of such a PROTO would never be complete."""
    result = found(
        'EXTERNPROTO "A.proto"',
        {
            "/project/worlds/A.proto": proto("A", "B.proto"),
            "/project/worlds/B.proto": proto("B", "A.proto"),
        },
    )

    assert refusals(result) == {
        "A": "/project/worlds/B.proto:2:13: B and A contain each other; remove A from B"
    }
    assert "A" not in result.local


def test_a_proto_that_is_made_of_itself_is_refused() -> None:
    """A PROTO that contains itself is the shortest possible cycle."""
    result = found('EXTERNPROTO "A.proto"', {"/project/worlds/A.proto": proto("A", "A.proto")})

    assert refusals(result)["A"].endswith("A contains itself; remove A from A")


def test_a_chain_of_files_has_a_bounded_length() -> None:
    """Palaestra's own limit comes before Python's recursion limit."""
    files = {f"/project/worlds/P{n}.proto": proto(f"P{n}", f"P{n + 1}.proto") for n in range(200)}

    result = found('EXTERNPROTO "P0.proto"', files)

    assert len(result.local) == 20
    assert "more than 20 deep; nest fewer PROTO files" in refusals(result)["P20"]


def test_a_file_that_is_no_proto_is_refused_under_its_type() -> None:
    """The world may contain no node of that type, so the caller decides whether this is an error."""
    result = found(
        'EXTERNPROTO "A.proto"\nEXTERNPROTO "B.proto"\nEXTERNPROTO "C.proto"',
        {
            "/project/worlds/A.proto": "PROTO A [ ] { %< call(1); >% Solid { } }",
            "/project/worlds/B.proto": proto("Other"),
            "/project/worlds/C.proto": proto("C"),
        },
    )

    assert refusals(result)["A"].startswith("/project/worlds/A.proto:2:15: this PROTO has a template")
    assert refusals(result)["B"].endswith(
        "the file B.proto declares the PROTO Other; give the file and the PROTO the same name"
    )
    assert list(result.local) == ["C"]


def test_two_files_of_one_type_are_refused() -> None:
    """A type must have exactly one meaning in a world."""
    result = found(
        'EXTERNPROTO "Leg.proto"\nEXTERNPROTO "a/A.proto"',
        {
            "/project/worlds/Leg.proto": proto("Leg"),
            "/project/worlds/a/A.proto": proto("A", "Leg.proto"),
            "/project/worlds/a/Leg.proto": proto("Leg"),
        },
    )

    assert "a second file of the type Leg, after /project/worlds/Leg.proto" in refusals(result)["Leg"]


def test_types_that_are_described_otherwise_are_not_read() -> None:
    """A stand-in replaces a PROTO whose file has a template or is missing."""
    result = found('EXTERNPROTO "Gone.proto"', {}, without={"Gone"})

    assert result == Protos()


def test_a_world_without_a_file_has_no_relative_addresses() -> None:
    """A world from a ConfigMap has no folder to which an address could be relative."""
    source = f'{HEADER}EXTERNPROTO "Stool.proto"'.encode()

    error = local_protos(None, parse(source)).refused["Stool"]

    assert str(error) == (
        'world:2:13: "Stool.proto" is relative to the file of the world, and this world is not in a file; '
        "begin the address with webots:// or https://, or give the world as a file"
    )


def test_files_are_read_from_the_disk(tmp_path: Path) -> None:
    """Without a function for reading, a caller gets the files on the disk.

    A name with a null byte, which no file can have, is refused.
    """
    (tmp_path / "Stool.proto").write_text(HEADER + proto("Stool"))
    source = f'{HEADER}EXTERNPROTO "Stool.proto"\nEXTERNPROTO "a\0b.proto"'.encode()
    with pytest.raises(WorldError):
        parse(source.replace(b'EXTERNPROTO "a', b"\0"))

    result = local_protos(tmp_path / "room.wbt", parse(source))

    assert list(result.local) == ["Stool"]
    assert "embedded null byte" in refusals(result)["a\0b"]


def test_files_from_before_r2022b_find_the_protos_of_their_project_by_name(tmp_path: Path) -> None:
    """Neither the world nor its PROTOs have EXTERNPROTO lines.

    The folders below `protos/` are searched too.
    """
    (tmp_path / "worlds").mkdir()
    (tmp_path / "protos" / "parts").mkdir(parents=True)
    old = "#VRML_SIM R2022a utf8\n"
    (tmp_path / "protos" / "Stool.proto").write_text(
        f"{old}PROTO Stool [ field SFNode seat Seat {{ }} ] {{ Solid {{ children [ Leg {{ }} ] }} }}"
    )
    for name in ("Leg", "Seat", "Unused"):
        (tmp_path / "protos" / "parts" / f"{name}.proto").write_text(old + proto(name))
    (tmp_path / "protos" / "Torn.proto").write_text(f"{old}PROTO Torn [")
    world = tmp_path / "worlds" / "room.wbt"

    result = local_protos(world, parse(f"{old}Group {{ children [ Stool {{ }} Torn {{ }} ] }}".encode()))
    assert list(result.local) == ["Stool", "Leg", "Seat"]
    assert list(result.refused) == ["Torn"]

    result = local_protos(world, parse(f"{HEADER}Stool {{ }}".encode()))
    assert result == Protos()


def test_a_world_without_a_file_has_no_project() -> None:
    """Without a file there is no project whose folder `protos` could be searched."""
    assert local_protos(None, parse(b"#VRML_SIM R2021b utf8\nStool { }")) == Protos()
