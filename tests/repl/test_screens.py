"""What is seen on real terminals, wide and narrow."""

from __future__ import annotations

import os
import re
import shutil
import signal
from collections import Counter
from pathlib import Path

import pytest

from tests.examples import in_full
from tests.repl.screens import Screen, needs_tmux, screen

pytestmark = needs_tmux
TOOLBAR = "^X ABORT"
PROMPT = re.compile(r"(\.|\*| *\d+\.\?) *")
SIZES = ((80, 24), (120, 40))
SIZES_OF_SHOW = ((80, 24), (160, 50))
_turns: Counter[tuple[tuple[int, int], ...]] = Counter()


def sized(sizes: tuple[tuple[int, int], ...] = SIZES) -> pytest.MarkDecorator:
    """Try a screen of each size in the long run; else of one, by turns, as each takes seconds."""
    _turns[sizes] += 1
    return pytest.mark.parametrize(("columns", "rows"), sizes if in_full() else [sizes[_turns[sizes] % len(sizes)]])


def at_prompt(shell: Screen) -> list[str]:
    """The rows with an empty prompt. What is typed before it is there, the terminal shows by itself."""
    return shell.wait(lambda rows: any(map(PROMPT.fullmatch, rows)) and any(TOOLBAR in row for row in rows))


def typed(shell: Screen, *lines: str) -> None:
    """Each line, once the prompt is there again. A picture may fill the screen: then SHOW is not seen on it."""
    for line in lines:
        at_prompt(shell)
        shell.type(line, "Enter")
        if line != "SHOW":
            shell.wait(lambda rows, line=line: any(row.endswith(line) for row in rows))  # type: ignore[misc]


def opened(shell: Screen, line: str) -> None:
    """A line whose answer takes the whole screen, on which it may not be seen any more."""
    at_prompt(shell)
    shell.type(line, "Enter")


def by_sh(script: str) -> tuple[str, ...]:
    """The shell as `"$@"` of a script."""
    return "sh", "-c", script, "sh"


@sized()
def test_values_and_mistakes_are_shown(tmp_path: Path, columns: int, rows: int) -> None:
    with screen(tmp_path, columns=columns, rows=rows) as shell:
        typed(shell, "DRIVE 1, 30", "a = 5", "a", "a*2", "a == 5")
        shown = shell.wait_for("a == 5          -1 (TRUE)")
        assert {"a                5", "a*2              10", "== compares; a = 5 assigns"} < set(shown)
        typed(shell, "MOVES part, 50")
        shown = shell.wait_for("^")
        assert "(the form is MOVES location [AT t | IN dt];" in " ".join(row.rstrip() for row in shown)
        assert ".MOVES part, 50" in shown
        shell.type("Up")
        shell.wait(lambda rows: sum(row.startswith(".MOVES part, 50") for row in rows) == 2)


@sized()
def test_a_line_is_helped_while_it_is_typed(tmp_path: Path, columns: int, rows: int) -> None:
    """The history gives the rest of a line, and lines that begin so; the form of a word stands below."""
    with screen(tmp_path, columns=columns, rows=rows) as shell:
        typed(shell, "count = 40+2", "count = 0", "DRIVE 1, 10", "other = 1", "DRIVE 2, -5")
        at_prompt(shell)
        shell.type("count = 4")
        shell.wait(lambda rows: sum(row.startswith(".count = 40+2") for row in rows) == 2)
        shell.type("Right", "Enter")
        typed(shell, "count")
        shell.wait_for("count            42")
        at_prompt(shell)
        shell.type("DRI")
        shell.wait_for("DRIVE joint, change[, speed]")  # in the menu
        shell.type("Up", "Up")
        shell.wait(lambda rows: rows[-2].startswith(" DRIVE joint, change[, speed] [AT t | IN dt] | turn one"))
        shell.wait(lambda rows: sum(row.startswith(".DRIVE 1, 10") for row in rows) == 2)
        shell.type("F1")
        shell.wait_for("Example: DRIVE 1, -30, 50")
        shown = shell.wait(lambda rows: rows[-1].startswith(" t "))
        assert all(len(row) <= columns for row in shown)


