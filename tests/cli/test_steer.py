from __future__ import annotations

import io
import json
import signal
from math import cos, pi
from pathlib import Path

import pytest

from tests.cli.conftest import Vrs
from tests.net.serving import serving
from vrs_cli.files.trajectory_file import read_trajectory


def wave(path: Path, seconds: float = 4.0, degrees: float = 20.0) -> Path:
    rows = [
        f"{k * 0.02:.2f},{degrees * (1 - cos(pi * k * 0.01)) / 2:.6f},-90,90,0,0,0" for k in range(round(seconds * 50))
    ]
    path.write_text("\n".join(rows))
    return path


def test_it_follows_a_file_and_tells_how_well(vrs: Vrs, tmp_path: Path) -> None:
    wave(tmp_path / "wave.csv")
    ended = vrs("lab", "steer", "wave.csv", "--csv", "followed.csv", "--rate", 50)
    assert (ended.status, ended.err) == (0, "")
    assert ended.out.startswith("200 targets in ")
    assert "followed to 0.0" in ended.out
    rows = (tmp_path / "followed.csv").read_text().splitlines()
    t, joint_1 = map(float, rows[101].split(",")[:2])
    assert t == 2.0
    assert joint_1 == pytest.approx(20.0, abs=0.2)


def test_json(vrs: Vrs, tmp_path: Path) -> None:
    wave(tmp_path / "wave.csv")
    told = json.loads(vrs("lab", "steer", "wave.csv", "--json").out)
    assert (told["targets"], told["held"], told["out_of_reach"]) == (200, 0, 0)
    assert told["error_deg"]["rms"] < told["error_deg"]["max"] < 0.2
    last = float((tmp_path / "wave.csv").read_text().splitlines()[-1].split(",")[1])
    assert told["final"]["joints_deg"][0] == pytest.approx(last, abs=1e-5)


def test_what_it_saves_can_be_read(vrs: Vrs, tmp_path: Path) -> None:
    wave(tmp_path / "wave.csv")
    vrs("lab", "steer", "wave.csv", "--save", "wave.vrst")
    recording = read_trajectory(tmp_path / "wave.vrst")
    assert len(recording.deltas) == 201
    assert vrs("where", "wave.vrst", "--at", "2").out.splitlines()[0].startswith("At 2.000 s, STEER")


def test_a_table_on_standard_output_stands_alone(vrs: Vrs, tmp_path: Path) -> None:
    wave(tmp_path / "wave.csv", 1.0)
    ended = vrs("lab", "steer", "wave.csv", "--csv", "-")
    assert ended.out.startswith("t,jt1,")
    assert all(line.count(",") == 12 for line in ended.out.splitlines())
    assert "followed to" in ended.err


