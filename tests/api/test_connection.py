"""Test the magic in a shell of IPython, the sample notebook in a kernel as a class runs it, and robots with the names
and units of LeRobot.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from html import unescape
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import vrs_cli as vrs
from vrs_cli.errors import TooLate, UsageError

ROOT = Path(__file__).parents[2]
LESSON = ROOT / "examples" / "first_lesson.ipynb"


@pytest.fixture
def shell() -> Iterator[Any]:
    interactive = pytest.importorskip("IPython.core.interactiveshell").InteractiveShell
    it = interactive.instance()
    it.reset(new_session=False)
    it.run_line_magic("load_ext", "vrs_cli")
    vrs.load_ipython_extension(it)
    yield it
    interactive.clear_instance()


def test_a_cell_is_typed_at_the_prompt(shell: Any) -> None:
    answered = shell.run_cell_magic("vrs", "", "MOVE #PPOINT(0, -45, 180, 0, 45, 0)\nWHERE\nTYPE 1+1")
    assert "JT1" in repr(answered)
    assert repr(answered).endswith(" 2")
    assert len(shell.user_ns["robot"].commands) == 1


def test_it_is_about_the_robot_that_is_named(shell: Any) -> None:
    shell.user_ns["r"] = vrs.Robot("cobra600")
    assert "JT4" in repr(shell.run_cell_magic("vrs", "r", "WHERE"))
    with pytest.raises(TypeError, match=r"^q is no Robot: q = vrs.Robot"):
        shell.run_cell_magic("vrs", "q", "WHERE")


def test_a_line(shell: Any) -> None:
    assert repr(shell.run_line_magic("vrs", "TYPE 3")) == " 3"
    assert shell.run_line_magic("vrs", "SPEED 50") is None


def test_mistakes_stand_below_the_cell_and_the_rest_is_done(shell: Any) -> None:
    answered = shell.run_cell_magic("vrs", "", "MOVEE part\nTYPE 7")
    assert not answered.ok
    assert "did you mean MOVE" in answered.text
    assert answered.text.endswith(" 7\n")
    assert "color:#eb0000" in answered._repr_html_()


def test_programs_are_typed_in(shell: Any) -> None:
    answered = shell.run_cell_magic("vrs", "", ".PROGRAM a\nTYPE 5\n.END\nEXECUTE a")
    assert answered.text.splitlines()[-2:] == [" 5", "Program completed"]
    assert "is not stored" in repr(shell.run_cell_magic("vrs", "", ".PROGRAM b\nTYPE 5"))
    assert "b" not in repr(shell.run_line_magic("vrs", "DIRECTORY")).split()


def test_a_prompt_asks_in_place(shell: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    asked = []
    monkeypatch.setattr("builtins.input", lambda question: asked.append(question) or "4")
    shell.run_cell_magic("vrs", "", '.PROGRAM ask\nPROMPT "How many? ", n\n.END\nEXECUTE ask')
    assert (asked, shell.user_ns["robot"]["n"]) == (["How many? "], 4.0)


def test_values_show_themselves(shell: Any) -> None:
    robot = vrs.Robot().move(0, -45, 180, 0, 45, 0)
    for value in (robot, robot.timeline, robot.where(0.5), robot.sample(), robot.ik(robot.fk()), robot.why(robot.fk())):
        shown, _ = shell.display_formatter.format(value)
        assert "<table>" in shown["text/html"]
    shown, _ = shell.display_formatter.format(robot.plot(1))
    assert shown["image/svg+xml"].startswith("<svg ")
    assert robot.sample()._repr_html_().count("<tr>") == 1 + 5 + 1 + 5


def test_a_line_that_says_nothing_shows_nothing(shell: Any) -> None:
    robot = vrs.Robot()
    assert shell.display_formatter.format(robot.do("SPEED 50")) == ({}, {})
    shown, _ = shell.display_formatter.format(robot.do("WHERE"))
    assert "JT1" in shown["text/plain"]
    assert "<table>" in shown["text/html"]


@pytest.mark.long
def test_the_lesson_runs_as_it_stands() -> None:
    nbformat, nbclient = pytest.importorskip("nbformat"), pytest.importorskip("nbclient")
    pytest.importorskip("ipykernel")
    lesson = nbformat.read(LESSON, as_version=4)
    assert not any(cell.get("outputs") for cell in lesson.cells)
    nbclient.NotebookClient(lesson, timeout=60, resources={"metadata": {"path": str(ROOT)}}).execute()
    *said, scene = [cell.get("outputs") for cell in lesson.cells]
    assert scene[0]["data"]["text/html"].startswith("<iframe srcdoc=")
    text = unescape(re.sub("<[^>]*>", "", str(said)))
    for wanted in (
        "Unimation PUMA 560",
        "JT6",
        "LEFTY ABOVE NOFLIP",
        "waved",
        "Program completed",
        "did you mean MOVE",
    ):
        assert wanted in text


def test_models_locations_and_drags_show_themselves() -> None:
    r = vrs.Robot("puma560")
    shown = r.model._repr_html_()
    assert shown.count("<tr>") == 1 + 6
    for word in ("jt6", "max velocity", "ready", "-225.000", "Unimation" if "Unimation" in r.model.title else "PUMA"):
        assert word in shown
    many = r.fk([[0, -90, 90, 0, 0, 0], [0, -45, 180, 0, 45, 0]])
    assert many._repr_html_().count("<tr>") == 1 + 2
    assert "2 locations [mm, deg]" in many._repr_html_()
    assert many[0]._repr_html_() == f"<pre>{many[0]!r}</pre>"
    assert "[m, rad]" in r.in_units("SI").fk([[0.0] * 6])._repr_html_()
    assert repr(r.drag(r.where().location)) == "<Dragged: nothing holds the tool>"


NAMES = ["shoulder_pan.pos", "shoulder_lift.pos", "elbow_flex.pos", "wrist_flex.pos", "wrist_roll.pos", "gripper.pos"]


def so100() -> tuple[vrs.Robot, vrs.LeRobotArm]:
    robot = vrs.Robot("so100")
    return robot, vrs.LeRobotArm(robot)


def test_an_observation_has_the_names_and_units_of_lerobot() -> None:
    robot, arm = so100()
    low, high = (np.degrees(bound) for bound in (robot.held.arm.model.lower, robot.held.arm.model.upper))
    seen = arm.observation()
    assert list(seen) == NAMES
    assert list(seen.values())[:5] == pytest.approx((robot.where().joints - 0.5 * (low + high)) / (high - low) * 200.0)
    in_degrees = vrs.LeRobotArm(robot, degrees=True, reversed_motors=["elbow_flex"]).observation()
    assert in_degrees["shoulder_lift.pos"] == pytest.approx(robot.where().joints[1] - 0.5 * (low[1] + high[1]))
    assert in_degrees["elbow_flex.pos"] == pytest.approx(0.5 * (low[2] + high[2]) - robot.where().joints[2])


@pytest.mark.parametrize("degrees", [False, True])
@pytest.mark.parametrize("named", [False, True])
def test_a_chunk_is_followed_and_seen_again(degrees: bool, named: bool) -> None:
    robot = vrs.Robot("so100")
    arm = vrs.LeRobotArm(robot, degrees=degrees)
    rows = np.array(list(arm.observation().values())) + np.linspace(0.0, 12.0, 40)[:, None] * [1, 1, -1, -1, 1, 0]
    rows[15:, 5] = 80.0
    actions = [dict(zip(NAMES, row, strict=True)) for row in rows.tolist()] if named else rows
    report = arm.follow(actions, 0.5)
    assert report.begin == pytest.approx(0.5)
    assert list(arm.observation(report.end).values())[:5] == pytest.approx(rows[-1, :5])
    opens = 0.5 + 15 / 30
    assert [arm.observation(t)["gripper.pos"] for t in (opens - 0.01, opens + 0.01)] == [0.0, 100.0]


def test_actions_before_the_arrival_are_left_out() -> None:
    _, arm = so100()
    rows = np.array([list(arm.observation().values())] * 30)
    rows[:, 5] = 100.0
    assert arm.follow(rows, 0.0, arrival=0.25).begin == pytest.approx(8 / 30)
    assert arm.observation(8 / 30)["gripper.pos"] == 0.0
    assert arm.observation(8 / 30 + 0.06)["gripper.pos"] == 100.0
    with pytest.raises(TooLate, match="all 30 actions have passed"):
        arm.follow(rows, 0.0, arrival=2.0)


def test_what_fits_no_motor_is_refused() -> None:
    with pytest.raises(UsageError, match="5 motors for the 6 joints of puma560"):
        vrs.LeRobotArm(vrs.Robot("puma560"))
    robot, arm = so100()
    with pytest.raises(UsageError, match="there is no motor elbow"):
        vrs.LeRobotArm(robot, reversed_motors=["elbow"])
    with pytest.raises(UsageError, match=r"an action without shoulder_lift\.pos"):
        arm.follow([{"shoulder_pan.pos": 1.0}], 0.0)
    with pytest.raises(ValueError, match=r"actions \(N, 5\) or \(N, 6\) are wanted, not \(4,\)"):
        arm.follow([1.0, 2.0, 3.0, 4.0], 0.0)
