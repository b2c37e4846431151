"""where, replay and export: the subcommands that read a trajectory file."""

from __future__ import annotations

import csv
import json
import re
import subprocess
import sys
from base64 import b64encode
from math import degrees, radians
from pathlib import Path
from types import SimpleNamespace
from typing import BinaryIO

import numpy as np
import pytest
from msgspec.structs import replace

from tests.cli.conftest import Vrs
from tests.files.trajectories import initial, planned, puma, without_checksums
from vrs_cli.engine.position import position_at
from vrs_cli.files.atomic import hold
from vrs_cli.files.trajectory_file import read_trajectory, write_trajectory
from vrs_cli.kinematics.forms import arm_for
from vrs_cli.render.pictures import PICTURES
from vrs_cli.trajectory.measured import MeasuredRecord
from vrs_cli.values.measured import Report
from vrs_cli.world.course import World

pytestmark = pytest.mark.usefixtures("saved")


def test_where_says_what_g_says(vrs: Vrs, saved: Path) -> None:
    times = [0.0, 0.7, 1.9, 1e6]
    ended = vrs("where", "t.vrst", "--at", *times, "--json")
    assert (ended.status, ended.err) == (0, "")
    timeline = read_trajectory(saved).timeline
    for t, told in zip(times, json.loads(ended.out), strict=True):
        position = position_at(arm_for(puma()), timeline, t)
        T = position.T_world_tool
        assert told["time"] == t
        assert told["joints_deg"] == pytest.approx([degrees(q) for q in position.joints], abs=1e-11)
        assert told["xyz_mm"] == pytest.approx([1000 * T.px, 1000 * T.py, 1000 * T.pz], abs=1e-11)
        assert set(told) == {"time", "joints_deg", "xyz_mm", "oat_deg", "hand", "moving"}


def test_where_in_words(vrs: Vrs) -> None:
    ended = vrs("where", "t.vrst", "--at", 0, "--at", 1)
    assert ended.status == 0
    words = ended.out.split()
    for heading in ("X", "Y", "Z", "O", "A", "T", "Hand", "JT1", "JT6"):
        assert words.count(heading) == 2
    assert words.count("839.387") == 1


