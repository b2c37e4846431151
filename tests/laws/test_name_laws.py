"""Every word of the tables as a name, in every place where a name may stand.

The law: a program does not know what its variables are called. With any word in the place of `zz` it is read, printed,
checked and run as before; only the words of RESERVED are refused, in every place.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import NamedTuple

import pytest

from tests.examples import USUAL, some
from tests.language.running import run
from vrs_cli.errors import WordAsName
from vrs_cli.language.analysis.analyzer import analyze, check_line
from vrs_cli.language.text.ast import FUNCTION_NAMES, Program
from vrs_cli.language.text.parser import parse_file, parse_prompt, parse_step
from vrs_cli.language.text.printer import print_file
from vrs_cli.language.words.functions import FUNCTIONS, LINKS
from vrs_cli.language.words.instructions import (
    CONNECTIVES,
    CONTROL,
    INSTRUCTIONS,
    OPERATOR_WORDS,
    RELATIONS_OF_VAL,
    RESERVED,
)
from vrs_cli.language.words.monitor import COMMANDS
from vrs_cli.language.words.word import SORT_WORDS
from vrs_cli.values.diagnostics import LineRefused, Severity

TABLES = (COMMANDS, INSTRUCTIONS, CONTROL, FUNCTIONS, LINKS, SORT_WORDS, RELATIONS_OF_VAL, CONNECTIVES, OPERATOR_WORDS)
WORDS = sorted({name.lstrip("#$") for table in TABLES for name in table if name.lstrip("#$")[0].isalpha()})

SOME_WORDS = WORDS[:: max(USUAL // some(USUAL), 1)]  # of neighbours in the alphabet one stands for the others

REALS = """\
.PROGRAM main()
    zz = 2
    zz = zz+zz*-zz
    zz[1] = zz
    zz[zz+3] = zz[1]
    zz[2,zz+3] = ABS(zz[1])+zz[1]
    TYPE zz, /F6.2, zz, zz[1], zz[2,1], (zz), NOT zz
    IF zz THEN
        TYPE "true"
    END
    IF zz == zz AND zz < 0 GOTO 10
    TYPE "passed over"
10  IF zz EQ zz THEN 20
20  FOR zz = 1 TO 5 STEP 2
        TYPE zz
    END
    FOR i = zz TO zz+zz STEP zz
        TYPE i
    END
    WHILE zz > 3 DO
        zz = zz-1
    END
    DO
        zz = zz+1
    UNTIL zz > 5
    CASE zz OF
    VALUE 1, zz:
        TYPE "value", zz
    ANY
        TYPE "any"
    END
    DELAY zz
    SIGNAL zz, -zz
    BITS zz, zz = zz
    TIMER zz = zz
    WAIT SIG(zz) OR zz
    SPEED zz, zz MMPS
    FINE zz
    DRIVE 1, zz, zz
    READY AT zz
    NEST IN zz
    PROMPT zz
    PROMPT "which", zz, $zz
    PARAMETER HAND.TIME = zz+0
    TYPE DEFINED(zz), LAST(zz[]), MAX(zz, 1, zz), TAS(zz, 8), zz
    DECOMPOSE zz[1] = TRANS()
    SETI zz = zz/2
    TYPE zz, zz[3]
    zz = 1
    CALL inner(zz, (zz), zz[1], zz[], zz)
    TYPE zz
    IFSIG zz, zz THEN 30
30  RETURN zz
    BASE zz,, zz, zz
.END
.PROGRAM inner(a, b, c, d[], e)
    a = b+1
.END
"""

PLACES = """\
.PROGRAM main()
    SET a = TRANS(0, 0, 1)
    SET zz = TRANS(1, 2, 3)
    SET zz[1] = zz
    SET a:zz[2] = zz:zz[1]
    MOVE zz
    MOVES zz:zz[1]:RZ(90) AT 5
    APPRO zz, 50 IN 2
    SET b = SHIFT(zz BY DX(zz), 2)
    SET zz = FRAME(zz, b, a, zz)
    HERE zz
    POINT zz = b
    TOOL zz
    SHIFT zz BY 5, -5
    FRAME zz = zz, b, a
    INVERSE zz = zz
    IF DEFINED(zz) THEN
        MOVET INVERSE(zz):zz, 1
    END
    CALL inner(zz, zz[1])
    TYPE DISTANCE(zz, zz), DX(zz)
.END
.PROGRAM inner(a, b)
    SET a = b
