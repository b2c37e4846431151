from __future__ import annotations

import json
import math
import os
import shutil
import signal
import socket
import subprocess
import sys
import time
import tracemalloc
from io import StringIO
from itertools import cycle
from pathlib import Path
from types import SimpleNamespace

import pytest

from tests.cli.conftest import Vrs
from tests.interfaces.terminals import RecordingTerminal
from tests.live import PATIENCE
from vrs_cli.cli.batch import BatchTerminal
from vrs_cli.files.trajectory_file import read_trajectory
from vrs_cli.interfaces.session.session import Session
from vrs_cli.interfaces.tasks.limits import Isolation

PICK = """\
.PROGRAM pick
    TYPE "begin"
    MOVE #safe
    FOR i = 1 TO 2
        MOVE #PPOINT(10*i,-45,180,0,45,0)
        BREAK
        TYPE "at", i
    END
    READY
.END
.PROGRAM other
    TYPE "other"
.END
.LOCATIONS
#safe 0 -45 180 0 45 0
.END
"""
ASK = """\
.PROGRAM ask
    PROMPT "How many? ", n
    TYPE "double", 2*n
.END
"""
FAR = """\
.PROGRAM far
    TYPE "going"
    MOVE TRANS(300,300,0,90,90,0)
    MOVE TRANS(3000,0,0,90,90,0)
.END
"""
FOREVER = """\
.PROGRAM loop
10  TYPE "round"
    MOVE #a
    MOVE #b
    GOTO 10
.END
.LOCATIONS
#a 0 -90 90 0 0 0
#b 20 -90 90 0 0 0
.END
"""


@pytest.fixture(autouse=True)
def _programs(tmp_path: Path) -> None:
    for name, text in (("pick.v2", PICK), ("ask.v2", ASK), ("far.v2", FAR), ("forever.v2", FOREVER)):
        (tmp_path / name).write_text(text)


def test_a_program_that_needs_its_cell_runs_in_it(vrs: Vrs, tmp_path: Path) -> None:
    (tmp_path / "cell.toml").write_text(
        "[signals]\ngo = 1\nthere = 1001\n[[follow]]\nwhen = 'go'\nset = 'there'\nafter = 2\n"
    )
    (tmp_path / "fetch.v2").write_text(".PROGRAM fetch\n    SIGNAL 1\n    WAIT SIG(1001)\n    TYPE TIME\n.END\n")
    assert vrs("run", "fetch.v2", "--cell", "cell.toml").out.split("\n")[0].strip() == "2"
    (tmp_path / "cell.toml").write_text("[signals]\ngo = 0\n")
    refused = vrs("run", "fetch.v2", "--cell", "cell.toml")
    assert refused.status != 0
    assert "cell.toml:2: go: 0 is no signal" in refused.err


@pytest.mark.parametrize("name", ["planar2", "nobody"])
def test_a_file_may_name_its_robot(vrs: Vrs, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str) -> None:
    (tmp_path / "two.v2").write_text(f"; robot: {name}\n.PROGRAM two\n    DRIVE 5, 1\n.END\n")
    monkeypatch.setattr("sys.stdin", StringIO("DRIVE 5, 1\n"))
    for words in (("run", "two.v2"), ("check", "two.v2"), ("two.v2",)):
        ended = vrs(*words)
        assert ("joints are 1 to 2" in ended.out + ended.err) == (name == "planar2")
        assert ("two.v2:1: no robot is called 'nobody'" in ended.err) == (name == "nobody")
        assert "joints are" not in vrs(*words, "--robot", "puma560").err


# --- what a run tells --------------------------------------------------------------------------------------


def test_a_run_types_and_completes(vrs: Vrs) -> None:
    ended = vrs("run", "pick.v2")
    assert ended == (0, "begin\nat 1\nat 2\nProgram completed\n", "")


def test_quiet_is_what_the_program_types(vrs: Vrs) -> None:
    assert vrs("run", "pick.v2", "--quiet").out == "begin\nat 1\nat 2\n"


@pytest.mark.parametrize("name", ["other", "OTHER"])
def test_a_program_by_name(vrs: Vrs, name: str) -> None:
    assert vrs("run", "pick.v2", name).out == "other\nProgram completed\n"


def test_the_extension_may_be_left_out_and_cycles_given(vrs: Vrs) -> None:
    assert vrs("run", "pick", "other", "--cycles", 3, "--quiet").out == "other\n" * 3


