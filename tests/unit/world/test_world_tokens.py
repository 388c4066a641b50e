"""The bytes of a world become tokens; strings are written with escapes."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from palaestra_sim.errors import WorldError
from palaestra_sim.world.source import Source
from palaestra_sim.world.tokens import Token, quoted, tokenize, unquoted


def tokens(text: str) -> tuple[Token, ...]:
    """Return the tokens of a text without the end token."""
    return tokenize(Source(data=text.encode(), name="world"))[:-1]


def words(text: str) -> list[str]:
    """Return the texts of the tokens in a text."""
    return [token.text.decode() for token in tokens(text)]


def test_a_comma_is_as_good_as_a_blank() -> None:
    """Webots separates vectors by commas, and reads a comma as a blank."""
    assert words("point [ 0 0 1, 1 0 0 ]") == words("point [ 0 0 1 1 0 0 ]")


def test_braces_and_brackets_need_no_blanks() -> None:
    """People also write worlds by hand, without blanks."""
    assert words("Group{children[Robot{}]}") == words("Group { children [ Robot { } ] }")


def test_a_comment_ends_with_its_line_even_glued_to_a_word() -> None:
    """Outside a string, `#` always begins a comment."""
    assert words("name#the robot\n  TRUE") == ["name", "TRUE"]


def test_a_number_sign_in_a_string_is_data() -> None:
    """Addresses and colors contain `#`, which must not begin a comment inside a string."""
    assert words('url "https://host/a#b"') == ["url", '"https://host/a#b"']


def test_line_ends_of_windows_are_blanks() -> None:
    """A world may have been edited on Windows, where lines end with two characters."""
    assert words("Robot {\r\n}\r\n") == ["Robot", "{", "}"]


def test_every_token_knows_where_it_stands() -> None:
    """An editor of worlds works on bytes, so a letter of two bytes counts as two."""
    (_, string) = tokens('name "ö"')

    assert (string.start, string.end) == (5, 9)


@pytest.mark.parametrize("number", ["0", "-1", "+.5", "1.", "1e5", "-1.5E-3"])
def test_a_number_is_what_begins_like_one(number: str) -> None:
    """Webots reads all these forms of numbers."""
    assert [token.kind for token in tokens(number)] == ["number"]


@pytest.mark.parametrize("text", ["1x", "-", ".", "1.2.3", "+-1", "3D", '1"a"'])
def test_what_begins_like_a_number_and_is_none_is_refused(text: str) -> None:
    """A name cannot begin with a digit, so such a token is neither a number nor a name."""
    with pytest.raises(WorldError, match=r"world:1:1: .* is neither a number nor a name"):
        tokens(text)


@pytest.mark.parametrize("text", ['"', '"abc', 'name "abc\n"', '"\\"', '"a\\\n"'])
def test_a_string_ends_on_its_line(text: str) -> None:
    """Webots never writes a line end into a string, so the error is on the line of the missing quote."""
    with pytest.raises(WorldError, match="this string is not closed on its line"):
        tokens(text)


def test_a_control_character_is_refused() -> None:
    """A control character is invisible in an editor, so the message must have its position."""
    with pytest.raises(WorldError, match=r"world:2:3: control character 0x00 outside a string"):
        tokens("\n  \x00")


def test_only_quotes_and_backslashes_are_escaped() -> None:
    """Every other backslash stands for itself, as in a path of Windows."""
    (token,) = tokens(r'"a \" b \\ c \n"')

    assert unquoted(token) == r'a " b \ c \n'


@given(st.text(st.characters(exclude_characters="\n", exclude_categories=["Cs"])))
def test_a_written_string_reads_as_what_it_was(text: str) -> None:
    """A name with quotes or backslashes must come back unchanged from a generated world."""
    (token,) = tokens(quoted(text).decode())

    assert unquoted(token) == text


@given(st.lists(st.sampled_from(["Robot", "{", "}", "[", "]", '"a # b"', "-1.5", "TRUE", "ä"])))
def test_tokens_survive_whatever_stands_between_them(texts: list[str]) -> None:
    """Blanks, commas, line ends and comments only separate tokens."""
    gap = ' ,\t# a "comment" with { and \\ \r\n'

    assert words(gap + gap.join(texts) + gap) == texts