@sized()
def test_see_completes_and_shows_forms(tmp_path: Path, columns: int, rows: int) -> None:
    with screen(tmp_path, columns=columns, rows=rows) as shell:
        opened(shell, "SEE pick")
        shell.wait_for("F1 help")
        shell.type("MOV", "Tab")
        shell.wait_for("MOVEST")
        shell.type("Tab", "Tab", "Enter", " part")
        shell.wait_for("1 MOVES part")
        shell.wait(lambda rows: rows[-2].startswith(" MOVES location [AT t | IN dt] | straight-line motion"))
        shell.type("F1")
        shell.wait_for("Example: MOVES part")
        shell.type("C-q", "C-q")
        at_prompt(shell)


@pytest.mark.long
@sized()
def test_a_plot_is_seen_whole(tmp_path: Path, columns: int, rows: int) -> None:
    with screen(tmp_path, columns=columns, rows=rows) as shell:
        typed(shell, "DRIVE 1, 60", "PLOT")
        shown = [row.rstrip() for row in shell.wait_for("JT6 0.000 to 0.000")]
        assert "Joints [deg]" in shown
        assert max(map(len, shown)) <= columns


@sized()
def test_what_is_longer_than_the_screen_is_paged(tmp_path: Path, columns: int, rows: int) -> None:
    """And the keys are those of vi and the colours the user's, where config.toml says so."""
    if shutil.which("less") is None:
        pytest.skip("there is no less")
    (tmp_path / "config" / "vrs").mkdir(parents=True)
    (tmp_path / "config" / "vrs" / "config.toml").write_text('keys = "vi"\n[colours]\nnumber = "#c06000"\n')
    with screen(tmp_path, columns=columns, rows=rows, more={"PAGER": "less", "LESS": "FRX"}) as shell:
        typed(shell, "HELP MOVE")
        shell.wait_for("Example: MOVE part")  # as it is
        opened(shell, "HELP FLOW")
        shell.wait_for("Input, output and program flow")
        first = shell.wait(lambda rows: rows[-1].startswith(":"))
        assert not any("(END)" in row for row in first)
        shell.type("G")
        shell.wait_for("(END)")
        shell.type("q")
        at_prompt(shell)
        shell.type("LISTR 6*7")
        shell.wait_for("INSERT")
        shell.type("Escape")
        shell.wait_for("NORMAL")
        shell.type("x", "a", "8", "Enter")
        shell.wait_for("6*8              48")
        assert any("\x1b[38;2;192;96;0m" in row and "48" in row for row in shell.rows("-e"))


@pytest.mark.long
@sized()
def test_help_and_tables_fit_the_screen(tmp_path: Path, columns: int, rows: int) -> None:
    with screen(tmp_path, columns=columns, rows=rows, more={"PAGER": ""}) as shell:
        asked = {
            "HELP KEYS": "Ctrl-Z",
            "MOVES?": "Straight-line motion to a location.",
            "? appro": "Motion to a distance [mm]",
            "?": "HELP",
            "DRIVE 1, 30": " t 0.67",
            "TIMELINE": "DRIVE 1, 30",
            "HISTORY 2": "5  DRIVE 1, 30",
            ".PROGRAM p": "1.?",
            "MOVES? ": "Straight-line motion to a location.",
            ".END": "Program p",
            "EDIT p": "1.?",
            "? ": "next step; end inserting",
        }
        for line, answer in asked.items():
            opened(shell, line.strip())
            shell.wait_for(answer)
            at_prompt(shell)
            assert max(len(row.rstrip()) for row in shell.rows("-J")) <= columns
            shell.type("C-l")