def test_a_sample_runs_from_any_folder_and_writes_there(
    vrs: Vrs, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert "Program completed" in vrs("run", "log").out
    assert (tmp_path / "parts.csv").exists()
    (tmp_path / "log.v2").write_text('.PROGRAM log\n  TYPE "mine"\n.END\n')
    assert vrs("run", "log").out.startswith("mine")


def test_json_is_one_object(vrs: Vrs) -> None:
    ended = vrs("run", "pick.v2", "--json")
    assert (ended.status, ended.err) == (0, "begin\nat 1\nat 2\nProgram completed\n")
    told = json.loads(ended.out)
    assert set(told) == {"program", "cycles", "duration_s", "segments", "commands", "final", "typed", "errors"}
    assert (told["program"], told["cycles"], told["errors"]) == ("pick", 1, [])
    assert told["typed"] == ["begin", "at 1", "at 2"]
    assert told["final"]["joints_deg"] == pytest.approx([0, -90, 90, 0, 0, 0], abs=1e-9)
    assert told["final"]["xyz_mm"] == pytest.approx([-20.32, 149.09, 921.12], abs=1e-9)
    assert told["final"]["oat_deg"] == pytest.approx([90, -90, 0], abs=1e-9)
    assert [set(command) for command in told["commands"]] == [{"text", "t_iss", "t_asked", "t_exec", "t_end"}] * 4
    assert told["duration_s"] == told["commands"][-1]["t_end"] > 1.0
    assert told["segments"] >= 8  # of four motions


def test_the_same_run_gives_the_same_bytes(vrs: Vrs) -> None:
    for name in ("a", "b"):
        assert vrs("run", "pick.v2", "--save", f"{name}.vrst", "--csv", f"{name}.csv").status == 0
    for suffix in (".vrst", ".csv"):
        assert Path(f"a{suffix}").read_bytes() == Path(f"b{suffix}").read_bytes()


def test_the_files_of_a_run_agree(vrs: Vrs) -> None:
    told = json.loads(vrs("run", "pick.v2", "--json", "--save", "t.vrst", "--csv", "t.csv", "--rate", 20).out)
    timeline = read_trajectory("t.vrst").timeline
    assert len(timeline) - 1 == told["segments"]
    assert vrs("export", "t.vrst", "--to", "csv", "--rate", 20).out == Path("t.csv").read_text()
    [last] = json.loads(vrs("where", "t.vrst", "--at", timeline.end, "--json").out)
    assert last["joints_deg"] == told["final"]["joints_deg"]


def test_a_table_on_standard_output_stands_alone(vrs: Vrs) -> None:
    ended = vrs("run", "pick.v2", "--csv", "-", "--rate", 5)
    assert ended.out.startswith("t,jt1,")
    assert "begin" not in ended.out
    assert ended.err == "begin\nat 1\nat 2\nProgram completed\n"


@pytest.mark.parametrize("wanted", [("--json",), ("--csv", "-", "--rate", 5)])
def test_a_question_of_the_program_does_not_stand_in_the_result(
    vrs: Vrs, monkeypatch: pytest.MonkeyPatch, wanted: tuple[str | int, ...]
) -> None:
    monkeypatch.setattr("sys.stdin", StringIO("21\n"))
    ended = vrs("run", "ask.v2", *wanted)
    assert ended.err == "How many? \ndouble 42\nProgram completed\n"
    assert "How many" not in ended.out.splitlines()[0]
    if wanted == ("--json",):
        assert json.loads(ended.out)["typed"] == ["double 42"]
    else:
        assert all(line.count(",") == 12 for line in ended.out.splitlines())


def test_warnings_are_told_apart_in_json(vrs: Vrs, tmp_path: Path) -> None:
    (tmp_path / "bad.v2").write_text(".PROGRAM bad\nx = y\nGOTO 5\n.END\n")
    told = json.loads(vrs("run", "bad.v2", "--json").out)
    assert [(error["line"], error["severity"]) for error in told["errors"]] == [(2, "warning"), (3, "error")]


SURPRISING = """\
.PROGRAM main
    SPEED 500
    DELAY 2
    TYPE TIMER(1)
    CALL sub
    RETURN
    TYPE "never"
.END
.PROGRAM sub
    ENABLE BELT
    ACCEL 120 ; vrs: ignore V064
.END
"""


def test_a_run_tells_what_it_carries_out_otherwise_than_meant_as_check_does(vrs: Vrs, tmp_path: Path) -> None:
    (tmp_path / "slow.v2").write_text(SURPRISING)
    told = [line for line in vrs("check", "slow.v2").out.splitlines() if "warning: *" in line]
    assert {line.split()[1] for line in told} >= {"V064", "V060"}
    assert len(told) >= 3
    ended = vrs("run", "slow.v2")
    assert [line for line in ended.err.splitlines() if "warning: *" in line] == told
    assert ended.out == " 0\nProgram completed\n"
    assert vrs("run", "slow.v2", "--quiet") == (0, " 0\n", "")
    assert json.loads(vrs("run", "slow.v2", "--json").out)["errors"] == []


def test_a_step_that_must_fail_is_told_once_in_a_run(vrs: Vrs, tmp_path: Path) -> None:
    (tmp_path / "bad.v2").write_text(".PROGRAM bad\nSPEED 500\nSIGNAL 5000\n.END\n")
    assert vrs("run", "bad.v2").err.count("*Illegal digital signal*") == 1


def test_a_plot(vrs: Vrs) -> None:
    pytest.importorskip("matplotlib")
    assert vrs("run", "pick.v2", "--plot", "t.svg").status == 0
    assert "<svg" in Path("t.svg").read_text()


# --- errors ------------------------------------------------------------------------------------------------


def test_an_error_of_the_program_has_its_place(vrs: Vrs) -> None:
    ended = vrs("run", "far.v2")
    assert ended.status == 1
    assert ended.out == "going\n"
    first, line, carets, place = ended.err.splitlines()
    assert first.startswith("far.v2:4: *Location ")
    assert line.strip() == "MOVE TRANS(3000,0,0,90,90,0)"
    assert carets.strip() == "^" * len(line.strip())
    assert place == "Program far stopped at step 3"


def test_an_error_in_json(vrs: Vrs) -> None:
    ended = vrs("run", "far.v2", "--json", "--save", "far.vrst")
    assert ended.status == 1
    assert ended.err.startswith("going\nfar.v2:4: *Location ")
    told = json.loads(ended.out)
    [error] = told["errors"]
    assert error["severity"] == "error"
    assert (error["program"], error["step"], error["line"]) == ("far", 3, 4)
    assert error["code"] in (-610, -619)
    assert error["message"].startswith("*Location ")
    assert len(told["commands"]) == len(read_trajectory("far.vrst").deltas) == 1


def test_an_error_in_json_has_its_numbers(vrs: Vrs, tmp_path: Path) -> None:
    (tmp_path / "out.v2").write_text(".PROGRAM out\nDRIVE 1, 200\n.END\n.PROGRAM none\nx = SQRT(-1)\n.END\n")
    [error] = json.loads(vrs("run", "out.v2", "--json").out)["errors"]
    lower, upper = (sign * math.radians(160.0) for sign in (-1.0, 1.0))
    assert (error["joint"], error["lower"], error["upper"]) == (1, pytest.approx(lower), pytest.approx(upper))
    assert error["value"] == pytest.approx(math.radians(200.0))
    assert "place" not in error
    [error] = json.loads(vrs("run", "out.v2", "none", "--json").out)["errors"]
    assert set(error) == {"severity", "code", "message", "program", "step", "line"}


def test_all_mistakes_of_a_file_at_once_and_nothing_runs(vrs: Vrs, tmp_path: Path) -> None:
    (tmp_path / "bad.v2").write_text('.PROGRAM bad\nTYPE "x"\nMOVEE a\nGOTO 5\n.END\n')
    ended = vrs("run", "bad.v2", "--save", "t.vrst")
    assert (ended.status, ended.out) == (1, "")
    assert "bad.v2:3:1: V452 *Unknown instruction* " in ended.err
    assert "bad.v2:4:" in ended.err
    assert not Path("t.vrst").exists()
    told = json.loads(vrs("run", "bad.v2", "--json").out)
    assert [(error["line"], error["severity"]) for error in told["errors"]] == [(3, "error"), (4, "error")]
    assert told["program"] is None


def test_prompt_reads_standard_input(vrs: Vrs, monkeypatch: pytest.MonkeyPatch) -> None:
    process = subprocess.run(
        [sys.executable, "-m", "vrs_cli", "run", "ask.v2"], input="21\n", capture_output=True, text=True, check=True
    )
    assert process.stdout == "How many? \ndouble 42\nProgram completed\n"
    with open(os.devnull) as nothing:
        monkeypatch.setattr("sys.stdin", nothing)
        ended = vrs("run", "ask.v2")
    assert ended.status == 1
    assert "ask.v2:2: *Unexpected end of file* PROMPT 'How many? '" in ended.err


def test_a_program_that_does_not_end_is_stopped(vrs: Vrs) -> None:
    ended = vrs("run", "forever.v2", "--max-time", 10, "--json")
    assert ended.status == 1
    told = json.loads(ended.out)
    assert told["errors"][0]["message"].startswith("*Program limit reached*")
    assert "(give it more with --max-time)" in told["errors"][0]["message"]
    assert 10.0 <= told["duration_s"] < 20.0


def test_an_at_beyond_the_end_of_the_run_is_refused_where_it_stands(vrs: Vrs, tmp_path: Path) -> None:
    lines = (".PROGRAM far()", "READY", "DRIVE 1, 10, 100 AT 100000", 'TYPE "after"', "DRIVE 1, 10, 100", ".END")
    (tmp_path / "late.v2").write_text("\n".join(lines) + "\n")
    ended = vrs("run", tmp_path / "late.v2")
    assert ended.status == 1
    assert "late.v2:3: *Illegal value* AT 100000 (the program is stopped at 86400 s: give it" in ended.err
    assert "after" not in ended.out


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["none.v2"], "vrs run: *Nonexistent file* none.v2"),
        (["pikc.v2"], "vrs run: *Nonexistent file* pikc.v2 (did you mean pick.v2?)"),
        (["pick.v2", "othr"], "vrs run: pick.v2 holds no program othr (did you mean other?)"),
        (["pick.v2", "zzz"], "vrs run: pick.v2 holds no program zzz (it holds pick, other)"),
        (["empty.v2"], "vrs run: empty.v2 holds no program"),
        (["pick.v2", "--save", "pick.v2"], "vrs run: pick.v2 is named twice"),
        (["pick.v2", "--save", "a", "--csv", "./a"], "vrs run: a is named twice"),
        (["pick.v2", "--save", "pick.v2/t.vrst"], "vrs run: *File error* pick.v2/t.vrst cannot be written: not a dir"),
        (["pick.v2", "--csv", "none/t.csv"], "vrs run: *File error* none/t.csv cannot be written: no such file"),
        (["pick.v2", "--plot", "t.gif"], "vrs run: *No plot* t.gif is no picture file"),
        (["pick.v2", "--json", "--csv", "-"], "vrs run: --json and --csv - both want standard output"),
        (["pick.v2", "--save", "-"], "vrs run: --save - has no file"),
        (["pick.v2", "--cycles", "x"], "vrs run: --cycles: 'x' is not a whole number"),
        (["pick.v2", "--realtime", "0"], "vrs run: --realtime: 0 is not above 0"),
        (["pick.v2", "--robot", "puma561"], "vrs run: *Nonexistent file* no robot is called 'puma561'"),
    ],
)
def test_a_wrong_command_line_does_nothing(vrs: Vrs, tmp_path: Path, arguments: list[str], told: str) -> None:
    (tmp_path / "empty.v2").write_text("; nothing\n")
    before = sorted(os.listdir())
    ended = vrs("run", *arguments)
    assert (ended.status, ended.out) == (2, "")
    assert ended.err.startswith(told)
    assert ended.err.count("\n") == 1
    assert sorted(os.listdir()) == before