def test_a_table_agrees_with_where_to_the_last_digit(vrs: Vrs) -> None:
    assert vrs("export", "t.vrst", "--to", "csv", "-o", "t.csv", "--rate", 7) == (0, "", "")
    with open("t.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    ended = vrs("where", "t.vrst", "--json", "--at", *(row["t"] for row in rows))
    for row, told in zip(rows, json.loads(ended.out), strict=True):
        numbers = [*told["joints_deg"], *told["xyz_mm"], *told["oat_deg"]]
        assert [float(cell) for cell in list(row.values())[1:]] == pytest.approx(numbers, abs=1e-9, rel=0.0)


def test_the_format_may_come_from_the_name(vrs: Vrs) -> None:
    assert vrs("export", "t.vrst", "-o", "a.csv").status == 0
    assert vrs("export", "t.vrst", "--to", "csv", "-o", "b").status == 0
    assert Path("a.csv").read_bytes() == Path("b").read_bytes()


def test_a_log_needs_mcap(vrs: Vrs, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("vrs_cli.files.samples.find_spec", lambda _: None)
    ended = vrs("export", "t.vrst", "-o", "a.mcap")
    assert (ended.status, ended.err.count("\n")) == (2, 1)
    assert "-m pip install mcap)" in ended.err
    assert not Path("a.mcap").exists()


@pytest.mark.parametrize("form", ["json", "npz", "mcap", "ros"])
def test_every_format_is_the_same_in_a_file_and_on_standard_output(vrs: Vrs, form: str) -> None:
    if form == "mcap":
        pytest.importorskip("mcap")
    assert vrs("export", "t.vrst", "--to", form, "-o", "a", "--rate", 20).status == 0
    command = [sys.executable, "-m", "vrs_cli", "export", "t.vrst", "--to", form, "--rate", "20"]
    assert subprocess.run(command, check=True, stdout=subprocess.PIPE).stdout == Path("a").read_bytes()


def test_json_says_what_where_says(vrs: Vrs) -> None:
    assert vrs("export", "t.vrst", "-o", "a.json", "--rate", 3).status == 0
    rows = json.loads(Path("a.json").read_text())
    told = json.loads(vrs("where", "t.vrst", "--json", "--at", *(row["time"] for row in rows)).out)
    for row, one in zip(rows, told, strict=True):
        for key in ("joints_deg", "xyz_mm", "oat_deg"):
            assert row[key] == pytest.approx(one[key], abs=1e-9, rel=0.0)
        assert (row["time"], row["hand"]) == (one["time"], one["hand"])


def test_export_to_standard_output(vrs: Vrs) -> None:
    assert vrs("export", "t.vrst", "--to", "csv", "-o", "t.csv").status == 0
    assert vrs("export", "t.vrst", "--to", "csv").out == Path("t.csv").read_text()
    assert vrs("replay", "t.vrst", "--csv", "-", "--rate", 100).out == Path("t.csv").read_text()


def test_replay_without_a_terminal_is_a_table(vrs: Vrs) -> None:
    ended = vrs("replay", "t.vrst", "--step", 0.5)
    assert ended.status == 0
    heading, *rows = ended.out.splitlines()
    assert heading.split()[:4] == ["t", "X", "Y", "Z"]
    times = [float(row.split()[0]) for row in rows]
    assert times[:3] == [0.0, 0.5, 1.0]


def test_replay_makes_a_picture(vrs: Vrs) -> None:
    pytest.importorskip("matplotlib")
    for name in ("a.svg", "b.svg", "c.png"):
        assert vrs("replay", "t.vrst", "--plot", name) == (0, "", "")
    assert Path("a.svg").read_bytes() == Path("b.svg").read_bytes()
    assert "joint velocities" in Path("a.svg").read_text()
    assert Path("c.png").read_bytes().startswith(b"\x89PNG")


def test_a_picture_needs_matplotlib(vrs: Vrs, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("vrs_cli.render.plots.find_spec", lambda _: None)
    ended = vrs("replay", "t.vrst", "--plot", "a.svg")
    assert ended.status == 2
    assert "-m pip install matplotlib)" in ended.err


def test_a_torn_last_line_is_told_and_the_rest_is_read(vrs: Vrs, saved: Path) -> None:
    data = saved.read_bytes()
    saved.write_bytes(data[:-20])
    ended = vrs("where", "t.vrst", "--at", 0, "--json")
    assert ended.status == 0
    assert ended.err == "vrs where: warning: the last line of t.vrst is incomplete and left out\n"
    assert len(json.loads(ended.out)) == 1


@pytest.mark.parametrize("command", [["where", "--at", "0"], ["replay"], ["export", "--to", "csv"]])
@pytest.mark.parametrize(
    ("name", "status", "told"),
    [
        ("none.vrst", 2, "*Nonexistent file* none.vrst"),
        ("folder", 2, "*File error* folder is a folder"),
        ("junk", 1, "*File is not what it should be* junk, line 1"),
        ("empty", 1, "*File is not what it should be* empty"),
        ("t.vrst/below", 2, "*File error* t.vrst/below cannot be read"),
    ],
)
def test_a_file_that_is_no_trajectory(
    vrs: Vrs, tmp_path: Path, command: list[str], name: str, status: int, told: str
) -> None:
    (tmp_path / "folder").mkdir()
    (tmp_path / "junk").write_bytes(b"\x00\x01\n\x02")
    (tmp_path / "empty").write_bytes(b"")
    ended = vrs(command[0], name, *command[1:])
    assert ended.status == status
    assert ended.err.startswith(f"vrs {command[0]}: {told}")
    assert ended.err.count("\n") == 1


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["export", "--to", "bag"], "unknown format bag (known: csv, json, npz, mcap, ros, html, png, gif, mp4)"),
        (["export"], "which format? (give --to csv or json or npz or mcap or ros or html or png or gif or mp4)"),
        (["export", "-o", "t.vrst", "--to", "csv"], "t.vrst is named twice"),
        (
            ["export", "--to", "csv", "--cell", "c.toml"],
            "csv has nothing of a cell (--cell is for mcap, html, png, gif, mp4)",
        ),
        (["export", "-o", "none/a.csv"], "*File error* none/a.csv cannot be written: no such file"),
        (["replay", "--csv", "a", "--plot", "a"], "a is named twice"),
        (["replay", "--plot", "a.gif"], "*No plot* a.gif is no picture file (its name ends in .svg, .png or .pdf)"),
        (["replay", "--rate", "10"], "--rate is the rate of a table (give --csv OUT, too)"),
        (
            ["replay", "--report", "a.html", "--report-at", "99"],
            "--report-at 99 is not in the trajectory (give a moment from 0.000 to ",
        ),
        (["replay", "--csv", "/dev/full"], "*File error* /dev/full cannot be written: no space left"),
        (["replay", "--csv", "."], "*File error* . cannot be written: is a directory"),
    ],
)
def test_outputs_that_cannot_be(vrs: Vrs, saved: Path, arguments: list[str], told: str) -> None:
    before = saved.read_bytes()
    ended = vrs(arguments[0], "t.vrst", *arguments[1:])
    assert ended.status == 2
    assert told in ended.err
    assert ended.err.count("\n") == 1
    assert saved.read_bytes() == before
    assert [path.name for path in saved.parent.iterdir()] == ["t.vrst"]


