from __future__ import annotations

from vrs_cli.interfaces.inspection import inspect
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.language.analysis.analyzer import MAX_HINTS

PUMA = load_robot("puma560")
SECTIONS = """\
.LOCATIONS
far 5000 0 0 90 -90 0
good 0 149.09 921.12 90 -90 0
#bad 0 0 900 0 0 0
row[2] 5000 0 0 90 -90 0
.END
"""


def found(*steps: str, more: str = "") -> list[tuple[int, int]]:
    """The codes of all diagnostics, and the steps they belong to."""
    text = "\n".join((".PROGRAM p", *steps, ".END", SECTIONS)) + more
    return [(one.code, one.span.line - 1) for one in inspect(text, PUMA)]


def test_locations_out_of_reach() -> None:
    assert found("MOVE far", "MOVES far", "APPRO far, 50", "MOVE row[2]") == [(-619, step) for step in range(1, 5)]


def test_joints_out_of_range() -> None:
    assert found("MOVE #bad") == [(-1023, 1)]
    text = f".PROGRAM p\nMOVE #bad\n.END\n{SECTIONS}"
    assert inspect(text, PUMA)[0].message.startswith("*Joint 3 out of range* #bad: would be 900.00 deg")


def test_places_that_numbers_give() -> None:
    assert found("MOVE TRANS(0, 3000)", "MOVES TRANS(0, -3000, 0, 90, 90, 0)") == [(-619, 1), (-619, 2)]
    assert found("APPRO TRANS(0, 550, -250, 90, 90), 2000", "MOVE TRANS(0, 550, -250, 90, 90)") == [(-619, 1)]
    assert found("MOVE #PPOINT(0, -90, 90, 0, -101, 0)", "MOVE #PPOINT(0, -90, 90, 0, 5, 0)") == [(-1023, 1)]
    assert found("MOVE #PPOINT(200)", "MOVE #PPOINT(1, -90)") == [(-1023, 1)]
    assert found("x = 1", "MOVE TRANS(x, 3000)", "MOVE TRANS(0, 300*10)", "MOVE RX(9):TRANS(0, 3000)") == []
    assert found("TOOL NULL", "MOVE TRANS(0, 3000)") == []


def test_what_another_robot_has_not() -> None:
    steps = ("MOVE #bad", "MOVE #PPOINT(0, 0, 0, 0, 0)", "MOVE #PPOINT(0, 0, 0)", "DRIVE 5, 1, 1", "FLIP", "LEFTY")
    text = "\n".join((".PROGRAM p", *steps, ".END", SECTIONS))
    assert [one.message for one in inspect(text, load_robot("cobra600"))] == [
        "*Illegal value* #bad: a precision point of 6 joints (this robot has 4)",
        "*Illegal value* 5 joint values (the robot has 4 joints)",
        "*Illegal joint number* 5 (joints are 1 to 4)",
        "*Not available* FLIP: Adept Cobra 600 has no such configuration (it has RIGHTY, LEFTY)",
    ]


def test_what_is_in_reach() -> None:
    assert found("MOVE good", "MOVE #ready", "READY") == [(-401, 2)]


def test_the_distance_counts() -> None:
    assert found("MOVE good", "APPRO good, 2000") == [(-619, 2)]


def test_what_is_changed_is_not_known() -> None:
    assert found("HERE far", "MOVE far") == []
    assert found("MOVE far", more=".PROGRAM q\nSET far = NULL\n.END\n") == []
    assert found("CALL q(far)", "MOVE far", more=".PROGRAM q(a)\nSET a = NULL\n.END\n") == []


def test_with_another_tool_nothing_is_known() -> None:
    assert found("TOOL good", "MOVE far") == []


def test_switches_and_parameters_that_are_not_there() -> None:
    assert found("ENABLE CP, foo", "DISABLE POW", "SWITCH fo = ON", "PARAMETER hand = 1", "PARAMETER foo = 1") == [
        (-300, 1),
        (-300, 3),
        (-300, 5),
    ]


def test_constants_that_no_run_could_take() -> None:
    assert found("SIGNAL 5000", "DRIVE 7, 10", "x = 1/0", "IF SWITCH(foo) THEN", "END") == [
        (-405, 1),
        (-609, 2),
        (-409, 3),
        (-300, 4),
    ]
    text = ".PROGRAM p\nIF FALSE THEN\nDRIVE 5, 10\nEND\n.END\n"
    (one,) = inspect(text, load_robot("cobra600"))
    assert (one.severity.value, one.span.line, one.span.column, one.detail) == ("warning", 3, 7, "5")
    assert inspect(text, PUMA) == ()


def test_unreachable_steps_of_programs_that_can_run() -> None:
    assert found("STOP", "x = 1") == [(57, 2)]
    assert found("STOP", "x = 1", "GOTO 7") == [(-412, 3)]


def test_of_many_names_without_a_value_the_first_are_compared_with_others() -> None:
    steps = "".join(f"x = plaxe{i}\ny = place{i}\nplace{i} = 1\n" for i in range(100, 200))
    hints = [one.hint for one in inspect(f".PROGRAM p\n{steps}.END\n", PUMA) if "plaxe" in one.detail]
    assert len(hints) == 100
    assert sum(hint.startswith("did you mean") for hint in hints) == MAX_HINTS
