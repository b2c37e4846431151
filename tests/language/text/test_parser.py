"""Test the trees of lines and files: values, places, and that every text gives trees or diagnostics."""

from __future__ import annotations

from typing import Any

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.examples import examples
from vrs_cli.language.analysis.analyzer import analyze, check_line
from vrs_cli.language.text import ast
from vrs_cli.language.text.ast import Binary, Call, Instruction, Number, Unary, Variable
from vrs_cli.language.text.line_parser import grammar_text
from vrs_cli.language.text.parser import parse_file, parse_prompt, parse_step, parts_of
from vrs_cli.language.text.printer import print_file, statement_text
from vrs_cli.language.words.functions import FUNCTIONS
from vrs_cli.language.words.instructions import CONNECTIVES, OPERATOR_WORDS, PROGRAM_WORDS
from vrs_cli.language.words.monitor import COMMANDS
from vrs_cli.values.diagnostics import LineRefused, Span, show


def statement(text: str) -> Any:
    return parse_step(text).statement


def value(text: str) -> Any:
    return statement(f"x = {text}").value


@pytest.mark.parametrize(
    ("text", "number"),
    [
        ("5", 5.0),
        ("2.5", 2.5),
        (".5", 0.5),
        ("5.", 5.0),
        ("1E-3", 0.001),
        ("1e3", 1000.0),
        ("^B1001", 9.0),
        ("^346", 230.0),
        ("^H23FF", 9215.0),
        ("^h23ff", 9215.0),
        ("^D20000000", 20000000.0),
        ("'A", 65.0),
        ("'a", 97.0),
        ("' ", 32.0),
        ("''", 39.0),
    ],
)
def test_numbers(text: str, number: float) -> None:
    read = value(f"{text} + 0").left
    assert isinstance(read, Number)
    assert read.value == number


@pytest.mark.parametrize(
    ("text", "grouping"),
    [
        ("a+b*c", "(a + (b * c))"),
        ("a-b-c", "((a - b) - c)"),
        ("a**b**c", "((a ** b) ** c)"),
        ("-a**b", "((- a) ** b)"),
        ("a**-b", "(a ** (- b))"),
        ("- - a", "(- (- a))"),
        ("a > 2 AND b < 3", "((a > 2) AND (b < 3))"),
        ("a OR b AND c", "(a OR (b AND c))"),
        ("a XOR b OR c", "((a XOR b) OR c)"),
        ("NOT a == b", "(NOT (a == b))"),
        ("NOT a AND b", "((NOT a) AND b)"),
        ("a == NOT b", "(a == (NOT b))"),
        ("a == NOT b AND c", "((a == (NOT b)) AND c)"),
        ("COM a BAND b", "((COM a) BAND b)"),
        ("a BAND b BOR c", "((a BAND b) BOR c)"),
        ("a BAND 1 == 1", "((a BAND 1) == 1)"),
        ("a+b MOD c", "(a + (b MOD c))"),
        ("a:b:c", "((a : b) : c)"),
        ("(a+b)*c", "((a + b) * c)"),
        ("a =< b", "(a <= b)"),
    ],
)
def test_what_binds_tighter(text: str, grouping: str) -> None:
    assert _grouping(value(text)) == grouping


def _grouping(tree: Any) -> str:
    if isinstance(tree, Binary):
        return f"({_grouping(tree.left)} {tree.operator} {_grouping(tree.right)})"
    if isinstance(tree, Unary):
        return f"({tree.operator} {_grouping(tree.operand)})"
    return tree.text if isinstance(tree, Number) else str(tree.name)


def test_values() -> None:
    assert value("PI") == Call("PI", (), span=Span(1, 5, 7))
    assert value("count") == Variable("count", "", None, span=Span(1, 5, 10))
    assert value("(a)").grouped
    assert value("a[1, 2]").indexes == (Number(1.0, "1", span=Span(1, 7, 8)), Number(2.0, "2", span=Span(1, 10, 11)))
    assert value("a[]").indexes == ()
    assert value("sqrt(2)") == Call("SQRT", (Number(2.0, "2", span=Span(1, 10, 11)),), True, span=Span(1, 5, 12))
    assert value("TIME()") == Call("TIME", (), True, span=Span(1, 5, 11))
    assert value("TRANS(,,5,)").arguments[:2] == (None, None)
    assert len(value("TRANS(,,5,)").arguments) == 3
    assert len(value("SHIFT(a BY 1,,2)").arguments) == 4
    assert statement("MOVE #PPOINT(1)").arguments[0].name == "#PPOINT"
    assert statement("$s = $CHR(65)").value.name == "$CHR"