def test_an_endless_file_is_refused(vrs: Vrs) -> None:
    ended = vrs("where", "/dev/zero", "--at", 1)
    assert (ended.status, ended.out) == (2, "")
    assert ended.err == "vrs where: *File error* /dev/zero cannot be read: it is a device (name a regular file)\n"


def test_a_table_of_too_many_rows_is_refused(vrs: Vrs, saved: Path) -> None:
    ended = vrs("replay", saved, "--step", "1e-9")
    assert (ended.status, ended.out) == (2, "")
    assert "at most 100000" in ended.err
    assert ended.err.count("\n") == 1


# --- damaged files -----------------------------------------------------------------------------------------


def test_verify_says_that_a_trajectory_is_sound(vrs: Vrs) -> None:
    ended = vrs("verify", "t.vrst")
    assert (ended.status, ended.err) == (0, "")
    assert ended.out.endswith(": sound\n")
    assert json.loads(vrs("verify", "t.vrst", "--json").out) == {
        "sound": True,
        "checksums": True,
        "reports": 0,
        "faults": [],
    }


def test_verify_follows_lines_with_the_velocities_of_the_joints(vrs: Vrs, saved: Path) -> None:
    """A robot whose joint 6 is slower than what it did: where lines begin and end that is hardly to be seen."""
    text = without_checksums(saved).read_text("utf-8")
    joint = text.index('"kind":"straight"')
    assert joint > 0
    slow = re.sub(r'("max_velocity":)[0-9.]+', r"\g<1>0.2", text)
    saved.write_text(slow, "utf-8")
    ended = vrs("verify", "t.vrst", "--json")
    assert ended.status == 1
    assert any("faster than it can" in fault for fault in json.loads(ended.out)["faults"])


def test_a_damaged_file_is_refused_and_read_leniently(vrs: Vrs, saved: Path) -> None:
    lines = saved.read_bytes().splitlines(keepends=True)
    saved.write_bytes(b"".join([*lines[:3], lines[3].replace(b'"text":"MOVE', b'"text":"MOVX'), *lines[4:]]))
    for subcommand in (["where", "t.vrst", "--at", 1], ["replay", "t.vrst"], ["export", "t.vrst", "--to", "csv"]):
        ended = vrs(*subcommand)
        assert (ended.status, ended.out) == (1, "")
        assert "t.vrst, line 4: its checksum does not fit" in ended.err
        ended = vrs(*subcommand, "--lenient")
        assert ended.status == 0
        assert ended.err.count("\n") == 1
        assert ended.out
    ended = vrs("verify", "t.vrst")
    assert (ended.status, ended.err) == (1, "")
    assert ended.out.splitlines()[0].startswith("t.vrst, line 4: its checksum")


