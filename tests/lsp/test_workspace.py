"""Test files of one name space in an editor."""

from __future__ import annotations

import pytest

from vrs_cli.errors import UsageError
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.lsp.workspace import Workspace

PUMA = load_robot("puma560")
CELL = "file:///work/cell"
MAIN, LIB, MORE, APART = (f"{CELL}/{name}.v2" for name in ("main", "lib", "more_parts", "apart"))
TEXTS = {
    MAIN: "; with: more_parts.v2\n.PROGRAM main()\n    AUTO n\n    n = 3\n    CALL grip(n, 2)\n    MOVE part\n"
    "    total = 0\n.END\n",
    LIB: ".PROGRAM grip(n) ;closes on a part\n    total = total+n\n    CALL grip(n)\n    n = 1\n.END\n",
    MORE: ".PROGRAM closei(n)\n    MOVE part\n.END\n.LOCATIONS\npart 400 150 200 90 -90 0\n.END\n",
    APART: ".PROGRAM apart()\n    total = 5\n    MOVE part\n.END\n",
}


@pytest.fixture
def files() -> Workspace:
    found = Workspace(PUMA)
    found.take(TEXTS)
    return found


def at(uri: str, word: str, nth: int = 1) -> tuple[str, int, int]:
    """Return the place of a word: its nth occurrence in a text."""
    text, begin = TEXTS[uri], -1
    for _ in range(nth):
        begin = text.index(word, begin + 1)
    return uri, text.count("\n", 0, begin) + 1, begin - text.rfind("\n", 0, begin)


def lines(places: object) -> list[tuple[str, int]]:
    return [(one.uri, one.span.line) for one in places]  # type: ignore[attr-defined]


def test_files_that_name_or_call_each_other_belong_together(files: Workspace) -> None:
    assert files.project(MAIN) == (MAIN, LIB, MORE)
    assert files.project(LIB) == (LIB, MAIN, MORE)
    assert files.project(APART) == (APART,)
    twice = {**TEXTS, f"{CELL}/other.v2": TEXTS[LIB]}
    files.take(twice)
    assert files.project(LIB) == (LIB,), "two files have grip: nobody knows which is meant"
    files.take({**TEXTS, "file:///work/deep/lib.v2": TEXTS[LIB]})
    assert files.project(MAIN) == (MAIN, LIB, MORE), "that of the same folder is meant"


def test_definitions_in_other_files(files: Workspace) -> None:
    found = files.definition(*at(MAIN, "grip"))
    assert found is not None
    assert (found.uri, found.span.line, found.span.column) == (LIB, 1, 10)
    place = files.definition(*at(MAIN, "part", 2))
    assert place is not None
    assert (place.uri, place.span.line) == (MORE, 5)
    own = files.definition(*at(MAIN, "n,"))
    assert own is not None
    assert own.uri == MAIN, "a variable of the program's own"
    assert files.definition(*at(APART, "part", 2)) is None


def test_references_and_rename_in_all_files(files: Workspace) -> None:
    assert lines(files.references(*at(MAIN, "grip"))) == [(MAIN, 5), (LIB, 1), (LIB, 3)]
    assert lines(files.references(*at(LIB, "total"))) == [(LIB, 2), (LIB, 2), (MAIN, 7)]
    assert lines(files.references(*at(LIB, "n)"))) == [(LIB, 1), (LIB, 2), (LIB, 3), (LIB, 4)], "a parameter"
    name, found = files.rename(*at(LIB, "grip"), "hold")
    assert (name, {uri: len(spans) for uri, spans in found.items()}) == ("hold", {LIB: 2, MAIN: 1})
    with pytest.raises(UsageError, match="main is there already in main"):
        files.rename(*at(LIB, "grip"), "main")
    with pytest.raises(UsageError, match="part is there already"):
        files.rename(*at(LIB, "total"), "part")


def test_findings_across_files(files: Workspace) -> None:
    found = [(one.label, one.span.line) for one in files.diagnostics(MAIN)]
    assert found == [("V408", 5)]
    assert files.diagnostics(LIB) == ()
    assert [one.label for one in files.diagnostics(APART)] == ["V401"]


def test_hover_knows_the_role_of_a_name(files: Workspace) -> None:
    uri, *place = at(MAIN, "grip")
    told = files.document(uri).hover(*place, *files.near(uri))
    assert told is not None
    assert ".PROGRAM grip(n)" in told[0]
    assert "closes on a part" in told[0]
    alone = files.document(uri).hover(*place)
    assert alone is not None
    assert alone[0] == "`grip` is a program of no file here", "no page of HELP on CLOSEI"
    uri, *place = at(MAIN, "part", 2)
    told = files.document(uri).hover(*place, *files.near(uri))
    assert told is not None
    assert "part 400 150 200" in told[0]


def test_completion_and_signatures_from_other_files(files: Workspace) -> None:
    text = TEXTS[APART].replace("    total = 5\n", "    CALL gr\n    MOVE pa\n    MOVE grip(\n")
    files.take({**TEXTS, APART: text})
    near = files.near(APART)
    assert [one.text for one in files.document(APART).completions(2, 12, *near)] == ["grip"]
    assert [one.text for one in files.document(APART).completions(3, 12, *near)] == [], "its variables are its own"
    signature = files.document(APART).signature(4, 15, near[1])
    assert signature is not None
    assert signature.form == "grip(n)"
    files.take({**TEXTS, LIB: TEXTS[LIB].replace("    n = 1", "    MOVE pa")})
    assert [one.text for one in files.document(LIB).completions(4, 12, *files.near(LIB))] == ["part"]


def test_symbols_of_the_workspace(files: Workspace) -> None:
    found = [(uri, one.name, holder) for uri, one, holder in files.symbols("PAR")]
    assert found == [(APART, "apart", ""), (MORE, "part", ".LOCATIONS")]


def test_a_file_without_a_heading_is_the_program_of_its_name(files: Workspace) -> None:
    bare = f"{CELL}/close.v2"
    files.take({**TEXTS, bare: "MOVE part\nCLOSEI\n", MAIN: TEXTS[MAIN].replace("grip(n, 2)", "close()")})
    found = files.definition(MAIN, 5, 10)
    assert found is not None
    assert found.uri == bare
