"""Test checks of the robot's state with lines after which they pass or fail."""

import tomllib

import pytest

from tests.teach.runs import SilentTerminal
from vrs_cli.interfaces.session.session import Session
from vrs_cli.teach.checks import AnyCheck
from vrs_cli.teach.exercise_text import ExerciseText
from vrs_cli.teach.grading import Mark, mark_checks
from vrs_cli.teach.judging.basis import Basis, evidence_of
from vrs_cli.teach.kinds import read_check

SPLICE = ("MOVE #PPOINT(60, -90, 90, 0, 0, 0) AT 1", "MOVE #PPOINT(60, -60, 90, 0, 0, 0) AT 1.5")


def read(text: str) -> tuple[AnyCheck | None, list[str]]:
    text = text.replace("; ", "\n")
    reader = ExerciseText("checks.toml", text)
    (entry,) = reader.entries("check", [tomllib.loads(text)], tomllib.loads(text))
    return read_check(reader, entry), reader.wrong


def judged(lines: tuple[str, ...], text: str) -> Mark:
    check, wrong = read(text)
    assert check is not None, wrong
    session = Session(SilentTerminal())
    for line in lines:
        session.perform(line)
    (found,) = mark_checks((check,), evidence_of(session), Basis())
    return found


@pytest.mark.parametrize(
    ("lines", "text"),
    [
        (("DRIVE 1, 30",), 'kind = "joints"; at = [30, "any", 90, 0, 0, 0]; deg = 0.1'),
        (("DRIVE 1, 30", "DRIVE 1, -30"), 'kind = "joints"; at = [30, -90]; deg = 0.1; when = "passed"'),
        (("DRIVE 1, 60 AT 1",), 'kind = "joints"; at = [28.7]; deg = 0.1; time = 1.5'),
        (("x = 3",), 'kind = "variable"; of = "x"; value = 3.1; within = 0.1'),
        (("p[2] = 3",), 'kind = "variable"; of = "P[2]"; value = 3'),
        (('$s = "a"',), 'kind = "variable"; of = "$s"; value = "a"'),
        (
            ("SET f = TRANS(0, 5, 0)", "SET f:p = TRANS(0, 7, 0)"),
            'kind = "location"; of = "f:p"; at = [0, 7, 0]; mm = 0.1',
        ),
        (("MOVE TRANS(300, 600, 300, 90, 0, 0)", "LEFTY"), 'kind = "configuration"; words = ["righty", "ABOVE"]'),
        (("DISABLE CP",), 'kind = "setting"; of = "cp"; value = "OFF"'),
        (("PARAMETER PROFILE = SCURVE",), 'kind = "setting"; of = "PROFILE"; value = "SCURVE"'),
        (("PARAMETER ROUNDING = 10",), 'kind = "setting"; of = "ROUNDING"; value = 10'),
        (
            ("DRIVE 1, 30, 50", "DRIVE 2, 5"),
            'kind = "motion"; seconds = [0.88, 0.89]; space = "joint"; profile = "LSPB"',
        ),
        (("READY AT 3", "DRIVE 1, 9 AT 4"), 'kind = "motion"; begins = 4; lead = 4; displaced = false; joints = 1'),
        (SPLICE, 'kind = "phases"; order = ["cruise", "blend"]'),
        (SPLICE, 'kind = "phases"; order = ["accelerate", "cruise", "blend", "cruise", "decelerate"]; only = true'),
        (("MOVE TRANS(0, 500, 0, 90, 90, 0)",), 'kind = "passes"; at = [0, 500, 0]; mm = [0, 0.1]'),
        (("DRIVE 1, 30", "DRIVE 1, 3", "UNDO 2"), 'kind = "undone"; commands = 2'),
    ],
)
def test_what_was_done_passes_and_nothing_does_not(lines: tuple[str, ...], text: str) -> None:
    assert judged(lines, text).passed
    if "configuration" not in text:  # the arm is RIGHTY ABOVE from the beginning
        assert not judged((), text).passed


