"""LOG: what is typed and answered, in a file."""

from __future__ import annotations

from io import StringIO
from pathlib import Path

import pytest

from tests.repl.afar import local_front_end
from vrs_cli.repl.loop import PlainTerminal

LINES = (".PROGRAM p", 'TYPE "<hallo>", /S', "TYPE $CHR(27)", ".END", "EXECUTE", "MOVE nowhere", "HISTORY 2")
HINT = "HERE nowhere or SET nowhere = TRANS(x, y, z) defines it"


def logged(path: Path, *lines: str) -> str:
    """What the file has after these lines, and what the shell has said."""
    said = StringIO()
    front_end = local_front_end(PlainTerminal(said, []))
    for line in (f"LOG {path}", *(lines or LINES), "LOG", "WHERE"):
        front_end.take(line)
    assert f"{path} is complete" in said.getvalue()
    return path.read_text()


def test_a_transcript_as_text(tmp_path: Path) -> None:
    path = tmp_path / "s.txt"
    assert logged(path).splitlines() == [
        f"{path} takes down what is typed and answered; LOG alone ends it",
        "..PROGRAM p",
        '    1.? TYPE "<hallo>", /S',
        "    2.? TYPE $CHR(27)",
        "    3.? .END",
        "Program p: 2 steps",
        ".EXECUTE",
        "<hallo>^[",
        "Program completed",
        ".MOVE nowhere",
        f"*Undefined value* nowhere ({HINT})",
        ".HISTORY 2",
        "    6  EXECUTE",
        "    7  MOVE nowhere",
        ".LOG",
    ]


def test_a_transcript_as_a_page(tmp_path: Path) -> None:
    page = logged(tmp_path / "s.html")
    assert page.endswith("</pre></body></html>\n")
    assert "&lt;hallo&gt;" in page
    assert f'<span style="color:#eb0000;">*Undefined value* nowhere ({HINT})</span>' in page


@pytest.mark.parametrize(
    ("line", "said"), [("LOG", "no LOG is written"), ("LOG none/s.txt", "cannot be written: no such file")]
)
def test_what_cannot_be_logged(line: str, said: str) -> None:
    stream = StringIO()
    local_front_end(PlainTerminal(stream, [])).take(line)
    assert said in stream.getvalue()
