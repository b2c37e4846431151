"""Typing a program line by line."""

import pytest

from vrs_cli.interfaces.editor.buffer import ProgramBuffer, closes_entry, depth, opens_entry


@pytest.mark.parametrize(
    "line", [".PROGRAM pick", ".program pick(a, b)", "  .PROGRAM x", ".PROGRAM", ".LOCATIONS", ".reals"]
)
def test_headers(line: str) -> None:
    assert opens_entry(line)


@pytest.mark.parametrize("line", ["PROGRAM pick", ".PROG x", ".PROGRAMME x", ".END", "", ".5"])
def test_other_lines_are_no_headers(line: str) -> None:
    assert not opens_entry(line)


@pytest.mark.parametrize(
    ("line", "ends"), [(".END", True), (" .end ; done", True), ("END", False), (".ENDE", False), ("", False)]
)
def test_the_end(line: str, ends: bool) -> None:
    assert closes_entry(line) is ends


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


@pytest.mark.parametrize("line", ["end = 5", "value[2] = 1", "any=3", "end [1] = 2"])
def test_a_variable_begins_or_ends_no_block(line: str) -> None:
    assert depth(["CASE x OF", "VALUE 1:", line]) == 1
    entry = ProgramBuffer(".PROGRAM demo", ["    CASE x OF", "    VALUE 1:"])
    entry.add(line)
    assert entry.lines[-1] == f"        {line}"


def test_blocks_are_indented_and_their_words_moved_back() -> None:
    entry = ProgramBuffer(".PROGRAM demo")
    for line in ("FOR i = 1 TO 3", "IF i > 1 THEN", "  MOVE a", "ELSE", "MOVE b", "END", "end", "STOP", ""):
        entry.add(line)
    assert entry.source.splitlines() == [
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
    entry = ProgramBuffer(".PROGRAM demo")
    assert (entry.prompt, entry.indent) == ("    1.? ", "    ")
    entry.add("WHILE TRUE DO")
    assert (entry.prompt, entry.indent) == ("    2.? ", "        ")


def test_a_section_is_kept_as_it_is_typed() -> None:
    entry = ProgramBuffer(".REALS")
    assert not entry.is_program
    entry.add("  for 2")
    entry.add("count 12")
    assert (entry.indent, entry.source) == ("", ".REALS\nfor 2\ncount 12\n.END\n")
