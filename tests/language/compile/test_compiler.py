"""Compiled programs against Python and against a slow interpreter; variables by reference; loops and jumps."""

from __future__ import annotations

import gc
import math
from collections.abc import Callable

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.examples import examples
from tests.language.reference import Interpreter
from tests.language.running import StillRobot, environment_with, program, run, run_lines
from tests.language.spaghetti import spaghetti
from vrs_cli.errors import (
    ArgumentMismatch,
    ArithmeticOverflow,
    IllegalArrayIndex,
    IllegalValue,
    ProgramNotExecutable,
    UndefinedValue,
    VrsError,
)
from vrs_cli.language.analysis.analyzer import analyze
from vrs_cli.language.analysis.names import Analysis
from vrs_cli.language.compile.compiler import compile_program
from vrs_cli.language.run.effects import Budget, Failed, ProgramCompleted
from vrs_cli.language.run.environment import LIBRARY, Environment
from vrs_cli.language.run.runtime import Task
from vrs_cli.language.text.ast import Assignment, BadLine, Binary, Expression, Number, Program, Step, Unary, Variable
from vrs_cli.language.text.collector import pause_collector
from vrs_cli.language.words.values import Kind, integer
from vrs_cli.values.diagnostics import Span, error
from vrs_cli.values.numbers import LIMIT

NOWHERE = Span(1, 1, 1)


# --- expressions against Python ---

NAMES = {"a": 3.0, "b": -2.5, "c": 0.0}


def truth(condition: bool) -> float:
    return -1.0 if condition else 0.0


PYTHON: dict[str, Callable[[float, float], float]] = {
    "+": lambda a, b: a + b,
    "-": lambda a, b: a - b,
    "*": lambda a, b: a * b,
    "/": lambda a, b: a / b,
    "MOD": lambda a, b: math.fmod(integer(a), integer(b)) + 0.0,
    "==": lambda a, b: truth(a == b),
    "<>": lambda a, b: truth(a != b),
    "<": lambda a, b: truth(a < b),
    ">": lambda a, b: truth(a > b),
    "<=": lambda a, b: truth(a <= b),
    ">=": lambda a, b: truth(a >= b),
    "AND": lambda a, b: truth(a != 0 and b != 0),
    "OR": lambda a, b: truth(a != 0 or b != 0),
    "XOR": lambda a, b: truth((a != 0) != (b != 0)),
    "BAND": lambda a, b: float(integer(a) & integer(b)),
    "BOR": lambda a, b: float(integer(a) | integer(b)),
    "BXOR": lambda a, b: float(integer(a) ^ integer(b)),
}

UNARY: dict[str, Callable[[float], float]] = {
    "-": lambda a: -a,
    "+": lambda a: a,
    "NOT": lambda a: truth(a == 0),
    "COM": lambda a: float(~integer(a)),
}


def in_python(tree: Expression) -> float:
    """The value of a tree, by Python. Raises ArithmeticError, ValueError and IllegalValue as Python's operators do."""
    if isinstance(tree, Number):
        return tree.value
    if isinstance(tree, Variable):
        return NAMES[tree.key]
    if isinstance(tree, Unary):
        return UNARY[tree.operator](in_python(tree.operand))
    assert isinstance(tree, Binary)
    return PYTHON[tree.operator](in_python(tree.left), in_python(tree.right))


leaves: st.SearchStrategy[Expression] = st.one_of(
    st.floats(0, 1e4, allow_nan=False).map(lambda x: Number(x, str(x), span=NOWHERE)),
    st.sampled_from(sorted(NAMES)).map(lambda name: Variable(name, "", None, span=NOWHERE)),
)


def branches(children: st.SearchStrategy[Expression]) -> st.SearchStrategy[Expression]:
    unary = st.builds(Unary, st.sampled_from(sorted(UNARY)), children, span=st.just(NOWHERE))
    binary = st.builds(Binary, st.sampled_from(sorted(PYTHON)), children, children, span=st.just(NOWHERE))
    return unary | binary


trees = st.recursive(leaves, branches, max_leaves=20)