@sized()
def test_what_goes_into_a_pipe_is_not_paged(tmp_path: Path, columns: int, rows: int) -> None:
    piped = 'echo "HELP FLOW" | "$@" | cat; echo "that was all"; read -r again'
    with screen(
        tmp_path, columns=columns, rows=rows, more={"PAGER": "less", "LESS": "FRX"}, under=by_sh(piped)
    ) as shell:
        shown = shell.wait_for("that was all")
        assert not any(row.startswith(":") or "(END)" in row for row in shown)


COUNTING = """\
.PROGRAM count
    n = 0
    DO
        n = n+1
        IF n MOD 20000 == 0 THEN
            TYPE n
        END
    UNTIL SIG(1001)
.END
"""


def counted(rows: list[str]) -> int:
    """How far COUNTING has come, as it is seen; 0 before it is."""
    return max((int(row) for row in rows if row.strip().isdigit()), default=0)


@sized()
def test_ctrl_z_gives_the_shell_before_back_and_fg_the_line(tmp_path: Path, columns: int, rows: int) -> None:
    """At the prompt, what was typed is there again; a program that is run goes on."""
    (tmp_path / "count.v2").write_text(COUNTING)
    jobs = 'set -m; "$@"; while echo "stopped by $(kill -l $?)"; do read -r again; fg; done'
    with screen(tmp_path, "count.v2", columns=columns, rows=rows, under=by_sh(jobs)) as shell:
        at_prompt(shell)
        shell.type("count = 40+", "C-z")
        shell.wait_for("stopped by TSTP")
        shell.type("Enter")
        shell.wait(lambda rows: TOOLBAR in rows[-1] and any(row.rstrip() == ".count = 40+" for row in rows))
        shell.type("2", "Enter")
        typed(shell, "count")
        shell.wait_for("count            42")
        opened(shell, "EXECUTE count")
        shell.wait(lambda rows: counted(rows) > 0)
        shell.type("C-z")
        last = counted(shell.wait(lambda rows: "stopped by TSTP" in rows[-1]))
        shell.type("Enter")
        shell.wait(lambda rows: counted(rows) > last)
        shell.type("C-c")
        shell.wait_for("Program stopped at count, step")
        at_prompt(shell)


@pytest.mark.long
@sized()
def test_files_are_those_of_the_folder_that_cd_names(tmp_path: Path, columns: int, rows: int) -> None:
    (tmp_path / "cells").mkdir()
    (tmp_path / "cells" / "fetch.v2").write_text(".PROGRAM fetch\n    BREAK\n.END\n")
    with screen(tmp_path, columns=columns, rows=rows) as shell:
        typed(shell, "LOAD fetch")
        shell.wait_for("*Nonexistent file*")
        for line, folder in (("CD cells", tmp_path / "cells"), ("PWD", tmp_path / "cells"), ("CD", tmp_path)):
            typed(shell, line)
            shown = at_prompt(shell)
            answer = "".join(row.rstrip() for row in shown[shown.index("." + line) + 1 :])
            assert answer.startswith(f"{folder}.")
        typed(shell, "CD cells", "LOAD fetch")
        shell.wait_for("fetch.v2 loaded: fetch")


@pytest.mark.long
@sized()
def test_newcomers_find_the_words(tmp_path: Path, columns: int, rows: int) -> None:
    """Wrong words are mended at the prompt; what was pasted runs; names are cut short; the session is taken down."""
    with screen(tmp_path, columns=columns, rows=rows) as shell:
        typed(shell, "LOG s.txt")
        shell.wait_for("s.txt takes down")
        at_prompt(shell)
        for wrong, ours in (('PRINT "a"', "TYPE"), ("HOME", "READY"), ("x := 3", "x = 5 assigns"), ("# a", "with ;")):
            typed(shell, wrong)
            shell.wait(lambda rows, ours=ours: ours in " ".join(rows))  # type: ignore[misc]
        at_prompt(shell)  # from now on a paste is taken as one
        shell.paste('.PROGRAM pick\nMO part\nTYPE "there"\n.END\n.LOCATIONS\npart 500 150 -100 90 90 0\n.END')
        shell.type("Enter")
        shown = shell.wait_for("Program pick: 2 steps")
        assert not [row for row in shown if "warning" in row]
        typed(shell, "EX")
        shell.wait_for("there")
        typed(shell, "EX pi", "HISTORY 3", "LOG")
        shell.wait_for("s.txt is complete")
        typed(shell, "PWD")
        shell.wait_for(str(tmp_path)[: columns - 1])
    log = (tmp_path / "s.txt").read_text().splitlines()
    assert log.count("there") == 2
    assert log[-1] == ".LOG"