@pytest.mark.parametrize(
    "words",
    [
        ("run", "p.v2", "--save", "busy.vrst"),
        ("run", "p.v2", "--csv", "busy.vrst"),
        ("lab", "steer", "t.csv", "--save", "busy.vrst"),
        ("export", "t.vrst", "-o", "busy.vrst", "--to", "csv"),
        ("replay", "t.vrst", "--csv", "busy.vrst"),
        ("fmt", "--write", "busy.vrst"),
    ],
)
def test_no_subcommand_touches_a_file_that_is_being_written(
    vrs: Vrs, saved: Path, tmp_path: Path, words: tuple[str, ...]
) -> None:
    (tmp_path / "p.v2").write_text(".PROGRAM p\n.END\n")
    (tmp_path / "t.csv").write_text("0,0,-90,90,0,0,0\n1,1,-90,90,0,0,0\n")
    busy = tmp_path / "busy.vrst"
    busy.write_text(".PROGRAM p\n.END")
    with hold(busy):
        ended = vrs(*words)
    assert (ended.status, "busy.vrst is being written by this vrs" in ended.err) == (2, True), ended
    assert busy.read_text() == ".PROGRAM p\n.END"
    assert saved.exists()


def test_readers_need_no_lock(vrs: Vrs, saved: Path) -> None:
    with hold(saved):
        for words in (("where", "t.vrst", "--at", 1), ("verify", "t.vrst"), ("export", "t.vrst", "-o", "o.csv")):
            assert vrs(*words).status == 0


PROGRAMS = Path(__file__).parents[2] / "programs"
PICTURE = b"\x89PNG of the arm"


def test_html_has_no_rate(vrs: Vrs) -> None:
    ended = vrs("export", "t.vrst", "-o", "a.html", "--rate", 30)
    assert (ended.status, "html shows every moment and has no rate" in ended.err) == (2, True)


def test_a_report_has_figures_curves_commands_and_the_arm(vrs: Vrs, monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[float] = []
    worlds: list[World | None] = []

    def drawn(stream: BinaryIO, _arm: object, _timeline: object, t: float, world: World | None) -> None:
        worlds.append(world)
        asked.append(t)
        stream.write(PICTURE)

    monkeypatch.setattr("vrs_cli.render.pictures.check_still", lambda: None)
    monkeypatch.setattr("vrs_cli.render.pictures.write_still", drawn)
    assert vrs("replay", "t.vrst", "--report", "a.html", "--report-at", 0.5) == (0, "", "")
    assert vrs("replay", "t.vrst", "--report", "b.html").status == 0
    assert asked == [0.5, read_trajectory(Path("t.vrst")).timeline.end]
    assert vrs("run", PROGRAMS / "pick_and_place.v2", "--report", "c.html", "--quiet").status == 0
    assert worlds[:2] == [None, None]
    assert worlds[2] is not None
    assert set(worlds[2].settings.parts) == {"box"}
    page = Path("a.html").read_text()
    assert f"data:image/png;base64,{b64encode(PICTURE).decode()}" in page
    assert "<svg" in page
    assert "joint velocities" in page
    assert "<td>MOVE" in page
    assert not re.search(r"(src|href)=.https?:", page), "it fetches nothing"


def test_a_report_says_what_it_lacks(vrs: Vrs, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("vrs_cli.render.pictures.shutil", SimpleNamespace(which=lambda _: None))
    monkeypatch.setattr("vrs_cli.render.pictures.USUAL_PATHS", ())
    monkeypatch.setattr("vrs_cli.render.plots.find_spec", lambda _: None)  # curves need no matplotlib
    assert vrs("replay", "t.vrst", "--report", "a.html") == (0, "", "")
    page = Path("a.html").read_text()
    assert "No picture of the arm: " in page
    assert "<svg" in page
    assert "<td>MOVE" in page


@pytest.mark.parametrize("moment", ["99", "-1"])
def test_a_picture_of_no_moment_of_the_trajectory_is_refused(
    vrs: Vrs, monkeypatch: pytest.MonkeyPatch, moment: str
) -> None:
    png = replace(PICTURES["png"], check=lambda: None)
    monkeypatch.setattr("vrs_cli.render.pictures.PICTURES", {"png": png})
    ended = vrs("export", "t.vrst", "-o", "a.png", "--at", moment)
    assert ended.status == 2
    assert f"--at {moment} is not in the trajectory (give a moment from 0.000 to " in ended.err
    assert ended.err.count("\n") == 1
    assert not Path("a.png").exists()


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("--report", "a.pdf"), "a.pdf is no page (its name ends in .html)"),
        (("--report", "none/a.html"), "there is no folder none"),
        (("--report-at", "1"), "--report-at is a moment of a report (give --report OUT.html, too)"),
        (("--report", "a.html", "--plot", "a.html"), "a.html is named twice"),
    ],
)
def test_a_report_that_cannot_be_is_refused_at_once(vrs: Vrs, arguments: tuple[str, ...], said: str) -> None:
    ended = vrs("replay", "t.vrst", *arguments)
    assert ended.status == 2
    assert said in ended.err


