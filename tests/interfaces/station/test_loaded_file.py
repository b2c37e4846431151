"""Variables that sections of a file bring, and programs and variables that no file holds."""

from __future__ import annotations

from math import degrees, pi
from pathlib import Path
from random import Random
from struct import pack, unpack

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.examples import examples
from tests.interfaces.monitor.people import Person, at
from tests.interfaces.terminals import RecordingTerminal
from vrs_cli.interfaces.inspection import inspect
from vrs_cli.interfaces.session.session import Session
from vrs_cli.interfaces.station.station import Station
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.kinematics.transform import Transform, angle_between, distance, from_oat
from vrs_cli.language.analysis.structure import canonical_text
from vrs_cli.values.diagnostics import Diagnostic, Severity

PUMA = load_robot("puma560")
NOW = from_oat(0.43016, 0.0497, 0.71, pi / 2, pi / 2, 0.0)  # the axes -1 0 0, 0 1 0, 0 0 -1
ROWS = {
    "one line": "now -1 0 0 0 1 0 0 0 -1 430.16 49.70 710.00",
    "two lines": "now -1 0 0 0 1 0\n0 0 -1 430.16 49.70 710.00",
    "two unequal lines": "now -1. .0 0.\t0 1.0 0 0 0 -1.0E0\n 430.16 49.70 710.00",
    "comments": "now -1 0 0 0 1 0 ; taught\n  0, 0, -1, 430.16, 49.70, 710.00 ; today",
}


def loaded(*lines: str) -> tuple[Station, tuple[Diagnostic, ...]]:
    station = Station(RecordingTerminal(), PUMA)
    text = "\n".join((".LOCATIONS", *lines, ".END", ".REALS", "x 5", ".END", ""))
    found = station.load_text(text)
    assert set(inspect(text, PUMA)) == set(found)
    return station, found


def value(station: Station, name: str) -> Transform:
    found = station.environment.value((name, None))
    assert isinstance(found, Transform)
    return found


@pytest.mark.parametrize("written", ROWS)
def test_twelve_numbers_are_a_transformation(written: str) -> None:
    station, found = loaded("#p 0 -90 90 0 0 0", ROWS[written], "last 1 2 3 90 -90 0")
    assert found == ()
    assert distance(value(station, "now"), NOW) < 1e-15
    assert angle_between(value(station, "now"), NOW) < 1e-9
    assert value(station, "last").px == 0.001
    assert station.environment.value(("#p", None)) is not None


@examples(200)
@given(st.integers(0, 2**32), st.integers(3, 9), st.booleans())
def test_what_a_controller_rounds_is_accepted_and_told(seed: int, decimals: int, two: bool) -> None:
    random = Random(seed)
    poses = {f"p{n}": from_oat(*(random.uniform(-2.0, 2.0) for _ in range(6))) for n in range(3)}
    station, found = loaded(*(written(name, pose, decimals, two=two) for name, pose in poses.items()))
    assert [one.severity for one in found] == [Severity.WARNING] * (decimals < 6 or len(found))
    assert all("axes are rounded by" in one.detail for one in found)
    for name, pose in poses.items():
        assert distance(value(station, name), pose) < 1e-3 * 10.0**-decimals
        assert degrees(angle_between(value(station, name), pose)) < 100.0 * 10.0**-decimals + 1e-6


def test_the_largest_rounding_of_a_section_is_told_once() -> None:
    rows = (written(f"p{n}", from_oat(0.1, 0.2, 0.3, 0.4, 0.5, n), n, two=True) for n in (5, 3, 4))
    _, found = loaded(*rows)
    (told,) = found
    assert told.span.line == 4
    assert told.detail.startswith("p3: its axes are rounded by 0.000")
    assert told.detail.endswith(", and those of 2 more in this section by less")
    (told,) = loaded("now -0.7071 0.7071 0 0.7071 0.7071 0 0 0 -1 1 2 3")[1]
    assert told.detail == "now: its axes are rounded by 7E-06"


@examples(100)
@given(st.integers(0, 2**32))
def test_single_precision_is_no_rounding(seed: int) -> None:
    random = Random(seed)
    pose = from_oat(*(random.uniform(-2.0, 2.0) for _ in range(6)))
    numbers = unpack("12f", pack("12f", *columns(pose)))
    station, found = loaded(" ".join(map(str, ("p", *numbers))))
    assert found == ()
    assert angle_between(value(station, "p"), pose) < 1e-6


def test_every_wrong_line_of_a_section_is_told() -> None:
    _, found = loaded("now -1 0 0 0 1 0", "3x 1", "0 0 -1 1 2 3", "p 1 2")
    assert [one.span.line for one in found if one.severity is Severity.ERROR] == [3, 4, 5]


