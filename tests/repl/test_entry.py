"""Typing a program line by line."""

import pytest

from vrs_cli.repl.entry import ProgramEntry, closes_program, depth, opens_program


@pytest.mark.parametrize("line", [".PROGRAM pick", ".program pick(a, b)", "  .PROG x", ".PROGRAM"])
def test_headers(line: str) -> None:
    assert opens_program(line)


@pytest.mark.parametrize("line", ["PROGRAM pick", ".PROGRAMME x", ".END", "", ".5"])
def test_other_lines_are_no_headers(line: str) -> None:
    assert not opens_program(line)


@pytest.mark.parametrize(("line", "ends"), [(".END", True), (" .end ; done", True), ("END", False), (".ENDE", False)])
def test_the_end(line: str, ends: bool) -> None:
    assert closes_program(line) is ends


@pytest.mark.parametrize(
    ("lines", "open_blocks"),
    [
        (["IF a > 2 THEN"], 1),
        (["IF a > 2 GOTO 10"], 0),
        (["IF a THEN ; DO"], 1),
        (['IF $a == "THEN" GOTO 10'], 0),
        (["10 WHILE TRUE DO"], 1),
        (["DO"], 1),
        (["DO", "UNTIL x"], 0),
        (["FOR i = 1 TO 3", "IF a THEN", "END"], 1),
        (["CASE n OF", "VALUE 1:", "ANY"], 1),
        (["END", "END", "FOR i = 1 TO 2"], 1),
        (["DOOR = 1", "FORCE = 2"], 0),
    ],
)
def test_open_blocks(lines: list[str], open_blocks: int) -> None:
    assert depth(lines) == open_blocks


def test_blocks_are_indented_and_their_words_moved_back() -> None:
    entry = ProgramEntry(".PROGRAM demo")
    for line in ("FOR i = 1 TO 3", "IF i > 1 THEN", "  MOVE a", "ELSE", "MOVE b", "END", "end", "STOP", ""):
        entry.add(line)
    assert entry.text.splitlines() == [
        ".PROGRAM demo",
        "    FOR i = 1 TO 3",
        "        IF i > 1 THEN",
        "            MOVE a",
        "        ELSE",
        "            MOVE b",
        "        END",
        "    end",
        "    STOP",
        "",
        ".END",
    ]


def test_the_prompt_counts_the_steps() -> None:
    entry = ProgramEntry(".PROGRAM demo")
    assert (entry.prompt, entry.indent) == ("    1.? ", "    ")
    entry.add("WHILE TRUE DO")
    assert (entry.prompt, entry.indent) == ("    2.? ", "        ")