CELL = """\
.PROGRAM pick
    TYPE "waiting for a part"
    WAIT SIG(1001)
    TYPE "part is there"
    DRIVE 1, 90, 30
    BREAK
    TYPE "never reached"
.END
.PROGRAM count
    PROMPT "How many? ", n
    TYPE n, " parts"
.END
.PROGRAM swing
    k = 0
    DO
        k = k+1
        TYPE "swing", k
        WAIT.EVENT , 0.3
    UNTIL FALSE
.END
"""


def begun(tmp_path: Path) -> tuple[str, ...]:
    (tmp_path / "cell.v2").write_text(CELL)
    return "shell", "--realtime", "1", "cell.v2"


@pytest.mark.long
def test_a_program_is_ruled_from_the_living_prompt(tmp_path: Path) -> None:
    """It waits for SIGNAL, is slowed by SPEED, and stopped by ABORT."""
    with screen(tmp_path, *begun(tmp_path)) as shell:
        typed(shell, "EXECUTE pick")
        shell.wait_for("waiting for a part")
        typed(shell, "STATUS")
        shell.wait_for("pick running, step 2")
        typed(shell, "DRIVE 2, 10")
        shell.wait_for("DRIVE has to wait until the program stops")
        shell.type("SPEED 10", "Enter")
        shell.wait_for("10 % / 100 %")
        shell.type("SIGNAL 1001", "Enter")
        shell.wait_for("part is there")
        rows = shell.wait_for("moves until")
        assert rows[-1].startswith(" t ")
        shell.type("ABORT", "Enter")
        shell.wait_for("Program stopped at pick, step 5")
        rows = shell.wait(lambda rows: any(row.rstrip() == "." for row in rows))
        shown = [row.rstrip() for row in rows]
        at = shown.index("*ABORT")
        assert shown[at : at + 4] == ["*ABORT", "(ABORTED)", "Program stopped at pick, step 5", "."]
        assert not any("never reached" in row for row in rows)


@pytest.mark.long
def test_what_programs_type_and_ask_does_not_tear_the_line(tmp_path: Path) -> None:
    with screen(tmp_path, *begun(tmp_path)) as shell:
        typed(shell, "PCEXECUTE swing")
        shell.wait_for("swing 1")
        shell.type("EXECUTE count", "Enter")
        rows = shell.wait(lambda rows: rows[-1].startswith("How many?") or any(row == "How many?" for row in rows))
        last = max(int(row.split()[1]) for row in rows if row.startswith("swing "))
        shell.wait_for(f"swing {last + 2}")  # it goes on while the question waits
        shell.type("12")
        shell.wait_for("How many? 12")
        shell.wait_for(f"swing {last + 4}")
        shell.type("Enter")
        shell.wait_for("12 parts")
        shell.wait_for("Program completed")
        shell.type("LISTR 6*")
        shell.wait_for(".LISTR 6*")
        shell.wait_for(f"swing {last + 8}")
        shell.type("7", "Enter")
        rows = shell.wait_for("6*7              42")
        assert any(row.rstrip() == ".LISTR 6*7" for row in rows)
        shell.type("EXECUTE pick", "Enter")
        shell.wait_for("waiting for a part")
        shell.type(
            "LISTR", "C-c", "C-c"
        )  # clears the line, stops the program: the prompt between them need not be there
        shell.wait_for("Program stopped at pick, step 2")


