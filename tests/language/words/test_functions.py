"""Test every function by examples: its values, and its errors."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.language.running import StillRobot, StillSettings, run_lines
from vrs_cli.errors import (
    ArithmeticOverflow,
    IllegalSignal,
    IllegalValue,
    NegativeSquareRoot,
    TypeMismatch,
    UndefinedValue,
    VrsError,
)
from vrs_cli.language.run.environment import Environment
from vrs_cli.language.run.operations import IN_CONTEXT, OF_VALUES, message, pack, unpack
from vrs_cli.language.words.functions import FUNCTIONS
from vrs_cli.language.words.values import Kind
from vrs_cli.language.words.word import Shape, State

REALS = [
    ("ABS(-3.5)", 3.5),
    ("SIGN(-2)", -1.0),
    ("SIGN(0)", 1.0),
    ("SQR(-3)", 9.0),
    ("SQRT(2.25)", 1.5),
    ("INT(-2.7)", -2.0),
    ("INT(2.7)", 2.0),
    ("FRACT(2.75)", 0.75),
    ("FRACT(-2.75)", -0.75),
    ("SIN(0)", 0.0),
    ("SIN(90)", 1.0),
    ("SIN(180)", 0.0),
    ("SIN(-90)", -1.0),
    ("SIN(30)", 0.5),
    ("COS(90)", 0.0),
    ("COS(180)", -1.0),
    ("COS(60)", 0.5),
    ("COS(720)", 1.0),
    ("TAN(45)", 1.0),
    ("TAN(-135)", 1.0),
    ("ATAN2(1, -1)", 135.0),
    ("ATAN2(-1, 0)", -90.0),
    ("ATAN2(0, 0)", 0.0),
    ("MAX(1, 3, 2)", 3.0),
    ("MIN(4)", 4.0),
    ("OUTSIDE(0, 5, 10)", 0.0),
    ("OUTSIDE(0, 11, 10)", -1.0),
    ("BCD(93)", 147.0),
    ("DCB(147)", 93.0),
    ("BMASK(1, 3)", 5.0),
    ("BMASK(24)", 8388608.0),
    ("7 MOD 3", 1.0),
    ("-7 MOD 3", -1.0),
    ("7.6 MOD 3", 2.0),
    ("2**10", 1024.0),
    ("(-2)**3", -8.0),
    ("COM(0)", -1.0),
    ("12 BAND 10", 8.0),
    ("12 BOR 10", 14.0),
    ("12 BXOR 10", 6.0),
    ("-1 BAND 255", 255.0),
    ("PI", math.pi),
    ("TRUE", -1.0),
    ("OFF", 0.0),
    ("ON", -1.0),
    ("FALSE", 0.0),
    ('LEN("abc")', 3.0),
    ('LEN("")', 0.0),
    ('ASC("ABC", 2)', 66.0),
    ('ASC("A")', 65.0),
    ('ASC("A", 2)', -1.0),
    ('VAL("12.5 mm")', 12.5),
    ('VAL("  -3")', -3.0),
    ('VAL("mm")', 0.0),
    ('POS("part.v2", ".")', 5.0),
    ('POS("a.b.c", ".", 3)', 4.0),
    ('POS("abc", "x")', 0.0),
    ('STRDIF("a", "b")', -1.0),
    ('STRDIF("a", "A")', 1.0),
    ('STRDIF("a", "a")', 0.0),
    ("INTB($INTB(-500))", -500.0),
    ("LNGB($LNGB(70000))", 70000.0),
    ("FLTB($FLTB(1.5))", 1.5),
    ('DBLB("x"+$DBLB(0.1), 2)', 0.1),
    ("DX(TRANS(10, 20, 30))", 10.0),
    ("DY(TRANS(10, 20, 30))", 20.0),
    ("DZ(TRANS(10, 20, 30))", 30.0),
    ("DX(TRANS(1001))", 1001.0),
    ("DISTANCE(TRANS(0, 0, 0), TRANS(3, 4, 0))", 5.0),
    ("IDENTICAL(TRANS(), NULL)", -1.0),
    ("IDENTICAL(TRANS(1), NULL)", 0.0),
    ("IDENTICAL(TRANS(,,,0, 0, 0), NULL)", 0.0),
    ("DX(SHIFT(TRANS(200, 150, 100) BY 5, -5, 10))", 205.0),
    ("DZ(SHIFT(TRANS(200, 150, 100) BY ,, 10))", 110.0),
    ("DX(SCALE(TRANS(200, 150, 100) BY 0.5))", 100.0),
    ("DX(INVERSE(TRANS(5, 0, 0)))", -5.0),
    ("DY(RZ(90):TRANS(10))", 10.0),
    ("DZ(RX(90):TRANS(, 10))", 10.0),
    ("DX(RY(90):TRANS(,, 10))", 10.0),
    ("DX(FRAME(TRANS(1), TRANS(1, 5), TRANS(-3, 0), TRANS(7)):TRANS(, 2))", 5.0),
    ("DX(NORMAL(TRANS(9, 0, 0, 10, 20, 30)))", 9.0),
    ("DX(HERE)", 500.0),
    ("DZ(TOOL)", 100.0),
    ("DX(BASE)+DX(DEST)", 0.0),
    ("SIG.INS(1)", -1.0),
    ("SIG.INS(-1001)", -1.0),
    ("SIG.INS(5000)", 0.0),
    ("SIG(-1, -1001, -2001)", -1.0),
    ("SIG(1, -2)", 0.0),
    ("BITS(1, 8)", 0.0),
    ("TIME()", 0.0),
    ("TIMER(3)", 0.0),
    ("SPEED(2)", 20.0),
    ("STATE(1)", 7.0),
    ("SWITCH(CP)", -1.0),
    ("PARAMETER(HAND.TIME)", 0.05),
    ("HAND", 0.0),
    ("HAND.TIME", 0.05),
    ("INRANGE(TRANS(500))", 0.0),
    ("INRANGE(#PPOINT(0, 0, 300))", 4.0),
    ("ERROR(0)", 0.0),
    ("DEFINED(nothing)", 0.0),
    ("LAST(nothing[])", -1.0),
]


@pytest.mark.parametrize(("expression", "value"), REALS, ids=[expression for expression, _ in REALS])
def test_reals(expression: str, value: float) -> None:
    result = run_lines(f"x = {expression}").value("x")
    assert type(result) is float
    assert result == pytest.approx(value, abs=1e-12)


STRINGS = [
    ("$CHR(34)", '"'),
    ('$MID("abcdef", 2, 3)', "bcd"),
    ('$MID("abc", 2)', "bc"),
    ('$MID("abc", 9, 2)', ""),
    ('$ENCODE(/F6.2, 3.14159, " mm")', "  3.14 mm"),
    ("$ENCODE(5)", " 5"),
    ("$ERROR(-610)", "Location out of range"),
    ("$ERROR(1)", "Success"),
    ("$ERROR(-9999)", "Unknown error code -9999"),
    ("$TIME()", "01-Jan-84 00:00:00"),
    ('$TRUNCATE("ab"+$CHR(0)+"cd")', "ab"),
    ('"a"+"b"+$CHR(99)', "abc"),
]


@pytest.mark.parametrize(("expression", "value"), STRINGS, ids=[expression for expression, _ in STRINGS])
def test_strings(expression: str, value: str) -> None:
    assert run_lines(f"$x = {expression}").value("$x") == value


ERRORS: list[tuple[str, type[VrsError], str]] = [
    ("SQRT(-4)", NegativeSquareRoot, "-4"),
    ("TAN(90)", ArithmeticOverflow, "90"),
    ("1/0", ArithmeticOverflow, "division by zero"),
    ("5 MOD 0.4", ArithmeticOverflow, "5 MOD 0.4"),
    ("0**(-1)", ArithmeticOverflow, "0"),
    ("10**99", ArithmeticOverflow, "1E+99"),
    ("(-8)**(1/3)", IllegalValue, "-8"),
    ("1E30*1E30", ArithmeticOverflow, "1E+60"),
    ("-1E38*5", ArithmeticOverflow, "-5E+38"),
    ("SQR(1E30)", ArithmeticOverflow, "1E+60"),
    ("MAX(1, 1E30*1E30)", ArithmeticOverflow, ""),
    ("COM(20000000)", IllegalValue, "20000000"),
    ("BCD(1000000)", IllegalValue, "1000000"),
    ("DCB(10)", IllegalValue, "10"),
    ("BMASK(25)", IllegalValue, "25"),
    ("SIG(600)", IllegalSignal, "600"),
    ("SIG(0)", IllegalSignal, "0"),
    ("BITS(510, 8)", IllegalSignal, "517"),
    ("BITS(1, 33)", IllegalValue, "33"),
    ("BITS(-1, 2)", IllegalSignal, "-1"),
    ("TIMER(16)", IllegalValue, "16"),
    ("PARAMETER(PROFILE)", IllegalValue, "LSPB"),
    ("LEN($MID(\"abc\", 0))", IllegalValue, "0"),
    ("LEN($CHR(300))", IllegalValue, "300"),
    ("FLTB(\"ab\")", IllegalValue, "2"),
    ("LEN($INTB(40000))", IllegalValue, "40000"),
    ("DX(FRAME(NULL, NULL, TRANS(1), NULL))", IllegalValue, "FRAME"),
    ("DX(FRAME(NULL, TRANS(1), TRANS(2), NULL))", IllegalValue, "FRAME"),
    ("TAS(nothing, 1)", UndefinedValue, "nothing"),
]  # fmt: skip


@pytest.mark.parametrize(("expression", "error", "detail"), ERRORS)
def test_errors_name_the_value(expression: str, error: type[VrsError], detail: str) -> None:
    failure = run_lines(f"x = {expression}").error
    assert type(failure) is error
    assert detail in str(failure)


def test_a_signal_that_is_on() -> None:
    assert run_lines("SIGNAL 3, 2001", "x = SIG(3, 2001, -4)").value("x") == -1.0


def test_random_numbers_are_the_same_every_run() -> None:
    text = ["x = RANDOM", "y = RANDOM"]
    first, second = run_lines(*text), run_lines(*text)
    assert first.value("x") == second.value("x") != first.value("y")
    assert 0.0 <= first.environment.random.random() < 1.0


def test_the_clock_as_text() -> None:
    assert run_lines("$t = $TIME()", robot=StillRobot(now=3723.9)).value("$t") == "01-Jan-84 01:02:03"


def test_decode_takes_the_front_and_leaves_the_rest() -> None:
    lines = ['$line = "pick, part"', '$a = $DECODE($line, " ,", 0)', '$b = $DECODE($line, " ,", 1)']
    run = run_lines(*lines)
    assert (run.value("$a"), run.value("$b"), run.value("$line")) == ("pick", ", ", "part")


def test_test_and_set_gives_the_old_value() -> None:
    run = run_lines("busy = 7", "x = TAS(busy, TRUE)")
    assert (run.value("x"), run.value("busy")) == (7.0, -1.0)


def test_defined_and_last_follow_assignments() -> None:
    run = run_lines(
        "a[4] = 1", "x = LAST(a[])", "y = DEFINED(a[4])", "z = DEFINED(a[3])", "SET p = NULL", "w = DEFINED(p)"
    )
    assert [run.value(name) for name in "xyzw"] == [4.0, -1.0, 0.0, -1.0]


def test_error_gives_the_code_of_the_latest_error() -> None:
    run = run_lines("x = 1/0", "y = ERROR(0)")
    run.task.resume()
    assert run.value("y") == ArithmeticOverflow.code


def test_a_string_compares_as_the_switch_upper_says() -> None:
    lines = ['x = "Ab" == "aB"', 'y = "a" < "B"']
    on, off = run_lines(*lines), run_lines(*lines, robot=StillRobot(settings=StillSettings(off={"UPPER"})))
    assert (on.value("x"), on.value("y")) == (-1.0, -1.0)
    assert (off.value("x"), off.value("y")) == (0.0, 0.0)


# --- the table ---


def test_every_supported_function_can_be_evaluated() -> None:
    for name, function in FUNCTIONS.items():
        assert name == function.name == name.upper()
        assert (name in OF_VALUES or name in IN_CONTEXT) == (function.state is State.SUPPORTED)
        assert function.summary
        assert function.example


def test_names_show_the_kind_of_the_result() -> None:
    sigils = {"$": Kind.STRING, "#": Kind.PRECISION}
    for name, function in FUNCTIONS.items():
        if name[0] in sigils or function.result in sigils.values():
            assert sigils.get(name[0]) is function.result


def test_optional_arguments_come_last_and_only_the_last_repeats() -> None:
    for function in FUNCTIONS.values():
        optional = [argument.optional for argument in function.arguments]
        assert optional == sorted(optional)
        assert not any(argument.repeated for argument in function.arguments[:-1])
        assert Shape.LOCATION_VARIABLE not in {argument.shape for argument in function.arguments}


@pytest.mark.parametrize(
    ("name", "form"),
    [
        ("PI", "PI"),
        ("TIME", "TIME"),
        ("ATAN2", "ATAN2(y, x)"),
        ("ASC", "ASC($s[, index])"),
        ("SHIFT", "SHIFT(location[ BY dx][, dy][, dz])"),
        ("MAX", "MAX(a[, b, ...])"),
    ],
)
def test_forms(name: str, form: str) -> None:
    assert FUNCTIONS[name].form == form


def test_messages_have_texts() -> None:
    assert message(-401) == "Undefined value"
    assert message(-1023) == "Joint out of range"


# val2, section 5: every name in it, and PACK's other half, $DEFAULT and $ID of V+.
OF_THE_REFERENCE = """
    ABS SIGN SQR SQRT INT FRACT SIN COS TAN ATAN2 MAX MIN RANDOM OUTSIDE BCD DCB BMASK LNGB FLTB INTB $LNGB DX DY DZ
    DISTANCE INRANGE IDENTICAL SIG SIG.INS BITS TIMER TIME SPEED STATE SWITCH PARAMETER ERROR STATUS TASK PRIORITY FREE
    ID DEFINED LAST HAND HAND.TIME LEN ASC VAL POS STRDIF IOSTAT GETC DEVICE KEYMODE PENDANT TAS
    TRANS #PPOINT SHIFT FRAME INVERSE RX RY RZ SCALE NORMAL HERE DEST TOOL BASE NULL #PDEST #PHERE LATCH
    $CHR $MID $ENCODE $DECODE $ERROR $TIME $ID $UNPACK $TRUNCATE $DEFAULT