def assigned(tree: Expression) -> Analysis:
    statement = Assignment(Variable("x", "", None, span=NOWHERE), tree, span=NOWHERE)
    return analyze(Program("main", (), (Step(None, statement, None, span=NOWHERE),), None, span=NOWHERE))


def value_or_error(tree: Expression) -> float | type[VrsError]:
    environment = Environment()
    for name, known in NAMES.items():
        environment.reference(name).assign(known)
    environment.store(assigned(tree))
    task = Task(environment, StillRobot(), "main")
    while not isinstance(event := task.resume(), ProgramCompleted):
        if isinstance(event, Failed):
            return type(event.error)
    value = environment.reference("x").value()
    assert isinstance(value, float)
    return value


@given(trees)
@examples(400)
def test_expressions_have_the_value_that_python_gives(tree: Expression) -> None:
    try:
        expected: float | type[VrsError] = in_python(tree)
    except (ArithmeticError, ValueError):  # fmod(x, 0) is a ValueError
        expected = ArithmeticOverflow
    except IllegalValue:
        expected = IllegalValue
    if isinstance(expected, float) and not abs(expected) <= LIMIT:
        expected = ArithmeticOverflow
    assert value_or_error(tree) == expected


def test_both_sides_of_and_and_or_are_evaluated() -> None:
    for operator in ("AND", "OR", "XOR"):
        assert isinstance(run_lines(f"x = (1 == 1) {operator} (nothing > 0)").error, UndefinedValue)
        assert isinstance(run_lines(f"IF (1 == 2) {operator} (nothing > 0) THEN", "END").error, UndefinedValue)


# --- flow against the reference ---

REFERENCE_STEPS, COMPILED_STEPS = 300, 2000


def outcomes(lines: list[str], first: int) -> tuple[list[str], bool, bool, list[str], object]:
    """What the reference and the compiled program type from a line on, and how they end."""
    reference = Interpreter(lines)
    reference.variables["x"] = 0.0
    expected = reference.run(first, REFERENCE_STEPS)
    environment = environment_with(program(*lines))
    environment.reference("x").assign(0.0)
    task = Task(environment, StillRobot(), "main", step=first + 1)
    typed: list[str] = []
    end: object = None
    while task.steps_done < COMPILED_STEPS and not isinstance(end, ProgramCompleted | Failed):
        end = task.resume(budget=50)
        typed += [end.text] if hasattr(end, "text") else []
    return expected.typed, expected.ended, expected.fault, typed, end


@given(spaghetti(), st.data())
@examples(250)
def test_jumps_and_blocks_go_where_the_reference_goes(lines: list[str], data: st.DataObject) -> None:
    """Also when entered at any step."""
    first = data.draw(st.just(0) | st.integers(0, len(lines) - 1))
    expected, ended, fault, typed, end = outcomes(lines, first)
    if ended or fault:
        assert typed == expected
        assert isinstance(end, ProgramCompleted if ended else Failed)
    else:
        assert typed[: len(expected)] == expected


def test_a_jump_out_of_an_if_repeats_no_step() -> None:
    assert (
        run_lines("x = 0", "IF x == 0 THEN", "  IF x == 5 GOTO 10", "  x = x+1", "END", "x = x+10", "10").value("x")
        == 11.0
    )


def test_a_jump_out_of_an_if_with_an_else_and_a_loop() -> None:
    lines = ("IF x == 0 THEN", "  IF x == 5 GOTO 10", "ELSE", "  IF x == 2 THEN", "  END", "END")
    assert run_lines("x = 0", "FOR j = 1 TO 3", *lines, "10 END").value("j") == 4.0


@pytest.mark.parametrize("part", [1, 3])
@given(spaghetti(), st.data())
@examples(80)
def test_a_long_program_of_several_functions_does_the_same(part: int, lines: list[str], data: st.DataObject) -> None:
    first = data.draw(st.just(0) | st.integers(0, len(lines) - 1))
    whole = outcomes(lines, first)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("vrs_cli.language.compile.compiler.OPS_A_FUNCTION", part)
        parts = outcomes(lines, first)
    assert repr(parts) == repr(whole)


