"""docs/stability.md is kept: all names that were promised are there, and calls that were right are right."""

from __future__ import annotations

from copy import deepcopy

import pytest

from tests.docs.frozen import Names, broken, frozen, now
from tests.docs.makers import DOCS
from vrs_cli.net.messages import VERSION
from vrs_cli.version import __version__
from vrs_cli.wire.lines import FORMAT

PAGE = (DOCS / "stability.md").read_text("utf-8")
HAVE = now()


def test_what_was_promised_is_there() -> None:
    assert broken(frozen(), HAVE) == [], "before 1.0: python -m tests.docs.frozen; from then on: docs/stability.md"


def test_all_surfaces_of_the_page_are_recorded() -> None:
    promised = frozen()
    for surface in promised:
        assert f"| {surface} |" in PAGE
        assert len(promised[surface]) > (0 if surface == "words" else 4)
    assert {"Robot", "Robot.move", "connect", "trans"} <= set(promised["python"])
    assert {"run", "lab experiment", "tools lsp"} <= set(promised["commands"])
    assert {"Hello", "Welcome", "Line"} <= set(promised["messages"])
    assert {"HeaderRecord", "DeltaRecord", "MotionRecord"} <= set(promised["trajectory file"])
    assert {"instruction MOVES", "control FOR", "function DISTANCE", "command WHERE"} <= set(promised["words"]["all"])


def test_the_page_names_the_versions() -> None:
    assert f"format {FORMAT}" in PAGE
    assert f"version {VERSION}" in PAGE


def test_the_citation_is_of_this_version_and_of_the_paper() -> None:
    cited = (DOCS.parent / "CITATION.cff").read_text("utf-8")
    assert f"\nversion: {__version__}\n" in cited
    assert 'title: "Modelling and Interfacing Remote Virtual Robots"' in cited


def changed(surface: str, row: str, parts: list[str] | None) -> Names:
    """Return the names of now with another row, or without it."""
    names = deepcopy(HAVE)
    del names[surface][row]
    if parts is not None:
        names[surface][row] = parts
    return names


@pytest.mark.parametrize(
    ("surface", "row", "parts", "said"),
    [
        ("python", "Robot.undo", None, "python: Robot.undo is gone"),
        ("python", "Robot.sample", ["rate", "end", "start"], "start has another place"),
        ("python", "Robot.sample", ["rate", "start"], "end is gone"),
        ("python", "Robot.undo", ["count!"], "count has to be given"),
        ("python", "Robot.undo", ["count", "why=!"], "why=! has to be given"),
        ("python", "Robot.undo", ["count="], "count has another place"),
        ("commands", "where", ["--help"], "--at is gone"),
        ("commands", "lab steer", None, "commands: lab steer is gone"),
        ("messages", "Ping", ["other!"], "other! has to be given"),
        ("words", "all", ["instruction MOVE"], "instruction MOVES is gone"),
    ],
)
def test_what_breaks_a_promise_is_found(surface: str, row: str, parts: list[str] | None, said: str) -> None:
    assert [one for one in broken(HAVE, changed(surface, row, parts)) if one.endswith(said)]


@pytest.mark.parametrize(
    ("surface", "row", "more"),
    [
        ("python", "Robot.undo", "why="),
        ("python", "Robot.undo", "why"),
        ("commands", "where", "--new"),
        ("messages", "Ping", "new"),
    ],
)
def test_what_is_added_breaks_none(surface: str, row: str, more: str) -> None:
    assert broken(HAVE, changed(surface, row, [*HAVE[surface][row], more])) == []
    assert broken(HAVE, {**HAVE, surface: {**HAVE[surface], "another": ["x!"]}}) == []
