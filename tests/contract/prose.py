"""Find sentences that a reader must read twice, by rules, in docs, sources and configuration.

Pure: text in, findings out. `RULES` is the list of rules. Code, quotes, tables, headings and questions are
exempt. `python -m tests.contract.prose PATH...` prints the findings.
"""

from __future__ import annotations

import ast
import io
import re
import sys
import tokenize
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

MOST_WORDS = 35
WORD = re.compile(r"[A-Za-z0-9][\w'./-]*")
# A full stop ends a sentence if a capital, a quote or a digit follows, so that "e.g. this" stays one.
END = re.compile(r"(?<=[.!?])[)\"'”*]*\s+(?=[A-Z\"'“`(*\d])")


@dataclass(frozen=True, slots=True, kw_only=True)
class Sentence:
    """A sentence of running text and the line of its file on which its paragraph begins."""

    line: int
    text: str

    @property
    def is_question(self) -> bool:
        """Whether the sentence ends in a question mark; such a sentence is exempt."""
        return self.text.rstrip(")\"'”*").endswith("?")


@dataclass(frozen=True, slots=True, kw_only=True)
class Finding:
    """A sentence that breaks a rule."""

    path: Path
    line: int
    rule: str
    text: str

    def __str__(self) -> str:
        return f"{self.path}:{self.line}: {self.rule}: {self.text}"


def contains(pattern: str) -> Callable[[str], bool]:
    """Return a function that checks whether a text contains a pattern, in any case."""
    compiled = re.compile(pattern, re.IGNORECASE)
    return lambda text: compiled.search(text) is not None


def is_long(text: str) -> bool:
    """Return whether a sentence has more than `MOST_WORDS` words."""
    return len(WORD.findall(text)) > MOST_WORDS


RULES: dict[str, Callable[[str], bool]] = {
    "indefinite pronoun; name the program or person": contains(r"\bwho(so)?(m?ever|sever)\b"),
    "passive of tell; use report, log, return or show": contains(r"\b(is|are|was|were) told\b"),
    "the verb tell; use report, log, return or show": contains(r"\btells (of|that|how)\b"),
    "begins with What is, Who or That which; begin with the thing": contains(
        r"^(what (is|are|was|were)|who|that which)\b"
    ),
    f"over {MOST_WORDS} words; make two sentences": is_long,
}


def findings(path: Path) -> list[Finding]:
    """Return the findings in a file, in the order of its lines."""
    return [
        Finding(path=path, line=sentence.line, rule=rule, text=sentence.text)
        for sentence in sentences(path)
        if not sentence.is_question
        for rule, breaks in RULES.items()
        if breaks(sentence.text)
    ]


def sentences(path: Path) -> Iterator[Sentence]:
    """Yield the sentences of running text in a file; the suffix of the name selects the reader."""
    text = path.read_text()
    paragraphs = READERS.get(path.suffix, of_comments)(text)
    for line, paragraph in paragraphs:
        for sentence in END.split(" ".join(paragraph.split())):
            yield Sentence(line=line, text=sentence)


Paragraph = tuple[int, str]


def of_markdown(text: str) -> Iterator[Paragraph]:
    """Yield paragraphs and list items, without code, tables, headings, quotes and link addresses."""
    text = re.sub(r"^(```|~~~).*?^\1[^\n]*$", blank, text, flags=re.MULTILINE | re.DOTALL)
    text = re.sub(r"<!--.*?-->", blank, text, flags=re.DOTALL)
    exempt = re.compile(r"\s*([#|>├└│]|!\[|<|---)")
    lines = [(number, "" if exempt.match(line) else line) for number, line in enumerate(text.split("\n"), 1)]
    yield from of_lines([(number, without_code(line)) for number, line in lines])


def of_lines(lines: Iterable[Paragraph]) -> Iterator[Paragraph]:
    """Yield paragraphs, which end at an empty line, or before a line that begins an item or a field."""
    begins = re.compile(r"\s*([-*]|\d+\.)\s+|\s*[\w.`*\[\]/]+( \([^)]*\))?: +(?=\S)")
    start, held = 0, ""
    for number, line in [*lines, (0, "")]:
        new = begins.match(line)
        if held and (new or not line.strip()):
            yield start, held
            held = ""
        if line.strip():
            start = start if held else number
            held += " " + (line[new.end() :] if new else line)


