"""What is seen on real terminals, wide and narrow."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.repl.screens import needs_tmux, screen

pytestmark = needs_tmux
SIZES = pytest.mark.parametrize(("columns", "rows"), [(80, 24), (120, 40)])


@SIZES
def test_a_mistake_is_told_whole_and_until_the_line_changes(tmp_path: Path, columns: int, rows: int) -> None:
    with screen(tmp_path, columns=columns, rows=rows) as shell:
        shell.wait_for("t 0.00 s")
        shell.type("MOVES part, 50", "Enter")
        shown = shell.wait_for("IN dt])")
        assert "(the form is MOVES location [AT t | IN dt])" in " ".join(row.rstrip() for row in shown)
        assert shown[1] == ".MOVES part, 50"
        shell.type("BSpace")
        shell.wait(lambda after: not any("form is" in row for row in after))