def test_instructions() -> None:
    motion = statement("MOVES part:grip AT 2*t")
    assert motion.word == "MOVES"
    assert isinstance(motion.modifiers.at, Binary)
    assert statement("READY IN 1").modifiers.within == Number(1.0, "1", span=Span(1, 10, 11))
    assert statement("SPEED 20, 50 MMPS ALWAYS").modifiers == ast.Modifiers(always=True, unit="MMPS")
    assert statement("BASE ,,300").arguments[:2] == (None, None)
    assert statement("TIMER 1 = 0").value == Number(0.0, "0", span=Span(1, 11, 12))
    assert statement("TIMER (1) = 0").arguments == (Number(1.0, "1", span=Span(1, 8, 9)),)
    assert statement("ENABLE cp, dry.run").arguments == (
        ast.BareWord("cp", span=Span(1, 8, 10)),
        ast.BareWord("dry.run", span=Span(1, 12, 19)),
    )
    assert statement("CALL pick").arguments == (ast.ProgramCall("pick", (), span=Span(1, 6, 10)),)
    assert statement("CALL sin(1)").arguments[0].name == "sin"
    assert statement("PROMPT n").arguments[0] is None
    assert statement("PROMPT $text, n").arguments[0] is not None
    assert statement("SIGNAL -1").arguments == (Unary("-", Number(1.0, "1", span=Span(1, 9, 10)), span=Span(1, 8, 10)),)
    assert statement('TYPE /C2, "x", /F6.2').arguments[2] == ast.Format("F", 6, 2, span=Span(1, 16, 21))
    assert statement("DEFBELT 1001, pick").arguments == (ast.BareWord("1001, pick", span=Span(1, 9, 19)),)


@pytest.mark.parametrize("text", ["0" * 5000 + "10 STOP", "GOTO " + "0" * 5000 + "10"])
def test_a_label_may_have_any_number_of_zeros_before_it(text: str) -> None:
    step = parse_step(text)
    assert 10 in (step.label, getattr(step.statement, "label", None))


@pytest.mark.parametrize("text", ["0000000000000070000 STOP", "GOTO 0000000000000070000", "9" * 5000 + " STOP"])
def test_a_label_is_at_most_65535(text: str) -> None:
    with pytest.raises(LineRefused, match="labels are 0 to 65535"):
        parse_step(text)


def test_an_expression_may_stand_where_a_parenthesis_is_left_out() -> None:
    assert statement_text(statement("FCLOSE a-1")) == "FCLOSE (a-1)"


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("FOR i", "= is missing"),
        ("FOR i TO 5", "= is missing"),
        ("FOR i = 1", "TO is missing"),
        ("x = a[,)", "\\) closes nothing"),
        ("IF x", "THEN or GOTO is missing"),
    ],
)
def test_a_refusal_says_what_the_parser_would_have_taken(line: str, message: str) -> None:
    with pytest.raises(LineRefused, match=message):
        parse_step(line)


def test_constants_can_be_named_where_something_is_defined() -> None:
    """The analyzer then says that they are reserved."""
    assert statement("PI = 3").target == Variable("pi", "", None, span=Span(1, 1, 3))
    assert statement("SET here = a").arguments == (Variable("here", "", None, span=Span(1, 5, 9)),)
    assert statement("FOR on = 1 TO 2").variable.name == "on"