def test_standard_input_is_followed_in_real_time(vrs: Vrs, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    text = wave(tmp_path / "wave.csv", 1.0).read_text()
    text = "".join(f"170000000{line}\n" for line in text.splitlines())  # the time of the day, as loggers write it
    monkeypatch.setattr("sys.stdin", io.StringIO(text))
    ended = vrs("lab", "steer", "-", "--realtime", 1000)
    assert ended.status == 0
    assert ended.out.startswith("50 targets")


def test_targets_beyond_a_range_stop_at_its_end(vrs: Vrs, tmp_path: Path) -> None:
    (tmp_path / "far.csv").write_text("0,0,-90,90,0,0,0\n1,300,-90,90,0,0,0\n20,300,-90,90,0,0,0\n")
    ended = vrs("lab", "steer", "far.csv")
    assert ended.status == 0
    assert "2 targets went beyond the range of a joint, which stopped at its end" in ended.out


def test_a_joint_goes_as_far_as_its_range_lets_a_long_tick_take_it(vrs: Vrs, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.stdin", io.StringIO("0, 0,0,0,0,90,0\n0.4, 0,0,0,-107,90,0\n"))
    ended = vrs("lab", "steer", "-", "--robot", "irb120", "--json")
    assert ended.status == 0
    assert json.loads(ended.out)["final"]["joints_deg"] == pytest.approx([0, 0, 0, -107, 90, 0])


def test_one_target_is_one(vrs: Vrs, tmp_path: Path) -> None:
    (tmp_path / "far.csv").write_text("1,300,-90,90,0,0,0\n")
    said = vrs("lab", "steer", "far.csv").out.splitlines()
    assert said[0].startswith("1 target in ")
    assert said[1] == "1 target went beyond the range of a joint, which stopped at its end"


def test_poses_out_of_reach_are_named_and_passed_over(vrs: Vrs, tmp_path: Path) -> None:
    far = "".join(f"{k},3000,0,0,90,90,0\n" for k in range(1, 9))
    (tmp_path / "far.csv").write_text(f"t,x,y,z,o,a,t_angle\n0,0,450,-150,90,90,0\n{far}9,0,460,-150,90,90,0\n")
    ended = vrs("lab", "steer", "far.csv", "--json")
    assert ended.status == 1
    assert ended.err.startswith("vrs lab steer: far.csv:3: *Location too far*")
    assert ended.err.splitlines()[-1] == "vrs lab steer: and others"
    told = json.loads(ended.out)
    assert (told["targets"], told["out_of_reach"]) == (2, 8)
    assert told["final"]["xyz_mm"] == pytest.approx([0.0, 460.0, -150.0], abs=1e-3)


@pytest.mark.parametrize(
    ("arguments", "status", "message"),
    [
        (("none.csv",), 2, "none.csv cannot be read: No such file or directory"),
        (("empty.csv",), 2, "empty.csv holds no target"),
        (("names.csv",), 1, "names.csv:1: the columns are t, a, b"),
        (("bad.csv", "--speed", "120"), 2, "--speed: 120 % is more than full speed"),
        (("bad.csv", "--realtime", "0"), 2, "--realtime: 0 is not above 0"),
        (("bad.csv", "--realtime", "1e9"), 2, "--realtime: a rate of 1e9"),
        (("bad.csv", "--json", "--csv", "-"), 2, "both want standard output"),
        (("bad.csv", "--save", "bad.csv"), 2, "named twice"),
    ],
)
def test_what_is_wrong_is_said_in_one_line(
    vrs: Vrs, tmp_path: Path, arguments: tuple[str, ...], status: int, message: str
) -> None:
    (tmp_path / "empty.csv").write_text("; nothing\n")
    (tmp_path / "bad.csv").write_text("1,2\n")
    (tmp_path / "names.csv").write_text("t,a,b\n1,2,3\n")
    ended = vrs("lab", "steer", *arguments)
    assert ended.status == status
    assert message in ended.err
    assert len(ended.err.splitlines()) == 1


def test_without_any_target_there_is_nothing_to_follow(vrs: Vrs, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.stdin", io.StringIO("1,2\n"))
    ended = vrs("lab", "steer", "-")
    assert ended.status == 1
    assert "standard input:1: 2 fields where 7 are wanted" in ended.err
    assert "standard input holds no target" in ended.err
    monkeypatch.setattr("sys.stdin", io.StringIO(""))
    assert vrs("lab", "steer", "-").err.startswith("vrs lab steer: standard input holds no target")


# --- a stream that is not as it should be ---------------------------------------------------------------------------

GOOD = "{t},{angle},-90,90,0,0,0\n"
BROKEN = (
    "connected to the robot\n",
    "1.5,garbage,-90,90,0,0,0\n",
    "1.5,nan,-90,90,0,0,0\n",
    "1.5,1e999,-90,90,0,0,0\n",
    "nan,1,-90,90,0,0,0\n",
    "0.5,1,-90,90,0,0,0\n",
    "1.5,1,-90\n",
    "\x00\ufffd\n",
)


@pytest.mark.parametrize("realtime", [(), ("--realtime", 1000)])
@pytest.mark.parametrize("wrong", BROKEN, ids=repr)
def test_a_line_that_is_no_target_is_named_and_left_out(
    vrs: Vrs, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, wrong: str, realtime: tuple[object, ...]
) -> None:
    text = GOOD.format(t=1, angle=1) + wrong + GOOD.format(t=2, angle=5)
    monkeypatch.setattr("sys.stdin", io.StringIO(text))
    ended = vrs("lab", "steer", "-", *realtime, "--csv", "followed.csv", "--save", "followed.vrst", "--json")
    assert ended.status == 1
    assert len(ended.err.splitlines()) == 1
    assert "standard input:2: " in ended.err
    told = json.loads(ended.out)
    assert (told["targets"], told["skipped"]) == (2, 1)
    assert told["final"]["joints_deg"][0] == pytest.approx(5.0)
    assert (tmp_path / "followed.csv").read_text().splitlines()[-1].split(",")[1].startswith("5")
    assert read_trajectory(tmp_path / "followed.vrst").timeline.end == pytest.approx(told["duration_s"])


def test_a_last_line_without_its_end_is_cut_off(vrs: Vrs, monkeypatch: pytest.MonkeyPatch) -> None:
    text = GOOD.format(t=0, angle=0) + GOOD.format(t=1, angle=5) + "2,10,-90,90,0,0,1"  # of 12.5
    monkeypatch.setattr("sys.stdin", io.StringIO(text))
    ended = vrs("lab", "steer", "-", "--json")
    assert "standard input:3: the line is cut off" in ended.err
    assert json.loads(ended.out)["final"]["joints_deg"] == pytest.approx([5, -90, 90, 0, 0, 0])


def test_a_byte_order_mark_is_none_of_the_first_line(vrs: Vrs, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    text = "\ufefft,jt1,jt2,jt3,jt4,jt5,jt6\n" + GOOD.format(t=0, angle=0) + GOOD.format(t=1, angle=5)
    (tmp_path / "marked.csv").write_text(text, encoding="utf-8")
    monkeypatch.setattr("sys.stdin", io.TextIOWrapper(io.BytesIO(text.encode())))
    from_pipe = vrs("lab", "steer", "-")
    assert (from_pipe.status, from_pipe.err) == (0, "")
    assert from_pipe == vrs("lab", "steer", "marked.csv")


def test_stamps_of_the_day_name_the_option_that_takes_them(vrs: Vrs, tmp_path: Path) -> None:
    (tmp_path / "day.csv").write_text(GOOD.format(t=1700000000, angle=0))
    assert "with --relative times count from the first" in vrs("lab", "steer", "day.csv").err
    assert vrs("lab", "steer", "day.csv", "--relative").status == 0


class Interrupted(io.StringIO):
    """Standard input that a signal comes into."""

    def __init__(self, text: str, number: int) -> None:
        super().__init__(text)
        self.number = number

    def readline(self, size: int | None = -1, /) -> str:
        line = super().readline(-1 if size is None else size)
        if not line:
            signal.raise_signal(self.number)
        return line


@pytest.mark.parametrize(
    ("number", "status", "said"),
    [(signal.SIGINT, 0, ""), (signal.SIGTERM, 143, "vrs lab steer: terminated\n")],
)
def test_a_signal_ends_a_stream_and_everything_is_written(
    vrs: Vrs, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, number: int, status: int, said: str
) -> None:
    text = GOOD.format(t=0, angle=0) + GOOD.format(t=0.02, angle=5)
    monkeypatch.setattr("sys.stdin", Interrupted(text, number))
    ended = vrs("lab", "steer", "-", "--csv", "followed.csv", "--save", "followed.vrst")
    assert (ended.status, ended.err) == (status, said)
    assert ended.out.startswith("2 targets in ")
    assert (tmp_path / "followed.csv").read_text().splitlines()[-1].split(",")[1].startswith("5")
    assert read_trajectory(tmp_path / "followed.vrst").deltas[-1].motion.text == "STEER ends"


def test_joints_that_slide_are_in_mm(vrs: Vrs, tmp_path: Path) -> None:
    rows = [f"{k * 0.02:.2f},-45,90,{50 + 10 * (1 - cos(pi * k * 0.02)):.6f},45" for k in range(100)]
    (tmp_path / "quill.csv").write_text("\n".join(rows))
    told = json.loads(vrs("lab", "steer", "quill.csv", "--robot", "cobra600", "--json").out)
    assert (told["held"], told["error_deg"]) == (0, {"rms": 0.0, "max": 0.0})
    assert 0.0 < told["error_mm"]["rms"] < told["error_mm"]["max"] < 0.5
    assert told["final"]["joints_deg"] == pytest.approx([-45, 90, float(rows[-1].split(",")[3]), 45], abs=1e-5)
    said = vrs("lab", "steer", "quill.csv", "--robot", "cobra600").out
    assert "followed to 0.00 deg rms, 0.00 at most; 0." in said
    assert said.rstrip().endswith("at most")
    assert " mm rms, 0." in said


def test_a_served_robot_follows(vrs: Vrs, tmp_path: Path) -> None:
    wave(tmp_path / "wave.csv", 2.0)
    (folder := tmp_path / "served").mkdir()
    with serving(folder) as served:
        ended = vrs("lab", "steer", served.address, "wave.csv", "--json")
        told = json.loads(ended.out)
        assert (ended.status, told["targets"], told["late"], told["lost"]) == (0, 100, 0, 0)
        assert told["error_deg"]["max"] < 0.3
        ended = vrs("lab", "steer", "wave.csv", served.address)
        assert ended.out.startswith("100 targets, each 0.")


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("ws://127.0.0.1:1", "wave.csv"), "does not answer"),
        (("ws://127.0.0.1:1", "wave.csv", "--save", "a.vrst"), "--save is for a robot of this process"),
        (("wave.csv", "ws://127.0.0.1:1", "--robot", "puma260"), "--robot is for a robot of this process"),
        (("wave.csv", "--lead", 1), "--lead is for a robot that is served"),
        (("wave.csv", "other.csv"), "one argument too many: other.csv"),
        (("ws://127.0.0.1:1", "ws://127.0.0.1:2"), "one argument too many: ws://127.0.0.1:2"),
    ],
)
def test_what_is_wrong_with_an_address_is_told(vrs: Vrs, tmp_path: Path, words: tuple[object, ...], said: str) -> None:
    wave(tmp_path / "wave.csv", 0.1)
    ended = vrs("lab", "steer", *words)
    assert ended.status != 0
    assert said in ended.err
    assert len(ended.err.splitlines()) == 1
