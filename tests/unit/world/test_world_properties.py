"""Properties of all worlds: hypothesis draws worlds with random gaps between their tokens."""

from itertools import chain, product

from hypothesis import example, given
from hypothesis import strategies as st

from palaestra_sim.world import Node, RunIdentity, World, generate, parse, robots, ros_name
from palaestra_sim.world.tokens import quoted

IDENTITY = RunIdentity(job="job", replica=0, group="collect", index=0)

GAPS = st.sampled_from([" ", "\n  ", "\r\n\t", " , ", '  # a "comment" { [\n', "\n#\r\n#\n "])
WORDS = st.sampled_from(["Pose", "Solid", "Shape", "Robotino3", "Grüße", "a-b", "x1"])
TEXTS = st.one_of(
    st.sampled_from(["", "ros", "--name=a", '"', "\\", "#", "ü"]),
    st.text(st.characters(exclude_characters="\n", exclude_categories=["Cs"]), max_size=8),
)
STRINGS = TEXTS.map(lambda text: quoted(text).decode())
NUMBERS = st.sampled_from(["0", "-1.5", "1e3", ".5", "+2."])
SCALARS = st.one_of(STRINGS, NUMBERS, st.sampled_from(["TRUE", "FALSE", "NULL"])).map(lambda s: [s])
ARGUMENTS = st.sampled_from(
    ["--name=a", "--name=", "--clock", "--synchronize", "--auto-publish", "--name=a --clock", ""]
).map(lambda text: f'"{text}"')


def listed(items: st.SearchStrategy[list[str]]) -> st.SearchStrategy[list[str]]:
    """Draw a bracketed list of items."""
    return st.lists(items, max_size=3).map(lambda rows: ["[", *chain(*rows), "]"])


@st.composite
def nodes(draw: st.DrawFn, inner: st.SearchStrategy[list[str]]) -> list[str]:
    """Draw the tokens of a node of any type; `inner` draws the tokens of nodes inside it."""
    values = st.one_of(SCALARS, listed(SCALARS), inner, listed(inner))
    fields = draw(st.dictionaries(st.sampled_from(["f", "g", "name", "hidden x"]), values))
    body = [token for name, value in fields.items() for token in (*name.split(), *value)]
    return [draw(WORDS), "{", *body, "}"]


@st.composite
def ros_robots(draw: st.DrawFn, inner: st.SearchStrategy[list[str]]) -> list[str]:
    """Draw the tokens of a robot with the controller ros; its field `name` gets its value later."""
    controller = ["controller", '"ros"']
    arguments = draw(
        st.one_of(
            st.just([]),
            listed(ARGUMENTS.map(lambda text: [text])).map(lambda row: ["controllerArgs", *row]),
            ARGUMENTS.map(lambda text: ["controllerArgs", text]),
        )
    )
    children = draw(st.one_of(st.just([]), listed(inner).map(lambda row: ["children", *row])))
    parts = draw(st.permutations([["name", "?"], controller, arguments, children]))
    return ["Robot", "{", *chain(*parts), "}"]


TREES = st.recursive(
    st.just(["Lamp", "{", "}"]),
    lambda inner: st.one_of(nodes(inner), ros_robots(inner)),
    max_leaves=8,
)


@st.composite
def worlds(draw: st.DrawFn) -> bytes:
    """Draw a world whose robots have different names. At least one robot has the controller ros."""
    lamp = st.just(["Lamp", "{", "}"])
    tokens = chain(*draw(st.lists(TREES, max_size=3)), draw(ros_robots(lamp)))
    pieces = [draw(st.sampled_from(["#VRML_SIM R2023b utf8\n", "#VRML_SIM V8.6.2 utf8 \r\n"]))]
    for number, token in enumerate(tokens):
        pieces += [f'"robot {number}"' if token == "?" else token, draw(GAPS)]
    return "".join(pieces).encode()


def without_arguments(source: bytes) -> bytes:
    """Return a world without the `controllerArgs` of its robots and the gaps before them."""
    world = parse(source)
    cuts = sorted(
        (world.tokens[world.index(value.span[0]) - 2].end, value.span[1])
        for node in world.walk()
        if node.text("controller") == "ros" and (value := node.fields.get("controllerArgs"))
    )
    for start, end in reversed(cuts):
        source = source[:start] + source[end:]
    return source