def test_binary_junk_is_no_program(vrs: Vrs, tmp_path: Path) -> None:
    (tmp_path / "junk.v2").write_bytes(bytes(range(256)))
    ended = vrs("run", "junk.v2")
    assert (ended.status, ended.out) == (1, "")
    assert ended.err.startswith("junk.v2:1:1: V503 *File is not what it should be* character 0 in a text")


def test_a_full_disk_at_the_end_is_status_1(vrs: Vrs) -> None:
    ended = vrs("run", "pick.v2", "other", "--csv", "/dev/full")
    assert ended.status == 1
    assert ended.err == (
        "vrs run: *File error* /dev/full cannot be written: no space left on device (name another place)\n"
    )


# --- real time ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("words", [["--realtime", "1000", "pick.v2"], ["--realtime=1e3", "pick.v2"]])
def test_real_time_gives_the_same_trajectory(vrs: Vrs, words: list[str]) -> None:
    assert vrs("run", "pick.v2", "--save", "a.vrst").status == 0
    assert vrs("run", *words, "--save", "b.vrst").status == 0
    assert Path("a.vrst").read_bytes() == Path("b.vrst").read_bytes()


def test_realtime_without_a_rate_does_not_take_the_file(vrs: Vrs) -> None:
    assert vrs("run", "--realtime", "pick.v2", "other").out == "other\nProgram completed\n"