@given(spaghetti(), st.integers(1, 60))
@examples(100)
def test_a_repeated_step_changes_nothing_that_it_does_not_do(lines: list[str], steps: int) -> None:
    """RETRY before a step: the program is entered again right there, loops and all, as if it had never been left."""

    def typed(again: bool) -> list[str]:
        environment = environment_with(program(*lines))
        environment.reference("x").assign(0.0)
        task = Task(environment, StillRobot(), "main")
        texts: list[str] = []
        for _ in range(200):
            event = task.resume(budget=1)
            if isinstance(event, ProgramCompleted | Failed):
                break
            texts += [event.text] if hasattr(event, "text") else []
            if again and isinstance(event, Budget) and task.steps_done == steps:
                task.retry()
        return texts

    once, twice = typed(again=False), typed(again=True)
    assert twice == once[: len(twice)]


# --- loops ---


@pytest.mark.parametrize(
    ("head", "values", "after"),
    [
        ("FOR i = 1 TO 3", [1, 2, 3], 4),
        ("FOR i = 1 TO 0", [], 1),
        ("FOR i = 1 TO 1", [1], 2),
        ("FOR i = 0 TO 1 STEP 0.4", [0, 0.4, 0.8], 1.2),
        ("FOR i = 3 TO 1 STEP -1", [3, 2, 1], 0),
        ("FOR i = 1 TO 3 STEP -1", [], 1),
        ("FOR i = 1 TO 5 STEP gap", [1, 3, 5], 7),
        ("FOR i = 5 TO 1 STEP -gap", [5, 3, 1], -1),
        ("FOR i = 1 TO n", [1, 2, 3], 4),
        ("FOR row[2] = 1 TO 2", [1, 2], 3),
    ],
)
def test_for(head: str, values: list[float], after: float) -> None:
    variable = head.split()[1]
    result = run_lines("gap = 2", "n = 3", head, f"  TYPE /D, {variable}", "  n = 100", "END", f"x = {variable}")
    assert [float(text) for text in result.typed.split()] == pytest.approx(values)
    assert result.value("x") == pytest.approx(after)


def test_a_step_of_0_is_an_error() -> None:
    assert isinstance(run_lines("s = 0", "FOR i = 1 TO 3 STEP s", "END").error, IllegalValue)
    assert isinstance(run_lines("FOR i = 1 TO 3 STEP 0", "END").error, IllegalValue)


def test_the_variable_may_be_changed_inside() -> None:
    assert run_lines("FOR i = 1 TO 10", "  TYPE i", "  i = i+3", "END").typed == " 1\n 5\n 9\n"


def test_a_loop_left_and_entered_again_keeps_its_limit() -> None:
    lines = [
        "n = 2",
        "FOR i = 1 TO n",
        "  TYPE i",
        "  IF i == 1 GOTO 10",
        "20 x = 0",
        "END",
        "GOTO 30",
        "10 n = 99",
        "GOTO 20",
        "30",
    ]
    assert run_lines(*lines).typed == " 1\n 2\n"


def test_a_loop_entered_past_its_for_says_so() -> None:
    run = run_lines("GOTO 10", "FOR i = 1 TO 3", "10  i = 1", "END")
    assert isinstance(run.error, UndefinedValue)
    assert "past its FOR" in str(run.error)


def test_each_call_has_its_own_limits() -> None:
    lines = ["IF n > 0 THEN", "FOR i[n] = 1 TO n", "  CALL down(n-1)", "  TYPE n, i[n]", "END", "END"]
    assert run(program("CALL down(2)") + program(*lines, name="down", parameters="n")).typed.split("\n")[:-1] == [
        " 1 1",
        " 2 1",
        " 1 1",
        " 2 2",
    ]


def test_a_case_may_compare_with_expressions() -> None:
    lines = [
        "k = 4",
        "FOR i = 1 TO 5",
        "CASE i OF",
        "VALUE 1, k/2:",
        ' TYPE "a"',
        "VALUE k:",
        ' TYPE "b"',
        "ANY",
        ' TYPE "c"',
        "END",
        "END",
    ]
    assert run_lines(*lines).typed.split() == ["a", "a", "c", "b", "c"]