.END
"""

SIGILS = """\
.PROGRAM main(a)
    $zz = "a"+"b"
    $zz[1] = $zz+$zz
    TYPE $zz, $zz[1], LEN($zz), $MID($zz, 1, 1)
    PROMPT $zz
    PROMPT "who", $zz
    $b = $DECODE($zz, " ", 0)
    IF $zz == $zz THEN
        $zz = $ENCODE(/F6.2, 5, $zz)
    END
    SET #zz = #PPOINT(0, -90, 90)
    SET #zz[1] = #zz
    HERE #zz
    MOVE #zz
    DECOMPOSE x[1] = #zz
    $c = "inner"
    CALLS $c($zz, #zz)
.END
.PROGRAM inner($a, #b)
    TYPE $a
.END
"""

OWN = """\
.PROGRAM main()
    AUTO zz
    LOCAL $zz
    GLOBAL #zz[]
    CALL inner(1, TRANS(), "s")
    zz = 7
    TYPE zz
    CALL second
    CALL third
.END
.PROGRAM inner(zz, b, $zz)
    TYPE zz, $zz
    zz = 3
.END
.PROGRAM second()
    LOCAL REAL zz[], x
    GLOBAL LOC q, #zz[]
    zz[2] = 8
    SET #zz[1] = #PPOINT()
.END
.PROGRAM third()
    GLOBAL DOUBLE x, zz
    zz = 2
    CALL fourth
    TYPE zz
.END
.PROGRAM fourth()
    GLOBAL zz
    TYPE zz
    zz = zz+1
.END
"""

PROGRAMS = """\
.PROGRAM main()
    TYPE "main"
    CALL zz
    CALL zz(1)
    GOSUB zz
    $zz = "zz"
    CALLS $zz
    REACT 1001, zz, 5
    REACTI 1002, zz(x), 5
    REACTE zz
    EXECUTE 2 zz(3), 1, 1
    EXECUTE zz, 2
    PCEXECUTE zz
.END
.PROGRAM zz(a)
    IF DEFINED(a) THEN
        TYPE a
    END
.END
"""
TEXTS = (REALS, PLACES, SIGILS, OWN)
ANSWERS = ("3", "4, word", "a line", "another", "word")
RUN = {*FUNCTION_NAMES, *(word.lower() for word in WORDS[::20])}  # the others are only read: a run costs more


def renamed(text: str, word: str) -> str:
    return re.sub(r"\bzz\b", word.lower(), text)


class Read(NamedTuple):
    """A text as programs, its canonical form, and code and line of all that is said of it but for words as names."""

    programs: Mapping[str, Program]
    printed: str
    findings: list[tuple[int, int]]


def read(text: str) -> Read:
    file, refused = parse_file(text)
    assert not refused, refused
    programs = {part.key: part for part in file.parts if isinstance(part, Program)}
    found = (one for program in programs.values() for one in analyze(program, {}, programs).diagnostics)
    codes = sorted((one.code, one.span.line) for one in found if one.code != WordAsName.code)
    return Read(programs, print_file(file), codes)


def happened(text: str) -> tuple[str, list[str]]:
    done = run(text, ANSWERS)
    return done.typed, [type(event).__name__ for event in done.events]


BEFORE = {text: read(text) for text in TEXTS}
AS_BEFORE = {text: happened(text) for text in TEXTS}


def test_the_texts_are_canonical_and_end_well() -> None:
    for text in TEXTS:
        assert BEFORE[text].printed == text
        assert AS_BEFORE[text][1][-1] == "ProgramCompleted"


@pytest.mark.parametrize("word", [word for word in SOME_WORDS if word not in RESERVED])
def test_a_program_does_not_know_what_its_variables_are_called(word: str) -> None:
    for text in TEXTS:
        mine = renamed(text, word)
        now = read(mine)
        assert now.printed == mine
        assert now.findings == BEFORE[text].findings
        if word.lower() in RUN:
            assert happened(mine) == AS_BEFORE[text]


@pytest.mark.parametrize("word", SOME_WORDS)
def test_every_word_is_the_name_of_a_program(word: str) -> None:
    mine = renamed(PROGRAMS, word)
    assert read(mine).printed == mine
    assert read(mine).findings == []
    if word.lower() in RUN or word in RESERVED:
        assert happened(mine) == happened(PROGRAMS)


# lines in which `zz` would be a variable
LINES = (
    "zz = 1",
    "zz[1] = 1",
    "x = zz*2",
    "x = zz",
    "MOVE zz",
    "SET zz = HERE",
    "TYPE 1, zz",
    "IF zz THEN",
    "FOR zz = 1 TO 2",
    "AUTO zz",
    "CALL p(zz)",
    "x[zz] = 1",
    "PROMPT zz",
)


@pytest.mark.parametrize("word", sorted(RESERVED))
def test_a_word_of_the_core_is_refused_everywhere(word: str) -> None:
    constant = word in FUNCTIONS
    for line in LINES if not constant else ("zz = 1", "SET zz = HERE", "FOR zz = 1 TO 2", "AUTO zz", "PROMPT zz"):
        assert refused(renamed(line, word)), line
    assert refused(renamed(".PROGRAM p(zz)", word))


def refused(line: str) -> bool:
    try:
        parsed = parse_prompt(line) if line.startswith(".") else parse_step(line).statement
    except LineRefused:
        return True
    assert parsed is not None
    found = check_line(parsed, in_program=not line.startswith("."))
    return any(one.severity is Severity.ERROR for one in found)
