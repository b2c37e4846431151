"""Test the printer: canonical text, and that parsing it gives the same tree."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product
from pathlib import Path

import pytest
from hypothesis import given

from tests.examples import examples
from tests.language.trees import groups_in, programs, statements, without_places
from vrs_cli.language.text import ast
from vrs_cli.language.text.parser import parse_file, parse_prompt, parse_step
from vrs_cli.language.text.printer import print_file, print_program, program_header, statement_text, step_texts
from vrs_cli.language.words.instructions import INSTRUCTIONS
from vrs_cli.language.words.monitor import COMMANDS
from vrs_cli.language.words.word import COMMAS, GROUPED, Shape, State, Word
from vrs_cli.values.diagnostics import LineRefused

SAMPLES = sorted((Path(__file__).parents[3] / "programs").glob("*.v2"))


# A tree needs parentheses where its operators alone would group otherwise: those that the printer adds come back as
# `grouped`, those of the source are kept. So the first reading may have more of them, the second has the same.


@given(statements)
@examples(400)
def test_a_printed_statement_is_read_as_the_same(statement: ast.Statement) -> None:
    text = statement_text(statement)
    read = parse_step(text).statement
    assert read is not None
    assert without_places(read, groups=False) == without_places(statement, groups=False), text
    assert groups_in(read) >= groups_in(statement), text
    assert statement_text(read) == text
    assert without_places(parse_step(statement_text(read)).statement) == without_places(read), text


@given(programs)
@examples(150)
def test_a_printed_program_is_read_as_the_same(program: ast.Program) -> None:
    text = print_program(program)
    file, diagnostics = parse_file(text)
    assert diagnostics == ()
    assert len(file.parts) == 1
    assert without_places(file.parts[0], groups=False) == without_places(program, groups=False), text
    assert print_file(file) == text


@pytest.mark.parametrize(
    ("typed", "canonical"),
    [
        ("x=1+2*3", "x = 1+2*3"),
        ("X = ( A+B )*c", "x = (a+b)*c"),
        ("x = a - (b - c)", "x = a-(b-c)"),
        ("x = (a*b)+c", "x = (a*b)+c"),
        ("x = a   mod b band 3", "x = a MOD b BAND 3"),
        ("x = not a == b", "x = NOT a == b"),
        ("x = -a ** - b", "x = -a**-b"),
        ("x = a<b and c=<d", "x = a < b AND c <= d"),
        ("move A:b:C at 5", "MOVE a:b:c AT 5"),
        ("appro part,50 in .5", "APPRO part, 50 IN .5"),
        ("base ,,300", "BASE ,, 300"),
        ("speed 20,50 mmps always", "SPEED 20, 50 MMPS ALWAYS"),
        ('type "Text",/f6.2,X,/s', 'TYPE "Text", /F6.2, x, /S'),
        ("x = ^hff + 'a + 1e-3", "x = ^HFF+'a+1E-3"),
        ("set a=shift(B by ,,50)", "SET a = SHIFT(b BY ,, 50)"),
        ("call pick.Up( (A) ,b[] ,, 3)", "CALL pick.up((a), b[],, 3)"),
        ("for I=1 to 10 step 2", "FOR i = 1 TO 10 STEP 2"),
        ("value 1,2 :", "VALUE 1, 2:"),
        ("value 1", "VALUE 1:"),
        ("case X of", "CASE x OF"),
        ('prompt "n? ",N', 'PROMPT "n? ", n'),
        ("prompt $a", "PROMPT $a"),
        ("prompt ,$a,$b", "PROMPT , $a, $b"),
        ("enable cp,Power", "ENABLE CP, POWER"),
        ("parameter profile = scurve", "PARAMETER PROFILE = SCURVE"),
        ("cali", "CALIBRATE"),
        ("react 1001, Foo", "REACT 1001, foo"),
        ("if SIG( 1 ) goto 10", "IF SIG(1) GOTO 10"),
        ("attach( )", "ATTACH ()"),
        ("attach", "ATTACH"),
        ('calls "Pick" (A,5)', 'CALLS "Pick"(a, 5)'),
        ("jmove 0,,B", "JMOVE 0,, b"),
        ("jhere A,b[1]", "JHERE a, b[1]"),
        ('fopen (lun,0) $ip," /REMOTE_PORT",Port', 'FOPEN (lun, 0) $ip, " /REMOTE_PORT", port'),
        ("$s = $mid( $t ,1 , 2)", "$s = $MID($t, 1, 2)"),
    ],
)
def test_canonical_form(typed: str, canonical: str) -> None:
    statement = parse_step(typed).statement
    assert statement is not None
    assert statement_text(statement) == canonical


@pytest.mark.parametrize(
    ("typed", "canonical"),
    [
        ("where from 0 to 5 step .5", "WHERE FROM 0 TO 5 STEP .5"),
        ("where at 2", "WHERE AT 2"),
        ("wh", "WHERE"),
        ("store Cell.v2=pick,place", "STORE Cell.v2 = pick, place"),
        ('load "my file.v2"', 'LOAD "my file.v2"'),
        ("ex pick(a),5,2", "EXECUTE pick(a), 5, 2"),
        ("execute ,5", "EXECUTE , 5"),
        ("move A", "DO MOVE a"),
        ("do n=4", "DO n = 4"),
        ("do", "DO"),
        ("point a=b", "POINT a = b"),
        ("help $chr", "HELP $chr"),
    ],
)
def test_canonical_form_of_commands(typed: str, canonical: str) -> None:
    statement = parse_prompt(typed)
    assert statement is not None
    assert not isinstance(statement, ast.ProgramHeader)
    assert statement_text(statement) == canonical


def test_layout() -> None:
    typed = (
        ".program Demo.1( A,$b) ; shows the layout\n"
        "x=1;first\n"
        "yy=22 ;second\n"
        "; a line of its own\n"
        "for i=1 to 3\n"
        "case i of\n"
        "value 1,2:\n"
        "move a ;there\n"
        "any\n"
        "10 stop\n"
        "end\n"
        "12345 end\n"
        "\n"
        "do\n"
        "until x\n"
        "\n"
        ".end\n"
        "\n"
        "; between\n"
        ".locations\n"
        ";none of these is safe\n"
        "P 1,2,3,4,5,6 ;measured\n"
        "#q = 0 -90 90\n"
        "fine 0.1234567890123 0 0 0 0 0\n"
        ".end\n"
        ".reals\nCount=12\nr 2.50\n.end\n"
        '.strings\n$s "abc"\n.end\n'
    )
    canonical = """\