def rewritten(world: World) -> str:
    """Return a world written from its parsed tree, without comments and formatting."""
    return " ".join(token for node in world.nodes for token in written(node))


def written(node: Node) -> list[str]:
    """Return the tokens of a node, written from the node's parsed tree."""
    tokens = [node.type_name, "{"]
    for name, value in node.fields.items():
        tokens += [name, "["] if value.bracketed else [name]
        for item in value.items:
            match item:
                case Node():
                    tokens += written(item)
                case str():
                    tokens.append(quoted(item).decode())
                case bool() | None:
                    tokens.append({True: "TRUE", False: "FALSE", None: "NULL"}[item])
                case _:
                    tokens.append(str(item))
        tokens += ["]"] if value.bracketed else []
    return [*tokens, "}"]


@given(worlds())
def test_a_world_survives_being_read_and_written_anew(source: bytes) -> None:
    """The parsed tree keeps the meaning of a world, but not its formatting."""
    once = rewritten(parse(source))

    assert rewritten(parse(f"#VRML_SIM R2023b utf8\n{once}".encode())) == once


@given(source=worlds(), clock=st.booleans())
def test_only_the_arguments_of_robots_change(source: bytes, *, clock: bool) -> None:
    """All other bytes belong to the author: comments, commas, line ends and saved states."""
    made = generate(source, IDENTITY, clock=clock)

    assert without_arguments(made) == without_arguments(source)


@given(source=worlds(), clock=st.booleans())
def test_generating_twice_changes_nothing(source: bytes, *, clock: bool) -> None:
    """A sidecar may get a world that was already generated."""
    made = generate(source, IDENTITY, clock=clock)

    assert generate(made, IDENTITY, clock=clock) == made


@given(worlds())
@example(
    b"#VRML_SIM R2023b utf8\n"
    b'Robot { name "r" controller "ros" controllerArgs [ "--name=a"  # c\n"--name=a" "--clock" ] } '
)
def test_taking_the_clock_away_later_is_the_same_as_never_allowing_it(source: bytes) -> None:
    """The sidecar of a second simulator may get a world that was generated with a clock."""
    allowed = generate(source, IDENTITY, clock=True)

    assert generate(allowed, IDENTITY, clock=False) == generate(source, IDENTITY, clock=False)


@given(source=worlds(), clock=st.booleans())
def test_every_robot_has_its_name_and_waits_for_its_client(source: bytes, *, clock: bool) -> None:
    """A trainer finds robots by these names, and controls each step only if all robots wait for it."""
    made = robots(generate(source, IDENTITY, clock=clock))

    assert [robot.robot for robot in made] == [robot.robot for robot in robots(source)]
    assert [robot.ros_name for robot in made] == [ros_name(IDENTITY, r.robot) for r in made]
    assert all(robot.synchronize for robot in made)


@given(source=worlds(), clock=st.booleans())
def test_no_world_has_two_clocks_or_two_names(source: bytes, *, clock: bool) -> None:
    """Two clocks would publish different times on `/clock`, and of two names only the last one counts."""
    world = parse(generate(source, IDENTITY, clock=clock))
    found = [node.texts("controllerArgs") for node in world.walk() if node.text("controller")]

    asked = any("--clock" in text for node in parse(source).walk() for text in node.texts("controllerArgs"))
    assert sum(row.count("--clock") for row in found) == int(clock and asked)
    assert all(sum(text.startswith("--name=") for text in row) == 1 for row in found)


@given(worlds(), st.sets(st.integers(0, 20), max_size=2), st.sets(st.integers(0, 9), max_size=2))
def test_no_two_worlds_of_a_job_share_a_ros_name(
    source: bytes, replicas: set[int], indices: set[int]
) -> None:
    """Two nodes with one name would unregister each other from the ROS master."""
    names = [
        robot.ros_name
        for replica, group, index in product(replicas, ("collect", "evaluate"), indices)
        for robot in robots(
            generate(
                source,
                RunIdentity(job="job", replica=replica, group=group, index=index),
                clock=False,
            )
        )
    ]

    assert len(set(names)) == len(names)
