from __future__ import annotations

from pathlib import Path

import pytest

from tests.cli.conftest import Vrs
from tests.convert.readers import READERS, Input, Joints, Line, Output
from vrs_cli.convert.writers import TARGETS

PLACE = """\
.PROGRAM place()
    TYPE "begin"
    MOVE TRANS(300, 450, -100, 90, 90, 0)
    BREAK
    WAIT SIG(1001)
    SIGNAL 2
    MOVE #PPOINT(0,-45,180,0,45,0) AT 9
.END
"""


@pytest.fixture
def place(tmp_path: Path) -> str:
    path = tmp_path / "place.v2"
    path.write_text(PLACE)
    return str(path)


@pytest.fixture
def signals(tmp_path: Path) -> str:
    path = tmp_path / "signals.csv"
    path.write_text("4, 1001, on\n")
    return str(path)


@pytest.mark.parametrize("target", list(TARGETS))
def test_the_program_goes_to_standard_output_and_all_else_to_standard_error(
    vrs: Vrs, place: str, signals: str, target: str
) -> None:
    ended = vrs("convert", place, "--to", target, "--signals", signals)
    assert ended.status == 0
    operations = READERS[target](ended.out)
    assert sum(isinstance(one, Joints | Line) for one in operations) == (2 if target == "python" else 3)
    assert [one for one in operations if isinstance(one, Output | Input)] == [Input(1001, True), Output(2, True)]
    assert ended.err.startswith("begin\n")
    assert ("begins at 9.000 s: written without the time" in ended.err) is (target != "python")


def test_a_file_takes_the_program(vrs: Vrs, place: str, signals: str, tmp_path: Path) -> None:
    ended = vrs("convert", place, "--to", "rapid", "--signals", signals, "-o", str(tmp_path / "place.mod"))
    assert (ended.status, ended.out) == (0, "begin\n")
    assert READERS["rapid"]((tmp_path / "place.mod").read_text())


def test_what_an_error_leaves_is_written_with_status_1(vrs: Vrs, place: str) -> None:
    ended = vrs("convert", place, "--to", "krl")
    assert ended.status == 1
    assert "*Endless wait*" in ended.err
    assert "; here the program stopped: *Endless wait*" in ended.out
    assert sum(isinstance(one, Joints) for one in READERS["krl"](ended.out)) == 2


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["--to", "ursript"], "vrs convert: unknown target ursript (did you mean urscript?)"),
        (["--to", "fanuc"], "vrs convert: unknown target fanuc (known: urscript, rapid, krl, python)"),
        (
            ["--to", "krl", "--robot", "so100"],
            "vrs convert: KRL moves robots with the joints RRRRRR or RRRRRRR or RRPR",
        ),
        (["--to", "krl", "-o", "no/where.src"], "vrs convert: "),
        ([], "vrs convert: the following arguments are required: --to"),
    ],
)
def test_what_cannot_be_written(vrs: Vrs, place: str, arguments: list[str], told: str) -> None:
    ended = vrs("convert", place, *arguments)
    assert ended.status == 2
    assert not ended.out
    assert ended.err.startswith(told)
    assert ended.err.count("\n") == 1


def test_a_file_with_mistakes_is_not_written(vrs: Vrs, tmp_path: Path) -> None:
    (tmp_path / "wrong.v2").write_text(".PROGRAM w()\n MVOE x\n.END\n")
    ended = vrs("convert", str(tmp_path / "wrong.v2"), "--to", "rapid")
    assert (ended.status, ended.out) == (1, "")
    assert "did you mean MOVE?" in ended.err


def test_rapid_as_written_names_what_it_cannot_say(vrs: Vrs, place: str, signals: str) -> None:
    ended = vrs("convert", place, "--to", "rapid", "--as-written", "--signals", signals)
    assert ended.status == 1
    assert ended.err == "begin\nvrs convert: place.v2:7: no counterpart: MOVE at a time\n"
    assert "WaitUntil DInput(di1) = 1;" in ended.out
    assert "! NOT SAID: MOVE at a time (line 7)" in ended.out


def test_rapid_as_written_that_says_all_has_status_0(vrs: Vrs) -> None:
    ended = vrs("convert", "pick_and_place.v2", "--to", "rapid", "--as-written")
    assert ended.status == 0
    assert "vrs convert" not in ended.err


def test_as_written_is_for_rapid(vrs: Vrs, place: str) -> None:
    ended = vrs("convert", place, "--to", "krl", "--as-written")
    assert (ended.status, ended.err) == (
        2,
        "vrs convert: --as-written is for --to rapid (leave it out for what was executed)\n",
    )
