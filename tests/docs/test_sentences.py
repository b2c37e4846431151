"""Sentences of the pages are short enough to be read once."""

import re
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
MAX_WORDS = 35
GENERATED = frozenset({"words.md", "messages.md", "reference.md"})
HISTORIES = frozenset({"design.md"})  # its sizes are lists of numbers


def sentences(page: str) -> Iterator[str]:
    """Yield the sentences of the prose, the lists and the cells of a page; code counts as one word."""
    prose = re.sub(r"(?ms)^[ \t]*```.*?^[ \t]*```", "", page)
    prose = re.sub(r"`[^`]*`", "code", prose)
    prose = re.sub(r"\]\([^)]*\)", "]", prose)
    for part in re.split(r"\n[ \t]*(?:\n|(?=[-*|>#] ?|\d+\. ))|(?<=[^|\n])\|", prose):
        yield from re.split(r"(?<=[.!?])\s+|(?<=[:;])\s+(?=[A-Z*\"(\[0-9])", " ".join(part.split()))


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_no_sentence_is_too_long(page: Path) -> None:
    if page.name in GENERATED | HISTORIES:
        return
    long = [one for one in sentences(page.read_text(encoding="utf-8")) if len(one.split()) > MAX_WORDS]
    assert not long, "\n".join(long)


def test_a_long_sentence_is_found() -> None:
    page = "- One.\n- " + "word " * 36 + ".\n\n| a | " + "word " * 36 + "|\n\n```\n" + "word " * 36 + "\n```\n"
    assert sum(len(one.split()) > MAX_WORDS for one in sentences(page)) == 2