"""


def test_no_function_is_missing() -> None:
    assert set(OF_THE_REFERENCE.split()) <= set(FUNCTIONS)


def test_a_function_works_or_is_refused_with_a_reason() -> None:
    assert not [name for name, row in FUNCTIONS.items() if (row.state is State.REFUSED) is not bool(row.note)]


@pytest.mark.parametrize(
    "line",
    ["x = TASK(3)", "x = FREE(1)", "x = IOSTAT(3)", "x = IOSTAT(5, 4)", "x = GETC(0)",
     '$a[0] = "x"\n$s = $UNPACK($a[0], 0, 1)',
     '$a[0] = "x"\n$s = $UNPACK($a[0], 1, 129)', 'PACK $a[0], 0, 1 = "x"'],
)  # fmt: skip
def test_what_the_system_cannot_say(line: str) -> None:
    assert isinstance(run_lines(*line.split("\n")).error, IllegalValue)


@pytest.mark.parametrize("line", ['$s = "x"\n$t = $UNPACK($s, 1, 1)', 'PACK $s, 1, 1 = "x"'])
def test_packed_strings_are_arrays(line: str) -> None:
    assert isinstance(run_lines(*line.split("\n")).error, TypeMismatch)


PLACES = st.tuples(
    st.integers(1, 300), st.text(st.characters(codec="ascii", min_codepoint=33), min_size=1, max_size=60)
)


@given(st.lists(PLACES, max_size=5))
def test_packed_characters_are_those_of_one_long_string(placed: list[tuple[int, str]]) -> None:
    environment = Environment()
    array, model = environment.reference("$a", 0), ["\0"] * 512
    for first, text in placed:
        pack(array, float(first), float(len(text)), text)
        model[first - 1 : first - 1 + len(text)] = text
    for first, text in placed:
        shown = "".join(model[first - 1 : first - 1 + len(text)])
        assert unpack(array, float(first), float(len(text))) == shown.rstrip("\0")
