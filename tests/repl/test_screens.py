"""What is seen on real terminals, wide and narrow."""

from __future__ import annotations

import os
import signal
from pathlib import Path

import pytest

from tests.repl.screens import Screen, needs_tmux, screen

pytestmark = needs_tmux
TOOLBAR = "100 % / 100 %"
SIZES = ((80, 24), (120, 40))


def typed(shell: Screen, *lines: str) -> None:
    """Each line, once the prompt is there again."""
    for line in lines:
        shell.wait_for(TOOLBAR)
        shell.type(line, "Enter")
        shell.wait(lambda rows, line=line: any(row.endswith(line) for row in rows))  # type: ignore[misc]


@pytest.mark.parametrize(("columns", "rows"), SIZES)
def test_values_and_mistakes_are_shown(tmp_path: Path, columns: int, rows: int) -> None:
    with screen(tmp_path, columns=columns, rows=rows) as shell:
        typed(shell, "DRIVE 1, 30", "a = 5", "a", "a*2", "a == 5")
        shown = shell.wait_for("a == 5          -1 (TRUE)")
        assert {"a                5", "a*2              10", "== compares; a = 5 assigns"} < set(shown)
        shell.wait_for(TOOLBAR)
        shell.type("MOVES part, 50", "Enter")
        shown = shell.wait_for("IN dt])")
        assert "(the form is MOVES location [AT t | IN dt])" in " ".join(row.rstrip() for row in shown)
        assert ".MOVES part, 50" in shown
        shell.type("BSpace")
        shell.wait(lambda after: not any("form is" in row for row in after))


@pytest.mark.parametrize(("columns", "rows"), SIZES)
def test_what_was_typed_comes_back(tmp_path: Path, columns: int, rows: int) -> None:
    with screen(tmp_path, columns=columns, rows=rows) as shell:
        typed(shell, ".PROGRAM fetch(a)", "MOVE a", ".END", "SET part = TRANS(500,150,-100,90,90,0)", "count = 3")
        typed(shell, ".PROGRAM half", "x = 1", "x")
        os.kill(shell.process, signal.SIGKILL)
        shell.wait_for_end()
    with screen(tmp_path, columns=columns, rows=rows) as shell:
        asked = " ".join(row.strip() for row in shell.wait_for("(Y/N)?"))
        assert ": programs fetch, half, 1 location, 1 real. Load (Y/N)?" in asked
        shell.type("Y", "Enter")
        shell.wait_for("Loaded, and not stored yet: STORE file stores all")
        typed(shell, "EXIT")
        asked_again = shell.wait_for("Leave without storing (Y/N)?")
        assert "Not stored: programs fetch, half; location part; real count. STORE file stores" in asked_again
        shell.type("N", "Enter")
        typed(shell, "STORE all", "EXIT")
        shell.wait_for_end()
    stored = (tmp_path / "all.v2").read_text()
    assert ".PROGRAM fetch(a)\n    MOVE a\n.END" in stored
    assert "count            3" in stored
    assert list((tmp_path / "state" / "vrs" / "recovery").iterdir()) == []


def test_a_window_that_is_closed_loses_nothing(tmp_path: Path) -> None:
    with screen(tmp_path) as shell:
        typed(shell, "count = 3", "count")
        shell.wait_for("count            3")
        shell.close_window()
    (left,) = (tmp_path / "state" / "vrs" / "recovery").glob("*.v2")
    assert "count            3" in left.read_text()