# --- variables ---


def test_arrays_of_one_and_of_more_dimensions() -> None:
    run = run_lines("FOR i = 0 TO 3", "  a[i] = i*i", "  g[i, 1] = i", "END", "x = a[2.6]+g[2, 1]+a[a[1]]")
    assert run.value("x") == 9 + 2 + 1


@pytest.mark.parametrize("line", ["a[-1] = 5", "x = a[-1]", "x = g[0, -1]", "a[i] = 1", '$s[-1] = "x"'])
def test_indexes_below_0_are_refused(line: str) -> None:
    run = run_lines("i = -1", line)
    assert isinstance(run.error, IllegalArrayIndex)
    assert "-1" in str(run.error)


def test_reading_an_element_that_is_not_there_names_it() -> None:
    assert str(run_lines("a[1] = 5", "x = a[2]").error) == "*Undefined value* a[2] (its only element is 1)"
    assert (
        str(run_lines("$x = $s[2]").error)
        == "*Undefined value* $s[2] ($s[2] = ... defines it; $MID($s, 1, 2) is a part of a text)"
    )


def test_an_undefined_name_has_a_near_one() -> None:
    error = run_lines("Counter = 1", "x = Countr+1").error
    assert str(error) == "*Undefined value* Countr (did you mean Counter?)"


# --- arguments ---

SWAP = program("t = a", "a = b", "b = t", name="swap", parameters="a, b")


def test_variables_are_passed_by_reference() -> None:
    run_ = run(program("x = 1", "y = 2", "CALL swap(x, y)") + SWAP)
    assert (run_.value("x"), run_.value("y")) == (2.0, 1.0)


def test_elements_are_passed_by_reference() -> None:
    run_ = run(program("r[1] = 1", "i = 2", "r[i] = 2", "CALL swap(r[1], r[i])") + SWAP)
    assert [run_.environment.reference("r", i).value() for i in (1, 2)] == [2.0, 1.0]


def test_expressions_are_passed_as_copies() -> None:
    run_ = run(program("x = 1", "y = 2", "CALL swap((x), y*1)") + SWAP)
    assert (run_.value("x"), run_.value("y")) == (1.0, 2.0)


def test_whole_arrays_are_passed() -> None:
    fill = program(
        "FOR i = 1 TO n", "  a[i] = i", "  $s[i] = $CHR(64+i)", "END", name="fill", parameters="a[], $s[], n"
    )
    run_ = run(program("CALL fill(row[], $name[], 3)", "x = row[3]", "$x = $name[2]") + fill)
    assert (run_.value("x"), run_.value("$x")) == (3.0, "B")


def test_locations_strings_and_precision_points_are_passed() -> None:
    give = program("SET a = TRANS(7)", "SET #b = #PPOINT(90)", '$c = "x"', name="give", parameters="a, #b, $c")
    run_ = run(program("CALL give(p, #q, $r)", "x = DX(p)") + give)
    assert (run_.value("x"), run_.value("$r")) == (7.0, "x")
    assert run_.value("#q") == pytest.approx((math.pi / 2, 0, 0, 0, 0, 0))


def test_a_name_can_be_handed_on_before_it_has_a_kind() -> None:
    text = program("CALL first(p)", "x = DX(p)") + program("CALL second(q)", name="first", parameters="q")
    assert run(text + program("SET r = TRANS(5)", name="second", parameters="r")).value("x") == 5.0


def test_an_argument_left_out_is_undefined_until_it_is_assigned() -> None:
    sub = program("IF NOT DEFINED(b) THEN", "  b = 5", "END", "x = a+b", name="sub", parameters="a, b, c")
    assert run(program("CALL sub(1)") + sub).value("x") == 6.0
    assert run(program("CALL sub(1,,2)") + sub).value("x") == 6.0
    error = run(program("CALL sub(, 2)") + sub).error
    assert str(error) == "*Undefined value* a (its argument was left out: CALL sub(a, b, c) gives it, or EXECUTE)"