def of_python(text: str) -> Iterator[Paragraph]:
    """Yield docstrings, comments and messages: strings of three words or more."""
    yield from of_comments(text)
    for node in ast.walk(ast.parse(text)):
        match node:
            case ast.Expr(value=ast.Constant(value=str(docstring))):
                yield from of_docstring(node.lineno, docstring)
            case ast.JoinedStr(values=pieces) if is_message("".join(map(piece, pieces))):
                yield node.lineno, without_code("".join(map(piece, pieces)))
            case ast.Constant(value=str(words)) if is_message(words):
                yield node.lineno, without_code(words)
            case _:
                pass


def is_message(text: str) -> bool:
    """Return whether a string may be a sentence: one line of words, no markup."""
    return text.count(" ") > 1 and "\n" not in text and not text.lstrip().startswith(("{", "<", "|", "#"))


def of_docstring(line: int, text: str) -> Iterator[Paragraph]:
    """Yield the paragraphs of a docstring with their lines, except section headings and blocks."""
    prose = re.sub(r"^\s*\w+:$", "", without_blocks(text), flags=re.MULTILINE)
    yield from ((line + number - 1, paragraph) for number, paragraph in of_markdown(prose))


def without_blocks(docstring: str) -> str:
    """Return a docstring in which indented blocks after an empty line (code, tables) are blank."""
    lines = docstring.split("\n")
    margin = min((indent(line) for line in lines[1:] if line.strip()), default=0)
    kept, inside = lines[:1], False
    for before, line in pairwise(lines):
        begins = inside or not before.strip()
        inside = begins and indent(line) >= margin + 4 if line.strip() else inside
        kept.append("" if inside else line)
    return "\n".join(kept)


def indent(line: str) -> int:
    """Return the number of blanks at the beginning of a line."""
    return len(line) - len(line.lstrip())


def of_comments(text: str) -> Iterator[Paragraph]:
    """Yield paragraphs of comments: consecutive comment lines, or a single comment after code."""
    found = [(number, without_code(comment)) for number, comment in comments(text)]
    sources = text.split("\n")
    full = {number: comment for number, comment in found if sources[number - 1].lstrip().startswith("#")}
    yield from ((number, comment) for number, comment in found if number not in full)
    yield from of_lines([(number, full.get(number, "")) for number in range(1, max(full, default=0) + 1)])


def comments(text: str) -> Iterator[Paragraph]:
    """Yield the comments of Python code; in any other text, a comment is a line that begins with `#`."""
    try:
        tokens = list(tokenize.generate_tokens(io.StringIO(text).readline))
    except (tokenize.TokenError, SyntaxError):
        found = re.finditer(r"^[ \t]*#+ ?(.*)$", text, re.MULTILINE)
        yield from ((text.count("\n", 0, match.start(1)) + 1, match[1]) for match in found)
        return
    yield from (
        (token.start[0], token.string.lstrip("#! "))
        for token in tokens
        if token.type == tokenize.COMMENT and not re.match(r"#!|# (noqa|type:|pyright)", token.string)
    )


READERS: dict[str, Callable[[str], Iterator[Paragraph]]] = {".md": of_markdown, ".py": of_python}


def piece(node: ast.expr) -> str:
    """Return a part of an f-string as text, in which a value is one word."""
    return str(node.value) if isinstance(node, ast.Constant) else "x"


def without_code(text: str) -> str:
    """Return a text in which code is one word, quotes are one word, and links are their text."""
    text = re.sub(r"`[^`]*`", "X", text)  # a capital letter, because code may begin a sentence
    text = re.sub(r"[\"“][^\"”]*[\"”]", "x", text)
    return re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", text)


def blank(match: re.Match[str]) -> str:
    """Return as many newlines as the match contains."""
    return "\n" * match[0].count("\n")


def main() -> None:
    """Print the findings in the given files, and in the text files of the given folders."""
    found = 0
    for path in files(Path(it) for it in sys.argv[1:]):
        for finding in findings(path):
            found += 1
            sys.stdout.write(f"{finding}\n")
    sys.exit(bool(found))


def files(paths: Iterable[Path]) -> Iterator[Path]:
    """Yield the given files, and the text files in the given folders."""
    for path in paths:
        if path.is_dir():
            yield from sorted(
                it for it in path.rglob("*") if it.suffix in {".md", ".py", ".sh", ".toml", ".yaml", ".tpl"}
            )
        else:
            yield path


if __name__ == "__main__":
    main()
