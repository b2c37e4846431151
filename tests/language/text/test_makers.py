"""Files in the languages of other makers are named at their first tell-tale line."""

from __future__ import annotations

from pathlib import Path

import pytest

from vrs_cli.interfaces.inspection import inspect
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.language.text.makers import foreign_file
from vrs_cli.language.text.parser import parse_file

KAWASAKI = ".PROGRAM pg1()\n  SPEED 100 ALWAYS\n  JMOVE a\n  LMOVE b\n  SWAIT 1001\n.END\n.TRANS\na 0 0 0 0 0 0\n.END\n"
KUKA = "&ACCESS RVP\nDEF main( )\n;FOLD INI\nPTP HOME\nLIN {X 10}\nEND\n"
ABB = "MODULE M\n  PROC main()\n    MoveJ p1, v100, fine, tool0;\n  ENDPROC\nENDMODULE\n"
UNIVERSAL = "def prog():\n  movej([0,0,0,0,0,0], a=1.4)\n  movel(p[0,0,0,0,0,0])\nend\n"
PENDANT = "/PROG A\n/ATTR\n/MN\n 1:J P[1] 100% FINE ;\n"
KAREL = "PROGRAM move\n-- a comment\nVAR\nBEGIN\nMOVE TO p1\nEND move\n"


@pytest.mark.parametrize(
    ("text", "language", "line"),
    [
        (KAWASAKI, "Kawasaki AS", 3),
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
    for path in (*home.glob("programs/**/*.v2"), *home.glob("tests/programs/**/*.v2")):
        assert foreign_file(path.read_text(encoding="utf-8")) is None, path