def test_commands() -> None:
    where: Any = parse_prompt("WHERE FROM 0 TO 5 STEP .5")
    assert [None if one is None else one.value for one in where.arguments] == [None, 0.0, 5.0, 0.5]
    assert [one.value for one in parse_prompt("WHERE 1").arguments] == [1.0]  # type: ignore[union-attr]
    stored: Any = parse_prompt("STORE a.v2 = pick,place")
    assert [one.text for one in stored.arguments] == ["a.v2", "pick", "place"]
    assert stored.value is None
    executed: Any = parse_prompt("EX pick(a),5")
    assert executed.word == "EXECUTE"
    assert isinstance(executed.arguments[0], ast.ProgramCall)
    assert isinstance(parse_prompt("MOVE a"), ast.DoInstruction)
    assert isinstance(parse_prompt("a = 5"), ast.DoInstruction)
    assert isinstance(parse_prompt("HERE a"), Instruction)
    assert isinstance(parse_prompt("TOOL"), Instruction)
    assert parse_prompt("DO") == ast.DoInstruction(None, span=Span(1, 1, 3))
    assert parse_prompt("") is None
    assert parse_prompt("  ; a comment") is None


def test_a_heading_at_the_prompt() -> None:
    header = parse_prompt(".program pick.place(a, $b, c[]) ;x")
    assert isinstance(header, ast.ProgramHeader)
    assert header.name == "pick.place"
    assert [variable.key for variable in header.parameters] == ["a", "$b", "c"]
    assert header.comment == "x"


def test_the_grammar_is_found() -> None:
    assert grammar_text()


# --- any text ------------------------------------------------------------------------------------------------------

SIGNS = "( ) [ ] , = == =< <> + - * / ** : ; \" x y #p $s %b 5 2.5 ^HFF 'A AT IN /F6.2 a[1] a[] .PROGRAM .END 10 \t é"
PIECES = [
    *PROGRAM_WORDS,
    *COMMANDS,
    *FUNCTIONS,
    *CONNECTIVES,
    *OPERATOR_WORDS,
    *SIGNS.split(" "),
    '"text"',
]
lines = st.one_of(
    st.lists(st.sampled_from(PIECES), max_size=9).map(" ".join),
    st.lists(st.sampled_from(PIECES), max_size=9).map("".join),
    st.text(max_size=30),
)


def _places(node: Any) -> list[Span]:
    if isinstance(node, tuple):
        return [span for child in node for span in _places(child)]
    if not isinstance(node, msgspec.Struct):
        return []
    own = [node.span] if hasattr(node, "span") else []
    return own + [span for name in node.__struct_fields__ for span in _places(getattr(node, name))]


@given(lines, st.booleans())
@examples(1500)
def test_any_line_is_read_or_refused(line: str, at_prompt: bool) -> None:
    try:
        parsed = parse_prompt(line) if at_prompt else parse_step(line).statement
    except LineRefused as refused:
        span = refused.diagnostic.span
        assert 1 <= span.column < span.end <= len(line) + 2
        show(refused.diagnostic, line)
        return
    if parsed is None:
        return
    for span in _places(parsed):
        if span.line:
            assert 1 <= span.column < span.end <= len(line) + 1, (line, span)
    for diagnostic in check_line(parsed, in_program=not at_prompt):
        show(diagnostic, line)
    if not isinstance(parsed, ast.ProgramHeader):
        text = statement_text(parsed)
        again = parse_prompt(text) if at_prompt else parse_step(text).statement
        assert not isinstance(again, ast.ProgramHeader | None)
        assert statement_text(again) == text


@given(
    st.lists(st.one_of(lines, st.sampled_from([".PROGRAM p(a)", ".END", ".REALS", ".LOCATIONS", "x 5"])), max_size=12)
)
@examples(300)
def test_any_file_is_read(texts: list[str]) -> None:
    file, diagnostics = parse_file("\n".join(texts))
    for part in file.parts:
        if isinstance(part, ast.Program):
            analyze(part)
    once = print_file(file)
    if not diagnostics:
        again, none = parse_file(once)
        assert none == ()
        assert print_file(again) == once


@pytest.mark.parametrize(
    "text", ["; a\n\x1a\n.PROGRAM p\n.END\n", ".PROGRAM p\nTYPE 1\x1a\n.PROGRAM q\n.END\n\x1a\n;\n\x1a"]
)
def test_a_file_and_its_parts_have_the_same_mistakes(text: str) -> None:
    """A Ctrl-Z is the end of a text only as its last character."""
    whole = [(one.span.line, one.code) for one in parse_file(text)[1]]
    parts = [
        (one.span.line, one.code) for placed in parts_of(text, {}) for one in placed.translate(placed.part.diagnostics)
    ]
    assert whole
    assert parts == whole