@examples(200)
@given(st.integers(0, 2**32), st.sampled_from(["axis", "mirrored", "short", "long", "zero", "huge", "other rows"]))
def test_what_is_no_rotation_loads_nothing_of_its_section(seed: int, wrong: str) -> None:
    random = Random(seed)
    numbers = columns(from_oat(*(random.uniform(-2.0, 2.0) for _ in range(6))))
    at = random.randrange(9)
    if wrong == "axis":
        numbers[at] += random.choice((-1.0, 1.0)) * random.uniform(0.02, 3.0)
    elif wrong == "mirrored":
        column = 3 * random.randrange(3)
        numbers[column : column + 3] = [-x for x in numbers[column : column + 3]]
    elif wrong == "short":
        del numbers[random.randrange(1, 12) :]
    elif wrong == "long":
        numbers.append(1.0)
    elif wrong == "other rows":  # position behind each row
        numbers = [x for row in range(3) for x in (*numbers[row:9:3], numbers[9 + row] + 2.0)]
    else:
        numbers[at] = 0.0 if wrong == "zero" else 1e30
        numbers[:9] = [0.0] * 9 if wrong == "zero" else numbers[:9]
    if wrong == "short" and len(numbers) == 6:
        return  # x y z o a t
    station, found = loaded("good 1 2 3 90 -90 0", "bad " + " ".join(map(repr, numbers)), "#p 0 -90 90 0 0 0")
    assert [one.span.line for one in found if one.severity is Severity.ERROR] == [3]
    assert "nothing of .LOCATIONS is loaded" in [one.detail for one in found]
    assert set(station.environment.kinds) == {"x"}


@pytest.mark.parametrize("row", ["now -1 0 0 0 1 0\n; here\n0 0 -1 1 2 3", "0 0 -1 1 2 3", "#p 1 2 3\n4 5 6", "a[i] 1"])
def test_numbers_alone_belong_to_the_line_above(row: str) -> None:
    station, found = loaded(row)
    assert any(one.severity is Severity.ERROR for one in found)
    assert set(station.environment.kinds) == {"x"}


@pytest.mark.parametrize("written", ROWS)
def test_fmt_keeps_the_numbers(written: str) -> None:
    text = f".LOCATIONS\n{ROWS[written]}\n.END\n"
    printed = canonical_text(text)
    assert isinstance(printed, str)
    assert canonical_text(printed) == printed
    assert printed.count("\n") == 4
    station, found = loaded(*printed.splitlines()[1:-1])
    assert found == ()
    assert distance(value(station, "now"), NOW) < 1e-15


def written(name: str, pose: Transform, decimals: int, *, two: bool) -> str:
    numbers = [f"{x:.{decimals}f}" for x in columns(pose)]
    return f"{name} {' '.join(numbers[:6])}{chr(10) if two else ' '}{' '.join(numbers[6:])}"


def columns(T: Transform) -> list[float]:
    """The axes n, s, a and the position [mm]."""
    return [*T[0::4], *T[1::4], *T[2::4], *(1000.0 * x for x in T[3::4])]


PROGRAM = ".PROGRAM p\nMOVE part\nSET made = HERE\n.END\n"


@pytest.fixture
def session(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Session:
    monkeypatch.chdir(tmp_path)
    Path("cell.v2").write_text(PROGRAM + ".LOCATIONS\npart 500 150 -100 90 90 0\n.END\n.REALS\nn 1\n.END\n")
    return at(Person(), "LOAD cell")


def told(session: Session) -> tuple[list[str], list[str]]:
    """The programs, and the variables."""
    unstored = session.unstored
    return unstored.programs(), sorted(map(session.environment.name_of, unstored.items()))


def test_what_was_loaded_is_stored(session: Session) -> None:
    assert told(session) == ([], [])


def test_what_is_typed_is_not_until_it_is_stored(session: Session) -> None:
    for line in ("n = 2", "SET part = HERE", "row[3] = 1", '$s = "x"'):
        session.perform(line)
    session.load_text(".PROGRAM q\n.END\n")
    assert told(session) == (["q"], ["$s", "n", "part", "row[3]"])
    session.perform("STORER numbers")
    assert told(session) == (["q"], ["$s", "part"])
    session.perform("STORE all")
    assert told(session) == ([], [])


def test_a_value_that_is_as_it_was_needs_no_storing(session: Session) -> None:
    for line in ("n = 2", "n = 1"):
        session.perform(line)
    assert told(session) == ([], [])


def test_what_a_program_computes_needs_no_storing(session: Session) -> None:
    session.perform("EXECUTE p")
    assert "made" in {item[0] for item in session.environment.values()}
    assert told(session) == ([], [])
    session.perform("SET made = NULL")
    assert told(session) == ([], ["made"])


def test_what_was_typed_before_a_program_changes_it_does(session: Session) -> None:
    session.perform("SET made = NULL")
    session.perform("EXECUTE p")
    assert told(session) == ([], ["made"])


def test_an_edited_program_is_not_stored_and_one_left_as_it_was_is(session: Session) -> None:
    for line in ("EDIT p", "E"):
        session.perform(line)
    assert told(session) == ([], [])
    for line in ("EDIT p", "READY", "E"):
        session.perform(line)
    assert told(session) == (["p"], [])


def test_a_part_that_is_stored_alone(session: Session) -> None:
    session.load_text(".PROGRAM q\nMOVE b\n.END\n.PROGRAM r\n.END\n")
    session.perform("SET b = HERE")
    session.perform("SET c = HERE")
    session.perform("STORE one = q")
    assert told(session) == (["r"], ["c"])