def test_an_interrupted_run_keeps_what_it_saved(tmp_path: Path) -> None:
    process = subprocess.Popen(
        [sys.executable, "-m", "vrs_cli", "run", "forever.v2", "--save", "t.vrst", "--realtime", "20"],
        cwd=tmp_path,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert process.stdout is not None
    for _ in range(3):
        assert process.stdout.readline() == "round\n"
    time.sleep(0.05)
    process.send_signal(signal.SIGINT)
    _, err = process.communicate(timeout=PATIENCE)
    assert process.returncode == 130
    assert err == "vrs run: interrupted\n"
    assert len(read_trajectory(tmp_path / "t.vrst").deltas) >= 4


@pytest.mark.parametrize(
    ("number", "status", "said"),
    [(signal.SIGINT, 130, "interrupted"), (signal.SIGTERM, 143, "terminated")],
)
@pytest.mark.parametrize("waits", [False, True], ids=["busy", "PROMPT"])
def test_a_signal_stops_the_program_and_everything_is_written(
    vrs: Vrs, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, number: int, status: int, said: str, waits: bool
) -> None:
    """Once the third line of the program is typed; or where a line is waited for."""
    (tmp_path / "loop.v2").write_text(FOREVER.replace('TYPE "round"', 'PROMPT "?", n') if waits else FOREVER)
    lines = iter(["1", "2", "3"])

    def readline() -> str:
        return next(lines, "") or str(signal.raise_signal(number))

    monkeypatch.setattr("sys.stdin", SimpleNamespace(readline=readline, isatty=lambda: False))
    count, show = [0], BatchTerminal.type

    def typed(self: BatchTerminal, text: str, newline: bool) -> None:
        show(self, text, newline)
        count[0] += 1
        if count[0] == 3:
            signal.raise_signal(number)

    monkeypatch.setattr(BatchTerminal, "type", typed)
    ended = vrs("run", "loop.v2", "--save", "t.vrst", "--csv", "t.csv", "--cycles", 1)
    assert (ended.status, ended.err) == (status, f"vrs run: {said}\n")
    recording = read_trajectory(tmp_path / "t.vrst")
    assert len(recording.deltas) >= 4
    last = (tmp_path / "t.csv").read_text().splitlines()[-1]
    assert float(last.split(",")[0]) == pytest.approx(recording.timeline.end, abs=1e-6)


def test_cycles_that_cannot_be_are_a_wrong_command_line(vrs: Vrs, tmp_path: Path) -> None:
    (tmp_path / "pick.v2").write_text(PICK)
    ended = vrs("run", "pick.v2", "--cycles", 0)
    assert (ended.status, ended.out) == (2, "")
    assert ended.err == "vrs run: --cycles: 0 cycles (1 to 32767, or -1 for ever) (see vrs run --help)\n"
    assert vrs("run", "pick.v2", "--cycles", 32768).status == 2


def test_of_very_many_mistakes_the_first_are_told(vrs: Vrs, tmp_path: Path) -> None:
    (tmp_path / "bad.v2").write_text(".PROGRAM bad\n" + "MOVEX a\n" * 500 + ".END\n")
    ended = vrs("run", "bad.v2")
    assert (ended.status, ended.out) == (1, "")
    assert ended.err.count("*Unknown instruction*") == 20
    assert ended.err.splitlines()[-1] == "480 more (vrs check bad.v2 shows all)"
    assert vrs("check", "bad.v2").out.count("*Unknown instruction*") == 500


WAITING = """\
.PROGRAM main
    PCEXECUTE beside
    WAIT SIG(1001)
    TYPE "part at", TIME()
.END
.PROGRAM beside
    WAIT SIG(1002)
    x = nothing
.END
"""


def test_signals_of_a_file_come_at_their_times(vrs: Vrs, tmp_path: Path) -> None:
    (tmp_path / "w.v2").write_text(WAITING)
    (tmp_path / "cell.csv").write_text("time, signal, state\n1.5, 1001, ON\n")
    ended = vrs("run", "w.v2", "--signals", "cell.csv")
    assert (ended.status, ended.out.splitlines()[0]) == (0, "part at 1.5")
    assert "task 1 is ended at beside step 1: *Endless wait* waits for SIG(1002), which nothing here turns" in ended.out


SENSOR = '[[sensor]]\nname = "gate"\nkind = "beam"\nsignal = 1004\nfrom = [400, 0, 0]\nto = [400, 100, 0]\n'


def test_signals_that_a_sensor_sets_are_refused(vrs: Vrs, tmp_path: Path) -> None:
    (tmp_path / "cell.csv").write_text("0.5, 1004, ON\n")
    (tmp_path / "cell.toml").write_text(SENSOR)
    (tmp_path / "w.v2").write_text(".PROGRAM w\nDELAY 1\n.END\n")
    ended = vrs("run", "w.v2", "--cell", "cell.toml", "--signals", "cell.csv")
    assert (ended.status, ended.out) == (1, "")
    assert "*Illegal digital signal* 1004 of cell.csv (a sensor of the cell sets it)" in ended.err


def test_a_wrong_file_of_signals_is_refused(vrs: Vrs, tmp_path: Path) -> None:
    (tmp_path / "w.v2").write_text(WAITING)
    (tmp_path / "cell.csv").write_text("1.5, 1, ON\n")
    ended = vrs("run", "w.v2", "--signals", "cell.csv")
    assert ended.status == 1
    assert "cell.csv:1:" in ended.err


def test_a_task_beside_that_fails_is_told(vrs: Vrs, tmp_path: Path) -> None:
    (tmp_path / "w.v2").write_text(WAITING)
    (tmp_path / "cell.csv").write_text("1, 1002, ON\n2, 1001, ON\n")
    ended = vrs("run", "w.v2", "--signals", "cell.csv")
    assert ended.status == 1
    assert "Program beside stopped at step 2 (task 1 at 1.000 s)" in ended.err
    assert "part at 2" in ended.out


def test_a_bound_on_steps_says_where_the_program_was(vrs: Vrs, tmp_path: Path) -> None:
    (tmp_path / "w.v2").write_text(".PROGRAM main\n  WHILE TRUE DO\n  END\n.END\n")
    ended = vrs("run", "w.v2", "--max-steps", 500)
    assert ended.status == 1
    assert "after 500 steps: main step 1" in ended.err
    assert "(give it more with --max-steps)" in ended.err


# --- limits ------------------------------------------------------------------------------------------------

EVER = ".PROGRAM ever\n  MOVE #PPOINT(0, -90, 90, 0, 10, 0)\n10 GOTO 10\n.END\n"
FILLS = ".PROGRAM fills\n  MOVE #PPOINT(0, -90, 90, 0, 10, 0)\n  FOR i = 1 TO 1E9\n    a[i] = i\n  END\n.END\n"
SOON = f"""\
.PROGRAM soon
  MOVE #PPOINT(0, -90, 90, 0, 10, 0)
  $s = "{"s" * 64}"
  FOR i = 1 TO 1E9
    $a[i] = $s+$s
  END
.END
"""


@pytest.mark.parametrize(
    ("text", "options", "told"),
    [
        (EVER, ("--max-steps", "20K"), "after 20000 steps: ever step 2 is busy at 10 GOTO 10"),
        (EVER, ("--max-wall", "0.5"), "the run took longer than 0.5 s: ever step "),
        (FILLS, ("--max-elements", "5K"), "arrays and strings hold "),
        (SOON, ("--max-elements", "1G", "--max-memory", "450M"), "more memory than --max-memory 450000000"),
    ],
)
def test_a_limit_ends_a_run_and_all_is_written_as_far_as_it_came(
    tmp_path: Path, text: str, options: tuple[str, ...], told: str
) -> None:
    (tmp_path / "p.v2").write_text(text)
    words = [sys.executable, "-m", "vrs_cli", "run", "p.v2", "--json", "--csv", "p.csv", "--save", "p.vrst", *options]
    ended = subprocess.run(words, capture_output=True, text=True, cwd=tmp_path, check=False)
    assert ended.returncode == 1, ended.stderr
    (error,) = json.loads(ended.stdout)["errors"]
    assert error["message"].startswith("*Program limit reached*")
    assert told in error["message"]
    assert error["program"] == text.split()[1]
    if "--max-wall" not in options:  # how far a run comes by then depends on the machine
        assert error["step"] > 1
        assert len((tmp_path / "p.csv").read_text().splitlines()) > 2
        assert read_trajectory(tmp_path / "p.vrst").deltas


def test_a_limit_that_is_reached_while_a_file_is_loaded_is_told_in_json_too(
    vrs: Vrs, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "p.v2").write_text(EVER)
    monkeypatch.setattr("vrs_cli.language.text.parser.parse_file", lambda *_, **__: [_ for _ in cycle((0,)) if _])
    ended = vrs("run", "p.v2", "--json", "--max-wall", "0.05")
    assert ended.status == 1
    (error,) = json.loads(ended.out)["errors"]
    assert error["message"].startswith("*Program limit reached* the run took longer than 0.05 s")
    assert error["program"] is None
    assert "the run took longer than 0.05 s" in ended.err


def test_motions_that_begin_at_other_times_than_they_were_asked_for_are_told(vrs: Vrs, tmp_path: Path) -> None:
    steps = ("MOVE #PPOINT(0,-90,90,0,10,0) AT 4", "MOVE #PPOINT(0,-90,90,0,20,0) AT 6")
    (tmp_path / "p.v2").write_text("\n".join((".PROGRAM p", *steps, "MOVE #PPOINT(90,-45,90,0,20,0) AT 3.5", ".END")))
    told = "2 later motions begin 0.296 to 0.898 s later: AT 4, AT 6\n"
    assert vrs("run", "p.v2").err == told
    assert vrs("run", "p.v2", "--quiet").err == ""
    (tmp_path / "q.v2").write_text("\n".join((".PROGRAM q", *steps, ".END")))
    assert vrs("run", "q.v2").err == ""


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (("--max-steps", "0"), "--max-steps: 0 is not above 0"),
        (("--max-disk", "1.5"), "--max-disk: 1.5 is no whole number, as 500, 64K, 1.5M and 2G are"),
        (("--max-disk", "1e308G"), "--max-disk: 1e308G is no whole number, as 500, 64K, 1.5M and 2G are"),
        (("--max-output", "1T"), "--max-output: '1T' is not a number"),
        (("--max-memory", "1M"), "--max-memory 1000000 is too little (at least 256M)"),
    ],
)
def test_a_limit_that_is_none_is_refused(vrs: Vrs, tmp_path: Path, words: tuple[str, ...], told: str) -> None:
    (tmp_path / "p.v2").write_text(EVER)
    ended = vrs("run", "p.v2", *words)
    assert ended.status == 2
    assert told in ended.err


