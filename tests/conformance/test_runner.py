"""The runner of the suite: it finds vrs right, sees what is wrong, and sums up."""

from __future__ import annotations

import re
import shlex
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.conformance import __main__ as suite
from tests.conformance import cases

VRS = f"{shlex.quote(sys.executable)} -m vrs_cli run {{program}} --quiet --signals {{signals}}"
FAULT = r"Program (?P<program>\S+) stopped at step (?P<step>\d+)"
OF_EACH_KIND = ("prompt.values", "tasks_input_time", "file_append", "error.straight", "motion.depart", "val.branches")


@pytest.mark.parametrize("name", OF_EACH_KIND)
def test_the_runner_finds_vrs_right(name: str) -> None:
    case = cases.read_case(name)
    assert suite.judge(case, VRS, re.compile(FAULT), 60.0, ends=True) == []


@pytest.mark.parametrize(
    ("name", "other", "wrong"),
    [
        ("arith.basic", lambda text: text.replace("expect: 5", "expect: 6"), "typed ['5', '-1', '6', '1.5'], not ['6'"),
        ("motion.depart", lambda text: text.replace("end: -107", "end: -106"), "ended at -107.6"),
        ("file_append", lambda text: text.replace("; written:", "; was:"), "wrote {"),
        ("error.straight", lambda text: text.replace("straight 4", "straight 5"), "the step of the error is 4, not 5"),
        ("error.straight", lambda text: text.replace("; fault:", "; was:"), "the status is 1, and the program is to c"),
    ],
)
def test_the_runner_finds_out_what_is_wrong(
    name: str, other: Callable[[str], str], wrong: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    text = cases.read_case(name).text
    assert other(text) != text
    (tmp_path / "programs").mkdir()
    (tmp_path / "programs" / f"{name}.v2").write_text(other(text))
    monkeypatch.setattr(cases, "HOME", tmp_path)
    found = suite.judge(cases.read_case(name), VRS, re.compile(FAULT), 60.0, ends=True)
    assert [one for one in found if one.startswith(wrong)], found


def test_the_runner_sums_up(capsys: pytest.CaptureFixture[str]) -> None:
    echo = shlex.join([sys.executable, "-c", "print(5); print(-1); print(6); print(1.5)", "{program}"])
    assert suite.main(["--only", "arith.*s*c", "--command", echo]) == 0
    assert capsys.readouterr().out == "found        1 of 1\n1 of 1 programs do what their rules say\n"
    assert suite.main(["--only", "arith.left", "--command", echo]) == 1
    assert "arith.left: typed ['5', '-1', '6', '1.5'], not ['1', '4']" in capsys.readouterr().out


def test_the_runner_stops_what_does_not_end() -> None:
    for_ever = shlex.join([sys.executable, "-c", "while True: pass", "{program}"])
    assert suite.judge(cases.read_case("arith.left"), for_ever, None, 0.2, ends=True) == ["not over after 0.2 s"]


def test_a_command_that_is_not_there_is_told() -> None:
    with pytest.raises(SystemExit, match=r"^no-such-interpreter: No such file"):
        suite.main(["--only", "arith.left", "--command", "no-such-interpreter {program}"])


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ((), "--command is needed"),
        (("--command", "vrs run"), "--command is needed"),
        (("--command", "vrs run {program}", "--fault", "(?P<line>1)"), "--fault: the groups of an error are code"),
        (("--command", "vrs run {program}", "--only", "nothing.*"), "no program is like that"),
    ],
)
def test_a_command_line_that_cannot_be_is_refused(
    arguments: tuple[str, ...], said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit):
        suite.main(arguments)
    assert said in capsys.readouterr().err


def test_the_rules_can_be_listed(capsys: pytest.CaptureFixture[str]) -> None:
    assert suite.main(["--list", "--language", "VAL", "--confidence", "likely"]) == 0
    (line,) = capsys.readouterr().out.splitlines()
    assert line.split()[:4] == ["val.grasp", "VAL", "likely", "SL"]