@pytest.mark.long
@sized()
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
        assert "Not stored: programs fetch, half; location part; real count. STORE file stores" in " ".join(asked_again)
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


# --- the arm --------------------------------------------------------------------------------------------------------

BRAILLE = {chr(code) for code in range(0x2801, 0x2900)}


def drawn(rows: list[str]) -> set[tuple[int, int]]:
    """The cells with dots."""
    return {(r, c) for r, row in enumerate(rows) for c, mark in enumerate(row) if mark in BRAILLE}


@pytest.mark.long
@sized(SIZES_OF_SHOW)
def test_show_fits_the_screen_with_the_prompt_below(tmp_path: Path, columns: int, rows: int) -> None:
    with screen(tmp_path, columns=columns, rows=rows) as shell:
        typed(shell, "DRIVE 3, 60 AT 0", "DRIVE 1, 90 AT 1", "SHOW AT 1.2")
        seen = shell.wait_for("target")
        first = next(k for k, row in enumerate(seen) if row.startswith("At 1.200 s  X 397.5"))
        last = next(k for k, row in enumerate(seen) if "mm   • reach   • past   • planned   • target" in row)
        assert last - first == min(rows - 8, 16 if columns == 80 else 42) - 1
        cells = drawn(seen)
        assert min(c for _, c in cells) < columns // 8
        assert max(c for _, c in cells) > columns * 7 // 8


@pytest.mark.long
def test_letters_where_the_terminal_has_no_others(tmp_path: Path) -> None:
    with screen(tmp_path, more={"LC_ALL": "C"}) as shell:
        typed(shell, "DRIVE 3, 60", "SHOW")
        seen = shell.wait_for("' reach   . past")
        assert not drawn(seen)
        assert any("#" in row and "O" in row for row in seen)


@sized(SIZES_OF_SHOW)
def test_show_lives_while_the_arm_moves(tmp_path: Path, columns: int, rows: int) -> None:
    """It ends by itself when the arm stands; a key ends it before, and the motion goes on."""
    with screen(tmp_path, "shell", "--realtime", "1", columns=columns, rows=rows) as shell:
        typed(shell, "DRIVE 1, 90, 10", "SHOW")
        one = shell.wait(lambda rows: "any other key ends" in rows[-1] and bool(drawn(rows)))
        other = shell.wait(lambda rows: drawn(rows) != drawn(one))
        assert one[-1] == other[-1]
        assert any(row.startswith("from the side (X, Z)") for row in other)
        shell.type("x")
        rows_then = shell.wait_for("moves until")
        assert drawn(rows_then)
        typed(shell, "ABORT", "DRIVE 1, -10", "SHOW")
        shell.wait(lambda rows: rows[-1].startswith(" t ") and any("at rest" in row for row in rows))


@pytest.mark.long
@sized(SIZES_OF_SHOW)
def test_replay_shows_the_arm(tmp_path: Path, columns: int, rows: int) -> None:
    with screen(tmp_path, columns=columns, rows=rows) as shell:
        typed(shell, "DRIVE 3, 60", "DRIVE 1, 90", "SAVE t", "REPLAY t")
        shell.wait(lambda rows: "q quit" in rows[-1] and bool(drawn(rows)))
        ended = shell.wait_for("ended, rate 1")
        assert len(ended) <= rows
        shell.type("r")
        begun = shell.wait_for("playing, rate 1")
        assert drawn(begun) != drawn(ended)
        shell.type("q")
        rows_then = at_prompt(shell)
        assert drawn(rows_then)


@pytest.mark.long
def test_jog_shows_the_arm(tmp_path: Path) -> None:
    with screen(tmp_path) as shell:
        opened(shell, "JOG")
        before = shell.wait(lambda rows: "q leave" in rows[-1] and bool(drawn(rows)))
        shell.type("]", "]", "]", "]", "Up")
        shell.wait(lambda rows: drawn(rows) != drawn(before))
        shell.type("q")
        at_prompt(shell)