def test_a_limit_of_a_system_that_has_none_is_refused(
    vrs: Vrs, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "p.v2").write_text(EVER)
    monkeypatch.setitem(sys.modules, "resource", None)
    monkeypatch.delattr("signal.setitimer")
    assert "this system has no such limit" in vrs("run", "p.v2", "--max-memory", "1G").err
    assert "this system has no alarm" in vrs("run", "p.v2", "--max-wall", "1").err


def test_the_memory_of_programs_is_linear_in_their_number() -> None:
    def taken(count: int) -> int:
        programs = "".join(f".PROGRAM p{i}\n  x{i} = {i}\n.END\n" for i in range(count))
        calls = "".join(f"  CALL p{i}\n" for i in range(count))
        session = Session(RecordingTerminal())
        tracemalloc.start()
        session.load_text(f".PROGRAM main\n{calls}.END\n{programs}")
        assert session.execute("main").fault is None
        most = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        return most

    assert any(taken(400) < 5.0 * taken(100) for _ in range(3))  # other threads take memory too


# --- a program of somebody else ------------------------------------------------------------------------------


def test_the_files_of_a_sandbox_are_in_its_folder(vrs: Vrs, tmp_path: Path) -> None:
    steps = ("ATTACH (5)", 'FOPENW (5) "mine.txt"', 'WRITE (5) "inside"', "FCLOSE (5)", "TYPE IOSTAT(5)")
    (tmp_path / "p.v2").write_text("\n".join((".PROGRAM p()", *steps, ".END", "")))
    before = {path.name for path in tmp_path.iterdir()}
    ended = vrs("run", "p.v2", "--sandbox", "box", "--save", "p.vrst")
    assert (ended.status, ended.out.split()[0]) == (0, "1")
    assert (tmp_path / "box" / "mine.txt").read_text() == "inside\n"
    assert {path.name for path in tmp_path.iterdir()} == {*before, "box", "p.vrst"}


