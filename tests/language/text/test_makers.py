"""Test that files in languages of other makers are reported at their first typical line."""

from __future__ import annotations

from pathlib import Path

import pytest

from vrs_cli.interfaces.inspection import inspect
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.language.text.ast import Program
from vrs_cli.language.text.parser import foreign_file, parse_file

KAWASAKI = ".PROGRAM pg1()\n  SPEED 100 ALWAYS\n  JMOVE a\n  LMOVE b\n  SWAIT 1001\n.END\n.TRANS\na 0 0 0 0 0 0\n.END\n"
KUKA = "&ACCESS RVP\nDEF main( )\n;FOLD INI\nPTP HOME\nLIN {X 10}\nEND\n"
ABB = "MODULE M\n  PROC main()\n    MoveJ p1, v100, fine, tool0;\n  ENDPROC\nENDMODULE\n"
UNIVERSAL = "def prog():\n  movej([0,0,0,0,0,0], a=1.4)\n  movel(p[0,0,0,0,0,0])\nend\n"
PENDANT = "/PROG A\n/ATTR\n/MN\n 1:J P[1] 100% FINE ;\n"
KAREL = "PROGRAM move\n-- a comment\nVAR\nBEGIN\nMOVE TO p1\nEND move\n"


@pytest.mark.parametrize(
    ("text", "language", "line"),
    [
        (KUKA, "KRL", 1),
        (KUKA.split("\n", 1)[1], "KRL", 1),
        (ABB, "RAPID", 1),
        (UNIVERSAL, "URScript", 1),
        (PENDANT, "FANUC", 1),
        (KAREL, "Karel", 1),
        (f"; from the cell\n\n{ABB}", "RAPID", 3),
    ],
)
def test_a_file_is_named_once(text: str, language: str, line: int) -> None:
    file, found = parse_file(text)
    assert not file.parts
    (told,) = found
    assert language in told.detail
    assert told.span.line == line
    assert told.span.column < told.span.end
    assert inspect(text, load_robot("puma560")) == found


def test_one_with_programs_hides_no_other_finding() -> None:
    file, found = parse_file(KAWASAKI)
    assert "Kawasaki AS" in found[0].detail
    assert [one.span.line for one in found] == [3, 3, 4, 5, 7, 8, 9]
    assert [type(part) for part in file.parts[:1]] == [Program]
    assert set(found) <= set(inspect(KAWASAKI, load_robot("puma560")))


@pytest.mark.parametrize(
    ("their", "ours", "is_theirs"),
    [
        (["JMOVE a", "LMOVE b"], ["x = 1"] * 18, True),
        (["JMOVE a", "JMOVE b"], ["x = 1"] * 19, False),
        (["JMOVE a", "JMOVE b"], ["x = 1"] * 553, False),
        (["JMOVE a", "JMOVE b"], ["MOVE a"] * 3, False),  # our own motions are more
        (["JMOVE j1, j2, j3, j4"] * 9, [], False),  # V+ has this one
        (["LMOVE a"], [], False),  # one line is a mistake, and no language
    ],
)
def test_the_whole_file_tells_its_language(their: list[str], ours: list[str], *, is_theirs: bool) -> None:
    text = "\n".join((".PROGRAM a()", *ours, *their, ".END", ""))
    assert (foreign_file(text) is not None) is is_theirs
    unread = [line for line in their if "," not in line]
    assert sum(one.span.line > 1 for one in parse_file(text)[1]) == len(unread) + is_theirs


def test_a_line_that_no_other_language_has_is_enough() -> None:
    steps = "x = 1\n" * 300
    assert foreign_file(f".PROGRAM a()\n{steps}LMOVE p\n.END\n.TRANS\np 1 2 3 4 5 6\n.END\n") is not None
    assert foreign_file(f".PROGRAM a()\n{steps}LMOVE p\nLMOVE q\n.END\n") is None


def test_values_are_no_steps() -> None:
    values = "\n".join(f"p{n} 1 2 3 4 5 6" for n in range(1000))
    assert foreign_file(f".PROGRAM a()\n  JMOVE p1\n  LMOVE p2\n.END\n.LOCATIONS\n{values}\n.END\n") is not None


@pytest.mark.parametrize(
    "text",
    [
        "",
        "MOVE a\nMOVE b\n",
        ".PROGRAM a()\n  JMOVE p\n  MOVE q\n.END\n",  # one line is a mistake, and no language
        ".PROGRAM a()\n    module = 3\n    proc = 4\n    begin = 1\n    movej = 2\n.END\n",
        "; -- a line\n; PROC main()\n.PROGRAM a()\n    CALL movej(p)\n.END\n",
    ],
)
def test_other_files_are_not(text: str) -> None:
    assert foreign_file(text) is None


def test_no_program_of_ours_is_taken_for_another() -> None:
    home = Path(__file__).parents[3]
    for path in (*home.glob("programs/**/*.v2"), *home.glob("tests/conformance/**/*.v2")):
        assert foreign_file(path.read_text(encoding="utf-8")) is None, path