@pytest.fixture
def measured(tmp_path: Path) -> Path:
    """A trajectory file, m.vrst, whose joints were measured 0.1 deg farther than planned, but not in a gap."""
    timeline, deltas = planned(6)
    record = MeasuredRecord(6)
    for t in (0.25, 0.5, 0.75, 1.5, 1.75):
        joints = tuple([q + radians(0.1) for q in position_at(arm_for(puma()), timeline, t).joints])
        record.add([Report(t, joints)])
    path = tmp_path / "m.vrst"
    write_trajectory(path, puma(), [initial()], deltas, measured=record.view)
    return path


@pytest.mark.usefixtures("measured")
def test_where_tells_the_measured_robot_or_why_it_is_unknown(vrs: Vrs) -> None:
    ended = vrs("where", "m.vrst", "--measured", "--at", 0.5, 1.0, 1.8, 0.1)
    assert (ended.status, ended.err) == (0, "")
    assert "joint 1 by 0.100 deg" in ended.out
    assert ended.out.count("The measured robot is unknown at ") == 3
    told = json.loads(vrs("where", "m.vrst", "--measured", "--json", "--at", 0.5, 1.0).out)
    (planned_there,) = json.loads(vrs("where", "m.vrst", "--json", "--at", 0.5).out)
    assert told[0]["joints_deg"] == pytest.approx([q + 0.1 for q in planned_there["joints_deg"]], abs=1e-9)
    assert told[1] == {"time": 1.0, "mode": None}


@pytest.mark.usefixtures("measured")
def test_tables_have_measured_joints_beside_planned_ones(vrs: Vrs) -> None:
    rows = list(csv.DictReader(vrs("export", "m.vrst", "--measured", "--to", "csv", "--rate", 4).out.splitlines()))
    told = json.loads(vrs("export", "m.vrst", "--measured", "--to", "json", "--rate", 4).out)
    known = {0.25, 0.5, 0.75, 1.5, 1.75}
    assert known < {float(row["t"]) for row in rows}
    for row, one in zip(rows, told, strict=True):
        cells = [row[f"jt{joint}_measured"] for joint in range(1, 7)]
        if float(row["t"]) in known:
            assert list(map(float, cells)) == pytest.approx([float(row[f"jt{j}"]) + 0.1 for j in range(1, 7)], abs=1e-8)
            assert one["measured_deg"] == list(map(float, cells))
        else:
            assert (cells, one["measured_deg"]) == ([""] * 6, None)


@pytest.mark.usefixtures("measured")
def test_arrays_have_the_reports_as_they_came_and_a_replay_the_measured_way(vrs: Vrs) -> None:
    assert vrs("export", "m.vrst", "--measured", "-o", "m.npz").status == 0
    arrays = np.load("m.npz")
    assert arrays["measured_times"].tolist() == [0.25, 0.5, 0.75, 1.5, 1.75]
    assert arrays["measured_joints"].shape == arrays["measured_velocities"].shape == (5, 6)
    shown = vrs("replay", "m.vrst", "--measured", "--step", 0.25).out.splitlines()
    assert [line.split()[0] for line in shown[1:]] == ["0.250", "0.500", "0.750", "1.000", "1.250", "1.500", "1.750"]
    wanted = json.loads(vrs("where", "m.vrst", "--measured", "--json", "--at", 0.5).out)[0]["joints_deg"]
    assert list(map(float, shown[2].split()[-6:])) == pytest.approx(wanted, abs=1e-3)


@pytest.mark.parametrize(
    "line", [("where", "--at", 1), ("export", "--to", "csv"), ("export", "--to", "ros"), ("replay", "--step", 1)]
)
def test_a_file_without_reports_says_so(vrs: Vrs, line: tuple[str, ...]) -> None:
    ended = vrs(line[0], "t.vrst", "--measured", *line[1:])
    assert (ended.status, ended.out) == (2, "")
    assert "t.vrst has no measured reports (leave --measured out)" in ended.err