@pytest.mark.parametrize("name", ["../p.v2", "/etc/hostname", "link.txt", "up/p.v2", "nul"])
@pytest.mark.parametrize("word", ["FOPENR", "FOPENW", "FOPENA", "FDELETE"])
def test_no_program_leaves_its_sandbox(vrs: Vrs, tmp_path: Path, word: str, name: str) -> None:
    text = f'.PROGRAM p()\n  ATTACH (5)\n  {word} (5) "{name}"\n.END\n'
    (tmp_path / "p.v2").write_text(text)
    (tmp_path / "box").mkdir()
    (tmp_path / "box" / "link.txt").symlink_to(tmp_path / "p.v2")
    (tmp_path / "box" / "up").symlink_to(tmp_path)
    before = {path.name for path in tmp_path.iterdir()}
    ended = vrs("run", "p.v2", "--sandbox", "box", "--json")
    (error,) = json.loads(ended.out)["errors"]
    assert (ended.status, error["code"], error["step"]) == (1, -517, 2)
    assert (tmp_path / "p.v2").read_text() == text
    assert {path.name for path in tmp_path.iterdir()} == before


def test_a_sandbox_has_limits_and_they_can_be_raised(vrs: Vrs, tmp_path: Path) -> None:
    (tmp_path / "p.v2").write_text(".PROGRAM p()\n  DELAY 4000\n.END\n")
    assert "(give it more with --max-time)" in vrs("run", "p.v2", "--sandbox", "box").err
    assert vrs("run", "p.v2", "--sandbox", "box", "--max-time", "4001").status == 0