@pytest.mark.parametrize(
    ("call", "message"),
    [
        ('CALL sub("text")', "a of sub is given a string"),
        ("CALL sub(#p)", "a of sub is given a precision point"),
        ("CALL sub(place)", "place is not a real"),
        ("CALL sub(row[])", "a of sub is given an array"),
    ],
)
def test_arguments_of_the_wrong_kind(call: str, message: str) -> None:
    sub = program("x = a+1", name="sub", parameters="a")
    lines = ["SET #p = #PPOINT(0)", "SET place = NULL", "row[1] = 1"]
    # The kinds come from variables that the analyzer does not see together with the called program.
    environment = environment_with(program(*lines, name="set.up"))
    task = Task(environment, StillRobot(), "set.up")
    while not isinstance(task.resume(), ProgramCompleted):
        pass
    environment.programs |= environment_with(program(call)).programs
    environment.programs |= environment_with(sub).programs
    failing = Task(environment, StillRobot(), "main")
    while not isinstance(event := failing.resume(), Failed):
        assert not isinstance(event, ProgramCompleted)
    assert isinstance(event.error, ArgumentMismatch)
    assert message in str(event.error)


def test_two_programs_compiled_apart_share_their_variables() -> None:
    text = program("x = 1", "CALL more", "CALL more") + program("x = x+1", name="more")
    assert run(text).value("x") == 3.0


# --- the compiler itself ---


def test_a_program_with_errors_is_not_compiled() -> None:
    whole_program = assigned(Number(1.0, "1", span=NOWHERE)).program
    broken = Analysis(whole_program, {}, (), {}, (error(IllegalValue, NOWHERE),))
    with pytest.raises(ProgramNotExecutable, match="main"):
        compile_program(LIBRARY, broken)


def test_a_program_with_a_line_that_could_not_be_read_is_not_compiled() -> None:
    bad = Program("main", (), (Step(None, BadLine("MOVE MOVE", span=NOWHERE), None, span=NOWHERE),), None, span=NOWHERE)
    with pytest.raises(ProgramNotExecutable, match="main"):
        compile_program(LIBRARY, Analysis(bad, {}, (), {}, ()))


def test_an_expression_of_a_thousand_levels_is_refused_not_crashed() -> None:
    tree: Expression = Variable("a", "", None, span=NOWHERE)
    for _ in range(5000):
        tree = Unary("-", tree, span=NOWHERE)
    statement = Assignment(Variable("x", "", None, span=NOWHERE), tree, span=NOWHERE)
    deep = Program("deep", (), (Step(None, statement, None, span=NOWHERE),), None, span=NOWHERE)
    with pytest.raises(ProgramNotExecutable, match="nested too deeply"):
        compile_program(LIBRARY, Analysis(deep, {"a": Kind.REAL, "x": Kind.REAL}, (), {}, ()))


def test_long_programs_compile() -> None:
    lines, x = ["x = 0"], 0
    for number in range(500):
        lines += [f"IF x MOD 7 == {number % 7} THEN", "  x = x+1", "ELSE", "  x = x+2", "END"]
        x += 1 if x % 7 == number % 7 else 2
    assert run_lines(*lines).value("x") == x


# --- the cost of compiling ---


def test_the_collector_runs_again_after_what_goes_wrong() -> None:
    gc.enable()
    with pytest.raises(ZeroDivisionError), pause_collector():
        _ = 1 / 0
    assert gc.isenabled()


def test_the_collector_stays_off_where_it_was() -> None:
    gc.disable()
    try:
        environment = environment_with(program("x = 1"))
        environment.executable(environment.program("main")).compilation  # noqa: B018
        assert not gc.isenabled()
    finally:
        gc.enable()


def test_leaves_are_shared_and_values_are_not_confused() -> None:
    ran = run_lines("a = 1", "b = TRUE", "c = 0", "d = -0", "e = 1", '$s = "1"')
    assert [ran.value(name) for name in ("a", "b", "c", "d", "e", "$s")] == [1.0, -1.0, 0.0, 0.0, 1.0, "1"]