.PROGRAM demo.1(a, $b) ; shows the layout
    x = 1   ;first
    yy = 22 ;second
    ; a line of its own
    FOR i = 1 TO 3
        CASE i OF
        VALUE 1, 2:
            MOVE a ;there
        ANY
10          STOP
        END
12345 END

    DO
    UNTIL x
.END

; between
.LOCATIONS
;none of these is safe
p                    1.000000     2.000000     3.000000     4.000000     5.000000     6.000000 ;measured
#q                   0.000000   -90.000000    90.000000
fine             0.1234567890123     0.000000     0.000000     0.000000     0.000000     0.000000
.END
.REALS
count            12
r                2.5
.END
.STRINGS
$s               "abc"
.END
"""
    file, diagnostics = parse_file(typed)
    assert diagnostics == ()
    assert print_file(file) == canonical
    assert print_file(parse_file(canonical)[0]) == canonical


@pytest.mark.parametrize("path", SAMPLES, ids=lambda path: path.stem)
def test_formatting_twice_changes_nothing(path: Path) -> None:
    file, _ = parse_file(path.read_text(encoding="utf-8"))
    once = print_file(file)
    again, _ = parse_file(once)
    assert print_file(again) == once
    before, after = ([part for part in one.parts if isinstance(part, ast.Section)] for one in (file, again))
    assert without_places(tuple(after)) == without_places(tuple(before))


def test_parts_of_a_program() -> None:
    file, _ = parse_file(".PROGRAM a(x)\nIF x THEN\nSTOP\nEND\n.END\n")
    program = file.parts[0]
    assert isinstance(program, ast.Program)
    assert program_header(program) == ".PROGRAM a(x)"
    assert step_texts(program) == ("    IF x THEN", "        STOP", "    END")


def test_bad_lines_are_kept() -> None:
    file, _ = parse_file(".PROGRAM a()\nMOVEE  b\n.END\nstray\n")
    assert print_file(file) == ".PROGRAM a()\n    MOVEE  b\n.END\nstray\n"


@pytest.mark.parametrize("line", ["FDELETE a.v2", "FDELETE IF", "FLIST a.v2", "FCOPY new.v2 = old.v2"])
def test_a_file_name_at_the_prompt_stays_as_it_was_typed(line: str) -> None:
    statement = parse_prompt(line)
    assert statement is not None
    assert statement_text(statement) == line


# --- every row with and without what it can do without ---------------------------------------------------------------

SAMPLES_OF = {
    Shape.REAL: "1",
    Shape.STRING: '"s"',
    Shape.LOCATION: "part",
    Shape.PLACE: "part",
    Shape.VARIABLE: "x",
    Shape.REAL_VARIABLE: "x",
    Shape.LOCATION_VARIABLE: "part",
    Shape.STRING_VARIABLE: "$s",
    Shape.PROGRAM: "pick(1)",
    Shape.PROGRAM_TEXT: "$s",
    Shape.LABEL: "10",
    Shape.SIGNALS: "1001",
    Shape.VALUE: "x",
    Shape.ITEM: "x",
    Shape.FILE: "f.v2",
    Shape.BRANCH: "trial",
    Shape.PART: "box",
    Shape.SWITCH: "CP",
    Shape.PARAMETER_NAME: "HAND.TIME",
    Shape.SETTING: "0.1",
    Shape.WORD: "CP",
    Shape.INSTRUCTION: "READY",
    Shape.ELEMENTS: "row[1]",
    Shape.GROUP: "5",
    Shape.UNIT: "lun",
    Shape.TASK: "2",
}
ROWS = [
    pytest.param(row, at_prompt, id=f"{row.name}{' at the prompt' * at_prompt}")
    for table, at_prompt in ((INSTRUCTIONS, False), (COMMANDS, True))
    for row in table.values()
    if row.state is State.SUPPORTED and row.name != "REMARK"
]


def forms(row: Word) -> Iterator[str]:
    """Yield a row's form with every choice of its optional arguments; a comma stands for an omitted one before
    others.
    """
    for chosen in product(*((True, False) if argument.optional else (True,) for argument in row.arguments)):
        given = [SAMPLES_OF[one.shape] if there else "" for one, there in zip(row.arguments, chosen, strict=True)]
        values = [""] if row.value is None or row.value.optional else []
        values += [f" = {SAMPLES_OF[row.value.shape]}"] if row.value is not None else []
        yield from (f"{row.name} {_placed(row, given)}".rstrip() + value for value in values)


def _placed(row: Word, given: list[str]) -> str:
    places = list(zip(row.arguments, given, strict=True))
    task = "".join(f"{text} " for one, text in places if one.shape is Shape.TASK and text)
    group = _with_commas([text for one, text in places if one.shape in GROUPED])
    between = [text for one, text in places if one.shape not in {*GROUPED, Shape.TASK} and one.lead in {"", *COMMAS}]
    led = "".join(f" {one.lead} {text}" for one, text in places if one.lead not in {"", *COMMAS} and text)
    signed = next((place for place, one in enumerate(row.arguments) if one.lead in COMMAS), len(between))
    before, after = _with_commas(between[:signed]), _with_commas(between[signed:])
    texts = f"{before} {row.arguments[signed].lead} {after}" if after else before
    return f"{task}{f'({group}) ' if group else ''}{texts}{led}"


def _with_commas(texts: list[str]) -> str:
    while texts and not texts[-1]:
        texts.pop()
    return ", ".join(texts)


def squeezed(text: str) -> str:
    return text.replace(" ", "").upper().removeprefix("DO")


def read(text: str, at_prompt: bool) -> ast.Statement:
    statement = parse_prompt(text) if at_prompt else parse_step(text).statement
    assert statement is not None
    assert not isinstance(statement, ast.ProgramHeader)
    return statement


@pytest.mark.parametrize(("row", "at_prompt"), ROWS)
def test_what_is_left_out_leaves_no_comma(row: Word, at_prompt: bool) -> None:
    for text in forms(row):
        printed = statement_text(read(text, at_prompt))
        assert squeezed(printed) == squeezed(text.replace("PROMPT , x", "PROMPT x"))


@pytest.mark.parametrize(("row", "at_prompt"), ROWS)
def test_what_is_too_much_stays_where_it_was(row: Word, at_prompt: bool) -> None:
    for text, surplus in product(forms(row), ("7", ", 7", "7, 8", ",,, 7")):
        before, equals, value = text.partition(" =")
        try:
            statement = read(f"{before}, {surplus}{equals}{value}", at_prompt)
        except LineRefused:
            continue
        printed = statement_text(statement)
        assert without_places(read(printed, at_prompt)) == without_places(statement)
        assert statement_text(read(printed, at_prompt)) == printed


@pytest.mark.parametrize("value", ["-" * 390 + "1", "NOT " * 390 + "1", "NOT -(-" + "-" * 300 + "x)"])
def test_as_many_signs_as_a_line_has_room_for(value: str) -> None:
    statement = parse_step(f"x = {value}").statement
    assert statement is not None
    assert statement_text(statement) == f"x = {value}"