def test_what_is_no_folder_is_no_sandbox(vrs: Vrs, tmp_path: Path) -> None:
    (tmp_path / "p.v2").write_text(".PROGRAM p()\n.END\n")
    for name, why in (("p.v2", "File exists"), ("", "No such file or directory")):
        ended = vrs("run", "p.v2", "--sandbox", name)
        assert (ended.status, ended.out) == (2, "")
        assert f"--sandbox {name}: {why} (name a folder)" in ended.err


def test_nobody_is_called_from_a_sandbox() -> None:
    with Isolation():
        for act in (lambda: socket.create_connection(("127.0.0.1", 9)), lambda: subprocess.run(["true"], check=True)):
            with pytest.raises(PermissionError, match="not for this run"):
                act()
    socket.socket().close()


def test_contacts_are_looked_for_in_a_sandbox(tmp_path: Path) -> None:
    """MuJoCo may start a process while it is imported: it is loaded before the program may start none."""
    for name in ("pick_and_place.v2", "pick_and_place.toml"):
        shutil.copy(Path(__file__).parents[2] / "programs" / name, tmp_path)
    words = ("pick_and_place.v2", "--cell", "pick_and_place.toml", "--sandbox", "box", "--quiet")
    command = [sys.executable, "-m", "vrs_cli", "run", *words]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")


