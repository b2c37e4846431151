"""PLOT: which curves are meant."""

from math import degrees, radians

import pytest

from vrs_cli.engine.engine import Engine
from vrs_cli.errors import IllegalJoint, UsageError
from vrs_cli.interfaces.monitor.plotting import SAMPLES, in_file, plotted, selected
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.values.commands import Move
from vrs_cli.values.motion import JointOffsetTarget, NamedTarget
from vrs_cli.values.replies import Plot


@pytest.fixture(scope="module")
def engine() -> Engine:
    engine = Engine(load_robot("puma560"))
    engine.perform(Move(JointOffsetTarget(1, radians(60.0)), straight=False))
    engine.perform(Move(NamedTarget("ready"), straight=False))
    return engine


def plot(engine: Engine, *words: str) -> Plot:
    return plotted(engine.arm, engine.timeline, selected(engine.arm, words))


@pytest.mark.parametrize(
    ("words", "unit", "labels"),
    [
        ((), "deg", ["JT1", "JT2", "JT3", "JT4", "JT5", "JT6"]),
        (("1", "3"), "deg", ["JT1", "JT3"]),
        (("3", "3", "1"), "deg", ["JT3", "JT1"]),
        (("VELOCITY",), "deg/s", ["JT1", "JT2", "JT3", "JT4", "JT5", "JT6"]),
        (("vel", "2"), "deg/s", ["JT2"]),
        (("ACC", "1"), "deg/s2", ["JT1"]),
        (("TOOL",), "mm", ["X", "Y", "Z"]),
        (("X", "Z"), "mm", ["X", "Z"]),
        (("X", "TOOL"), "mm", ["X", "Y", "Z"]),
        (("SPEED",), "mm/s", ["SPEED"]),
        (("HAND",), "1 open", ["HAND"]),
    ],
)
def test_curves(engine: Engine, words: tuple[str, ...], unit: str, labels: list[str]) -> None:
    drawn = plot(engine, *words)
    assert (drawn.unit, [curve.label for curve in drawn.curves]) == (unit, labels)
    assert all(len(curve.values) == len(drawn.times) == SAMPLES for curve in drawn.curves)


@pytest.mark.parametrize(
    "words",
    [("X", "SPEED"), ("VELOCITY", "X"), ("POSITION", "VELOCITY"), ("X", "1"), ("Q",), ("P%",), ("²",), ("9" * 5000,)],
)
def test_what_cannot_be_drawn_says_what_can(engine: Engine, words: tuple[str, ...]) -> None:
    with pytest.raises(UsageError, match="PLOT POSITION, VELOCITY"):
        plot(engine, *words)


@pytest.mark.parametrize("joint", ["0", "7", "99"])
def test_joints_that_are_not_there(engine: Engine, joint: str) -> None:
    with pytest.raises(IllegalJoint, match="joints 1 to 6"):
        plot(engine, joint)


def test_curves_are_where_the_robot_is(engine: Engine) -> None:
    drawn = plot(engine, "1")
    (curve,) = drawn.curves
    for k in range(0, SAMPLES, 48):
        assert curve.values[k] == pytest.approx(degrees(engine.position(drawn.times[k]).joints[0]), abs=1e-9)
    assert max(curve.values) == pytest.approx(60.0, abs=0.01)


def test_the_tool_speed_is_that_of_the_circle_it_draws(engine: Engine) -> None:
    speed = plot(engine, "SPEED").curves[0].values
    rate = plot(engine, "VELOCITY", "1").curves[0].values
    x, y = engine.position(0.0).T_world_tool.px, engine.position(0.0).T_world_tool.py
    radius = (x * x + y * y) ** 0.5 * 1000.0
    middle = SAMPLES // 4
    assert speed[middle] == pytest.approx(radius * radians(rate[middle]), rel=1e-3)


def test_a_file_is_named_last() -> None:
    assert in_file(("1", "2", "arm.SVG")) == (("1", "2"), "arm.SVG")
    assert in_file(("arm.pdf",)) == ((), "arm.pdf")
    assert in_file(("X", "arm")) == (("X", "arm"), "")
