"""What motions go by."""

from __future__ import annotations

from math import pi

import pytest

from tests.language.run.semantics.asked import close, only
from tests.language.running import run_lines
from vrs_cli.kinematics.joints import Arm, Elbow, Wrist
from vrs_cli.kinematics.transform import IDENTITY, compose, rotation_z, translation
from vrs_cli.language.run.effects import Event
from vrs_cli.values.commands import (
    Break,
    Mode,
    OperateHand,
    SetAcceleration,
    SetBase,
    SetConfiguration,
    SetDuration,
    SetMode,
    SetMonitorSpeed,
    SetParameter,
    SetSpeed,
    SetSwitch,
    SetSwivel,
    SetTool,
    SpeedUnit,
    Swivel,
)


@pytest.mark.parametrize(
    ("line", "request_"),
    [
        ("SPEED 50", SetSpeed(50.0)),
        ("SPEED 50, 25 ALWAYS", SetSpeed(50.0, 25.0, always=True)),
        ("SPEED 200 MMPS", SetSpeed(200.0, unit=SpeedUnit.MMPS)),
        ("SPEED 10 IPS ALWAYS", SetSpeed(10.0, unit=SpeedUnit.IPS, always=True)),
        ("SPEED 30 MONITOR", SetMonitorSpeed(30.0)),
        ("DURATION 2", SetDuration(2.0)),
        ("SWIVEL 3, 90", SetSwivel(Swivel(3, pi / 2))),
        ("SWIVEL 3 ALWAYS", SetSwivel(Swivel(3), always=True)),
        ("SWIVEL", SetSwivel(None)),
        ("DURATION 2 ALWAYS", SetDuration(2.0, always=True)),
        ("ACCEL 50", SetAcceleration(50.0)),
        ("ACCEL 50, 30", SetAcceleration(50.0, 30.0)),
        ("COARSE", SetMode(Mode.COARSE, True)),
        ("COARSE 200 ALWAYS", SetMode(Mode.COARSE, True, always=True, tolerance=200.0)),
        ("FINE", SetMode(Mode.COARSE, False)),
        ("NULL ALWAYS", SetMode(Mode.NULLING, True, always=True)),
        ("NONULL", SetMode(Mode.NULLING, False)),
        ("CPON", SetMode(Mode.CONTINUOUS_PATH, True)),
        ("SINGLE", SetMode(Mode.SINGLE, True)),
        ("MULTIPLE", SetMode(Mode.SINGLE, False)),
        ("OVERLAP", SetMode(Mode.OVERLAP, True)),
        ("NOOVERLAP", SetMode(Mode.OVERLAP, False)),
        ("INTON", SetMode(Mode.INTEGRAL, True)),
        ("INTOFF", SetMode(Mode.INTEGRAL, False)),
        ("RIGHTY", SetConfiguration(Arm.RIGHTY)),
        ("LEFTY", SetConfiguration(Arm.LEFTY)),
        ("ABOVE", SetConfiguration(Elbow.ABOVE)),
        ("BELOW", SetConfiguration(Elbow.BELOW)),
        ("FLIP", SetConfiguration(Wrist.FLIP)),
        ("NOFLIP", SetConfiguration(Wrist.NOFLIP)),
        ("OPEN", OperateHand(1.0, False, "OPEN")),
        ("CLOSE", OperateHand(0.0, False, "CLOSE")),
        ("RELAX", OperateHand(None, False, "RELAX")),
        ("ACCEL , 30", SetAcceleration(100.0, 30.0)),
        ("ACCEL (1)", SetParameter("PROFILE", "SCURVE")),
        ("ACCEL (0)", SetParameter("PROFILE", "LSPB")),
        ("ACCEL (8)", SetParameter("PROFILE", "LSPB")),
        ("ENABLE CP", SetSwitch("CP", True)),
        ("DISABLE DRY.RUN", SetSwitch("DRY.RUN", False)),
        ("SWITCH CP = OFF", SetSwitch("CP", False)),
        ("PARAMETER HAND.TIME = 0.1", SetParameter("HAND.TIME", 0.1)),
        ("PARAMETER PROFILE = scurve", SetParameter("PROFILE", "SCURVE")),
    ],
)
def test_settings(line: str, request_: Event) -> None:
    assert only(line) == request_


@pytest.mark.parametrize(
    ("line", "request_"),
    [
        ("OPENI", OperateHand(1.0, True, "OPENI")),
        ("CLOSEI", OperateHand(0.0, True, "CLOSEI")),
        ("RELAXI", OperateHand(None, True, "RELAXI")),
        ("CPOFF ALWAYS", SetMode(Mode.CONTINUOUS_PATH, False, always=True)),
        ("TOOL TRANS(, , 100)", SetTool(translation(0, 0, 0.1))),
        ("TOOL", SetTool(IDENTITY)),
        ("BASE", SetBase(IDENTITY)),
        ("BASE ,,300", SetBase(translation(0, 0, 0.3))),
    ],
)
def test_what_implies_a_break(line: str, request_: Event) -> None:
    assert run_lines(line).requests == [Break(), request_]


def test_base_shifts_then_turns() -> None:
    request = run_lines("BASE 100,,, 90").requests[-1]
    assert isinstance(request, SetBase)
    assert close(request.T_robot_world, compose(translation(0.1, 0, 0), rotation_z(pi / 2)))


def test_several_switches() -> None:
    assert run_lines("ENABLE CP, UPPER").requests == [SetSwitch("CP", True), SetSwitch("UPPER", True)]


def test_a_parameter_can_be_set_from_a_variable() -> None:
    assert only("t = 0.25", "PARAMETER HAND.TIME = t") == SetParameter("HAND.TIME", 0.25)
