from __future__ import annotations

import subprocess
import sys
from io import StringIO
from pathlib import Path

import pytest

from tests.cli.conftest import Vrs

VRS = [sys.executable, "-m", "vrs_cli"]


def fed(text: str, *arguments: str, folder: Path) -> subprocess.CompletedProcess[str]:
    """vrs with these arguments and `text` on a pipe."""
    return subprocess.run([*VRS, *arguments], input=text, capture_output=True, text=True, check=False, cwd=folder)


@pytest.mark.parametrize("arguments", [(), ("shell",)])
def test_without_a_terminal_lines_are_executed(tmp_path: Path, arguments: tuple[str, ...]) -> None:
    ended = fed("WHERE\n", *arguments, folder=tmp_path)
    assert (ended.returncode, ended.stderr) == (0, "")
    assert {"149.090", "921.120", "JT6"} <= set(ended.stdout.split())


def test_a_file_is_loaded_first(tmp_path: Path) -> None:
    (tmp_path / "hello.v2").write_text('.PROGRAM hello\n    TYPE "hello"\n.END\n')
    ended = fed("EXECUTE hello\n", "shell", "hello.v2", folder=tmp_path)
    assert ended.returncode == 0
    assert "hello" in ended.stdout.splitlines()


def test_a_line_that_fails_is_told_by_the_status(tmp_path: Path) -> None:
    ended = fed("WHEER\nWHERE\n", folder=tmp_path)
    assert ended.returncode == 1
    assert "149.090" in ended.stdout
    assert "Traceback" not in ended.stdout + ended.stderr


def test_a_robot_that_is_not_there(tmp_path: Path) -> None:
    ended = fed("WHERE\n", "--robot", "none.toml", folder=tmp_path)
    assert (ended.returncode, ended.stdout) == (2, "")
    assert ended.stderr == "vrs: *Nonexistent file* none.toml\n"


def test_real_time_on_a_pipe(tmp_path: Path) -> None:
    ended = fed("CLOCK\nDRIVE 1, 20, 100\nBREAK\nWHERE\n", "--realtime", "1000", folder=tmp_path)
    assert ended.returncode == 0
    assert ", rate 1000\n" in ended.stdout
    assert "20.000   -90.000    90.000" in ended.stdout


def test_a_rate_that_is_none(tmp_path: Path) -> None:
    ended = fed("", "--realtime", "-1", folder=tmp_path)
    assert (ended.returncode, ended.stdout) == (2, "")
    assert "--realtime: -1 is not above 0" in ended.stderr


# --- a journal of the shell --------------------------------------------------------------------------------


def test_a_session_is_recorded_and_goes_on_in_the_next(tmp_path: Path) -> None:
    ended = fed("DRIVE 1, 60\nDRIVE 2, 10\nUNDO\n", "shell", "--save", "j.vrst", folder=tmp_path)
    assert (ended.returncode, ended.stdout.splitlines()[0]) == (0, "j.vrst is begun")
    with (tmp_path / "j.vrst").open("ab") as file:
        file.write(b'{"version":3,"mot')
    ended = fed("REDO\nTIMELINE\n", "--save", "j.vrst", folder=tmp_path)
    assert ended.stdout.splitlines()[:3] == [
        "its last line was not written to the end, and was left out",
        "j.vrst goes on: 1 command, clock at 1.032 s",
        "DRIVE 2, 10 is done again; the clock is at 1.503 s",
    ]
    assert (tmp_path / "j.vrst").read_bytes().count(b"\n") == 5


def test_the_journal_of_a_session_is_not_overwritten_by_it(tmp_path: Path) -> None:
    ended = fed("DISABLE INTERACTIVE\nREADY\nSAVE j\nSTORE j.vrst\nSAVE k\n", "--save", "j.vrst", folder=tmp_path)
    assert ended.returncode == 1
    assert ended.stdout.count("*File error* j.vrst holds all of this session already") == 1
    assert (tmp_path / "j.vrst").read_bytes() == (tmp_path / "k.vrst").read_bytes()


@pytest.mark.parametrize(
    ("arguments", "status", "told"),
    [
        (("--save", "none/j.vrst"), 2, "there is no folder none"),
        (("--save", "bad.vrst"), 1, "bad.vrst has no whole first line"),
    ],
)
def test_a_file_that_cannot_be_written_on_is_refused_at_once(
    tmp_path: Path, arguments: tuple[str, ...], status: int, told: str
) -> None:
    (tmp_path / "bad.vrst").write_bytes(b"x")
    ended = fed("DRIVE 1, 60\n", *arguments, folder=tmp_path)
    assert (ended.returncode, ended.stdout) == (status, "")
    assert told in ended.stderr
    assert (tmp_path / "bad.vrst").read_bytes() == b"x"


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("EDIT pick.v2", "EDIT takes the name of a program, not of a file (LOAD pick.v2 loads a file, EDIT pick opens"),
        ("SEE pick.pg", "SEE takes the name of a program, not of a file (LOAD pick.pg loads a file, SEE pick opens"),
        ("quit()", "quit() (EXIT or Ctrl-D leaves)"),
        ("exit()", "exit() (EXIT or Ctrl-D leaves)"),
    ],
)
def test_what_newcomers_type_leads_to_the_right_word(
    vrs: Vrs, monkeypatch: pytest.MonkeyPatch, line: str, said: str
) -> None:
    monkeypatch.setattr("sys.stdin", StringIO(line))
    assert said in vrs("shell").out


def test_an_argument_that_is_missing_is_named_with_all_parameters(vrs: Vrs, monkeypatch: pytest.MonkeyPatch) -> None:
    lines = (".PROGRAM pick(part, height)", "TYPE height", ".END", "EXECUTE pick(p)")
    monkeypatch.setattr("sys.stdin", StringIO("\n".join(lines)))
    assert "height (its argument was left out: CALL pick(part, height) gives it, or EXECUTE)" in vrs("shell").out