BESIDE = """\
.PROGRAM main
    EXECUTE 5 other()
    TYPE "main is over"
.END
.PROGRAM other
    TYPE "other begins"
    WAIT.EVENT 0, 3
    {more}
    TYPE "other is over"
.END
"""


def test_a_run_waits_for_all_tasks(vrs: Vrs, tmp_path: Path) -> None:
    (tmp_path / "p.v2").write_text(BESIDE.format(more="ATTACH (0)\n    DRIVE 1, 10, 100"))
    ended = vrs("run", "p.v2", "--json")
    found = json.loads(ended.out)
    assert ended.status == 0
    assert found["typed"] == ["main is over", "other begins", "other is over"]
    assert found["duration_s"] > 3.0
    assert found["final"]["joints_deg"][0] == pytest.approx(10.0)


@pytest.mark.parametrize(
    ("more", "limit", "reason"),
    [
        (
            "10 GOTO 10",
            ("--max-steps", "5000"),
            "after 5000 steps: task 5, other step 3 is busy at 10 GOTO",
        ),
        (
            "10 WAIT.EVENT 0, 1\n GOTO 10",
            ("--max-time", "60"),
            "after 60 s of the robot's time: task 5, other",
        ),
        ('10 TYPE "x"\n GOTO 10', ("--max-output", "500"), "the program wanted to type more than 500 bytes"),
    ],
)
def test_a_limit_ends_an_endless_task_with_the_reason(
    vrs: Vrs, tmp_path: Path, more: str, limit: tuple[str, str], reason: str
) -> None:
    (tmp_path / "p.v2").write_text(BESIDE.format(more=more))
    ended = vrs("run", "p.v2", *limit)
    assert ended.status == 1
    assert reason in ended.err
    assert "Program other stopped at step" in ended.err


def test_a_limit_ends_all_tasks(vrs: Vrs, tmp_path: Path) -> None:
    starts = "\n".join(f"    EXECUTE {number} ever()" for number in range(1, 27))
    (tmp_path / "p.v2").write_text(f".PROGRAM main\n{starts}\n.END\n.PROGRAM ever\n10 GOTO 10\n.END\n")
    ended = vrs("run", "p.v2", "--max-steps", "20000")
    assert ended.status == 1
    assert ended.err.count("*Program limit reached*") == 1
    assert "task 26, ever step 1 is busy at 10 GOTO 10" in ended.err


def test_the_files_of_a_program_are_beside_its_file(vrs: Vrs, tmp_path: Path) -> None:
    (tmp_path / "cell").mkdir()
    (tmp_path / "cell" / "p.v2").write_text('.PROGRAM p()\n ATTACH (5)\n FOPENW (5) "log.txt"\n WRITE (5) "x"\n.END\n')
    assert vrs("run", "cell/p.v2").status == 0
    assert (tmp_path / "cell" / "log.txt").read_text() == "x\n"


def test_the_option_names_the_cell_or_the_program_or_the_file_beside_it(vrs: Vrs, tmp_path: Path) -> None:
    for name, number in (("fetch", 1), ("named", 2), ("given", 3)):
        (tmp_path / f"{name}.toml").write_text(f"[[follow]]\nwhen = 1\nset = 1001\nafter = {number}\n")
    program = ".PROGRAM fetch\n    SIGNAL 1\n    WAIT SIG(1001)\n    TYPE TIME\n.END\n"
    (tmp_path / "fetch.v2").write_text(program)
    beside = vrs("run", "fetch.v2")
    assert (beside.out.split()[0], "the cell is fetch.toml (beside fetch.v2)" in beside.err) == ("1", True)
    (tmp_path / "fetch.v2").write_text(f"; cell: named.toml\n{program}")
    named = vrs("run", "fetch.v2")
    assert (named.out.split()[0], "the cell is named.toml (fetch.v2:1)" in named.err) == ("2", True)
    given = vrs("run", "fetch.v2", "--cell", "given.toml")
    assert (given.out.split()[0], "the cell is given.toml (--cell)" in given.err) == ("3", True)
    (tmp_path / "fetch.v2").write_text(f"; cell: ../secret.toml\n{program}")
    assert "FILE_OUTSIDE" in vrs("run", "fetch.v2", "--sandbox", "box").err.upper().replace(" ", "_")


def test_a_program_without_a_terminal_takes_its_cell_too(
    vrs: Vrs, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "fetch.v2").write_text("; cell: named.toml\n.PROGRAM fetch\n    x = found\n    TYPE x\n.END\n")
    (tmp_path / "named.toml").write_text("[[follow]]\nwhen = 1\nvariables = ['found']\nrows = [[7.0]]\n")
    monkeypatch.setattr("sys.stdin", StringIO("EXECUTE\nEXECUTE fetch\n"))
    assert "the cell is named.toml (fetch.v2:1)" in vrs("fetch.v2").err
    assert vrs("check", "fetch.v2", "--strict").status == 0