@pytest.mark.parametrize(
    ("lines", "text", "reason"),
    [
        (
            ("DRIVE 1, 30",),
            'kind = "joints"; at = [31]; deg = 0.1',
            "the joints are 30.0, -90.0, 90.0, 0.0, 0.0, 0.0 at 0.67 s",
        ),
        (
            ("DRIVE 1, 30",),
            'kind = "joints"; at = [30]; deg = 1; when = "passed"; count = 2',
            "1 motions ended there, 2 are wanted",
        ),
        (("x = 3",), 'kind = "variable"; of = "x"; value = 3.2; within = 0.1', "x is 3"),
        ((), 'kind = "location"; of = "f:p"; at = [0, 7, 0]; mm = 0.1', "f:p is not defined"),
        (
            ("SET p = TRANS(0, 5, 0, 90, 90, 0)",),
            'kind = "location"; of = "p"; at = [0, 7, 0, 90, 0, 0]; mm = 0.1; deg = 1',
            "p is 2.0 mm from the place that is wanted, turned by 90.0 deg",
        ),
        ((), 'kind = "configuration"; words = ["LEFTY"]', "the arm is RIGHTY ABOVE NOFLIP"),
        ((), 'kind = "setting"; of = "CP"; value = "OFF"', "CP is ON"),
        (("DRIVE 1, 30",), 'kind = "motion"; space = "straight"', "DRIVE 1, 30 is a motion in joint space"),
        (("DRIVE 1, 30",), 'kind = "motion"; profile = "SCURVE"', "DRIVE 1, 30 has the profile LSPB"),
        (("DRIVE 1, 30",), 'kind = "motion"; seconds = [1, 2]', "DRIVE 1, 30 takes 0.67 s"),
        (("DRIVE 6, 30",), 'kind = "motion"; mm = [1, 2]', "DRIVE 6, 30 ends 0.0 mm from where it begins"),
        (("DRIVE 1, 30",), 'kind = "motion"; joints = 2', "DRIVE 1, 30 turns 1 joints"),
        (("DRIVE 1, 30 AT 2",), 'kind = "motion"; lead = 3', "DRIVE 1, 30 AT 2 begins 2.00 s after its command"),
        (("READY AT 3",), 'kind = "motion"; begins = 3', "nothing has moved in this step"),
        (("DRIVE 1, 30",), 'kind = "phases"; order = ["blend"]', "the timeline has accelerate, cruise, decelerate"),
        (
            ("DRIVE 1, 30",),
            'kind = "passes"; at = [0, 0, 0]; mm = [0, 5]',
            "the tool comes within 933.3 mm of the place",
        ),
        ((), 'kind = "program"; of = "nod"', "there is no program nod"),
    ],
)
def test_what_is_missing_is_said(lines: tuple[str, ...], text: str, reason: str) -> None:
    found = judged(lines, text)
    assert (found.passed, found.reason) == (False, reason)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ('kind = "joints"; at = [30, "some"]; deg = 1', 'the joints in degrees, such as [0, -90, 90, 0, 0, 0]; "any"'),
        ('kind = "joints"; at = [30]; deg = 1; when = "never"', "it is one of end, passed"),
        ('kind = "joints"; at = [30]; deg = 1; count = 1.5', "1.5 is no whole number"),
        ('kind = "variable"; of = "3x"; value = 1', "'3x': the name of a variable, such as height"),
        ('kind = "variable"; of = "x"; value = [1]', "[1]: a number, or a text in quotes"),
        ('kind = "location"; of = "a::b"; at = [0, 0, 0]; mm = 1', "'a::b': the name of a location"),
        ('kind = "setting"; of = "PROFIL"; value = "x"', "'PROFIL': a switch ("),
        ('kind = "configuration"; words = ["UP"]', "UP is none of RIGHTY, LEFTY"),
        ('kind = "motion"; seconds = [2, 1]', "[2, 1]: the least and the most, such as [0.5, 2]"),
        ('kind = "phases"; order = ["stop"]', "'stop' is none of rest, accelerate"),
        ('kind = "motion"; space = "curved"', "it is one of joint, straight"),
    ],
)
def test_a_wrong_value_is_told_with_what_is_right(text: str, said: str) -> None:
    check, wrong = read(text)
    assert check is None
    assert len(wrong) == 1
    assert said in wrong[0]
