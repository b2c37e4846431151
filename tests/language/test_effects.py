"""Every instruction: what it asks for, or does by itself."""

from __future__ import annotations

from math import pi, radians

import pytest

from tests.language.running import TICK, StillRobot, run_lines
from vrs_cli.engine.commands import (
    AlignedTarget,
    Break,
    Delay,
    JointOffsetTarget,
    JointTarget,
    Mode,
    Move,
    NamedTarget,
    OperateHand,
    PoseTarget,
    SetAcceleration,
    SetBase,
    SetConfiguration,
    SetDuration,
    SetMode,
    SetMonitorSpeed,
    SetParameter,
    SetSpeed,
    SetSwitch,
    SetTool,
    SpeedUnit,
    Stamp,
    ToolOffsetTarget,
)
from vrs_cli.errors import (
    ArithmeticOverflow,
    IllegalArrayIndex,
    IllegalJoint,
    IllegalSignal,
    IllegalValue,
    TypeMismatch,
    UndefinedValue,
    VrsError,
)
from vrs_cli.kinematics.configuration import Arm, Elbow, Wrist
from vrs_cli.kinematics.transform import (
    IDENTITY,
    Transform,
    compose,
    from_oat,
    rotation_z,
    translation,
)
from vrs_cli.language.effects import HANDLERS, Prompt, Type, Wait
from vrs_cli.language.instructions import DECLARATIONS, INSTRUCTIONS
from vrs_cli.language.runtime import Event, Failed
from vrs_cli.language.words import State

PART = "SET part = TRANS(500, 150, -100, 90, 90, 0)"
DOWN = from_oat(0.5, 0.15, -0.1, pi / 2, pi / 2, 0.0)


def close(a: Transform, b: Transform) -> bool:
    return tuple(a) == pytest.approx(tuple(b), abs=1e-12)


def only(*lines: str) -> Event:
    """The one thing that the last line asks for."""
    (request,) = run_lines(*lines).requests
    return request


def move(*lines: str) -> Move:
    request = only(*lines)
    assert isinstance(request, Move)
    return request


# --- motions ---


@pytest.mark.parametrize(
    ("line", "straight", "hand"),
    [
        ("MOVE part", False, None),
        ("MOVES part", True, None),
        ("MOVET part, 1", False, 1.0),
        ("MOVET part, TRUE", False, 1.0),
        ("MOVEST part, 0", True, 0.0),
        ("MOVET part, -5", False, 0.0),
    ],
)
def test_moves_to_a_transformation(line: str, straight: bool, hand: float | None) -> None:
    request = move(PART, line)
    assert isinstance(request.target, PoseTarget)
    assert close(request.target.T_world_tool, DOWN)
    assert (request.straight, request.hand, request.speed, request.stamp) == (straight, hand, None, None)
    assert request.text == line


def test_moves_to_a_precision_point() -> None:
    assert move("MOVE #PPOINT(0, -90, 90)").target == JointTarget((0.0, radians(-90), radians(90), 0.0, 0.0, 0.0))


def test_compounds_multiply_from_left_to_right() -> None:
    request = move("SET a = TRANS(100)", "SET b = RZ(90)", "SET c = TRANS(10)", "MOVE a:b:c")
    assert isinstance(request.target, PoseTarget)
    expected = compose(compose(translation(0.1, 0, 0), rotation_z(pi / 2)), translation(0.01, 0, 0))
    assert close(request.target.T_world_tool, expected)


@pytest.mark.parametrize(("line", "z"), [("APPRO part, 50", -0.05), ("APPRO part, -20", -0.12)])
def test_approach_is_back_along_the_tool(line: str, z: float) -> None:
    request = move(PART, line)
    assert isinstance(request.target, PoseTarget)
    assert not request.straight
    assert close(request.target.T_world_tool, from_oat(0.5, 0.15, z, pi / 2, pi / 2, 0.0))


def test_straight_approach_and_departure() -> None:
    assert move(PART, "APPROS part, 50").straight
    assert move("DEPARTS 30").straight
    assert move("DEPART 30") == Move(ToolOffsetTarget(translation(0, 0, -0.03)), False, text="DEPART 30")


def test_drive_turns_one_joint() -> None:
    assert move("DRIVE 2, -30") == Move(JointOffsetTarget(2, radians(-30)), False, text="DRIVE 2, -30")
    assert move("DRIVE 6, 10, 25").speed == 0.25


def test_named_poses() -> None:
    assert move("READY").target == NamedTarget("ready")
    assert move("NEST").target == NamedTarget("nest")


@pytest.mark.parametrize(
    ("line", "stamp"),
    [
        ("MOVE part AT 3", Stamp(3.0)),
        ("MOVES part AT 1+1", Stamp(2.0)),
        ("APPRO part, 50 IN 0.5", Stamp(0.5, relative=True)),
        ("DEPART 50 AT 0", Stamp(0.0)),
        ("DRIVE 1, 10 IN 2", Stamp(2.0, relative=True)),
        ("READY AT 9", Stamp(9.0)),
    ],
)
def test_time_stamps(line: str, stamp: Stamp) -> None:
    assert move(PART, line).stamp == stamp


def test_align_is_worked_out_where_the_last_motion_ends() -> None:
    assert move("ALIGN") == Move(AlignedTarget(), True, text="ALIGN")


def test_delay_and_break() -> None:
    assert only("DELAY 0.5") == Delay(0.5, "DELAY 0.5")
    assert only("BREAK") == Break()


# --- settings ---


@pytest.mark.parametrize(
    ("line", "request_"),
    [
        ("SPEED 50", SetSpeed(50.0)),
        ("SPEED 50, 25 ALWAYS", SetSpeed(50.0, 25.0, always=True)),
        ("SPEED 200 MMPS", SetSpeed(200.0, unit=SpeedUnit.MMPS)),
        ("SPEED 10 IPS ALWAYS", SetSpeed(10.0, unit=SpeedUnit.IPS, always=True)),
        ("SPEED 30 MONITOR", SetMonitorSpeed(30.0)),
        ("DURATION 2", SetDuration(2.0)),
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


# --- locations ---


def test_here_takes_the_place_or_the_joints() -> None:
    run = run_lines("HERE a", "HERE #a", "HERE row[2]")
    assert run.value("a") == translation(0.5, 0.1, -0.2)
    assert run.value("#a") == StillRobot().angles
    assert run.environment.reference("row", 2).value() == translation(0.5, 0.1, -0.2)


@pytest.mark.parametrize("line", ["HERE a:b:part", "SET a:b:part = HERE", "POINT a:b:part = HERE"])
def test_a_compound_defines_its_last_name(line: str) -> None:
    run = run_lines("SET a = TRANS(100)", "SET b = RZ(90)", line, "SET again = a:b:part")
    again = run.value("again")
    assert isinstance(again, Transform)
    assert close(again, StillRobot().pose)


def test_the_names_before_the_last_must_be_defined() -> None:
    assert str(run_lines("HERE base1:part").error) == "*Undefined value* base1"


def test_decompose_fills_six_elements() -> None:
    run = run_lines(PART, "DECOMPOSE x[2] = part", "SET #p = #PPOINT(10, 20, 30)", "DECOMPOSE j[0] = #p")
    assert [run.environment.reference("x", i).value() for i in range(2, 8)] == [500, 150, -100, 90, 90, 0]
    assert [run.environment.reference("j", i).value() for i in range(6)] == [10, 20, 30, 0, 0, 0]


# --- signals and timers ---


def test_signals_and_bits() -> None:
    run = run_lines("SIGNAL 1, 3, -3, 2001", "BITS 5, 4 = 9")
    assert [run.environment.signals.read(n) for n in (1, 3, 2001, 5, 6, 7, 8)] == [
        True,
        False,
        True,
        True,
        False,
        False,
        True,
    ]
    assert not run_lines("SIGNAL 1", "RESET").environment.signals.read(1)
    assert run_lines("BITS 5 = 1").environment.signals.read(5)


def test_a_wait_is_asked_again_until_it_is_true() -> None:
    robot = StillRobot()
    run = run_lines("TIMER 1 = 0", "WAIT TIMER(1) > 0.1", "x = TIMER(1)", robot=robot)
    assert [type(event) for event in run.requests] == [Wait]
    assert run.value("x") == pytest.approx(4 * TICK)


def test_a_bare_wait_is_one_tick() -> None:
    robot = StillRobot()
    run = run_lines("WAIT", robot=robot)
    assert [event.ticks for event in run.requests if isinstance(event, Wait)] == [1]
    assert robot.now == TICK


@pytest.mark.parametrize(
    ("line", "error"), [("WAIT 1/(y-y) > 2", ArithmeticOverflow), ("WAIT SIG(flag)", UndefinedValue)]
)
def test_a_condition_that_cannot_be_evaluated_is_an_error_of_its_step(line: str, error: type[VrsError]) -> None:
    run = run_lines("y = 1", line)
    assert type(run.error) is error
    assert run.task.fault is not None
    assert run.task.fault.source == line


# --- the terminal ---


def test_type() -> None:
    assert only("x = 2", 'TYPE "x =", x, /F6.1, x, /S') == Type("x = 2   2.0", newline=False)
    assert only("TYPE") == Type("")


@pytest.mark.parametrize(
    ("line", "answers", "values"),
    [
        ('PROMPT "n? ", x', ["5"], {"x": 5.0}),
        ('PROMPT "n? ", x', [" -2.5 "], {"x": -2.5}),
        ('PROMPT "n? ", x', [""], {"x": 0.0}),
        ("PROMPT x, y, z", ["1, 2 3"], {"x": 1.0, "y": 2.0, "z": 3.0}),
        ("PROMPT x, y", ["1"], {"x": 1.0, "y": 0.0}),
        ("PROMPT x, y", [",2"], {"x": 0.0, "y": 2.0}),
        ('PROMPT "name? ", $s', ["a b, c"], {"$s": "a b, c"}),
        ("PROMPT $s", [""], {"$s": ""}),
        ("PROMPT $s, x", ["part 7"], {"$s": "part", "x": 7.0}),
        ("PROMPT x", ["five", "5"], {"x": 5.0}),
        ("PROMPT x", ["1 2", "^HFF"], {"x": 255.0}),
    ],
)
def test_prompt(line: str, answers: list[str], values: dict[str, object]) -> None:
    run = run_lines(line, answers=answers)
    assert {name: run.value(name) for name in values} == values
    assert sum(isinstance(event, Prompt) for event in run.events) == len(answers)


def test_prompt_says_what_was_wrong() -> None:
    run = run_lines('PROMPT "n? ", x', answers=["five", "1 2", "3"])
    assert "five" in run.typed
    assert run.requests[0] == Prompt("n? ", 1)


def test_prompt_without_variables_waits_for_a_line() -> None:
    assert run_lines('PROMPT "Press ENTER"', answers=[""]).requests == [Prompt("Press ENTER", 0)]


# --- mistakes ---


@pytest.mark.parametrize(
    ("line", "error"),
    [
        ("MOVE nowhere", UndefinedValue),
        ("MOVE #nowhere", UndefinedValue),
        ("APPRO part, x", UndefinedValue),
        ("DRIVE 7, 10", IllegalJoint),
        ("DRIVE 0, 10", IllegalJoint),
        ("DRIVE 1, 10, 0", IllegalValue),
        ("DRIVE 1, 10, 101", IllegalValue),
        ("MOVE part AT -1", IllegalValue),
        ("MOVE part IN -1", IllegalValue),
        ("MOVE part AT 1/0", ArithmeticOverflow),
        ("SPEED 0", IllegalValue),
        ("SPEED 50, -1", IllegalValue),
        ("DURATION -1", IllegalValue),
        ("DELAY -1", IllegalValue),
        ("COARSE 0", IllegalValue),
        ("ACCEL 0", IllegalValue),
        ("SIGNAL 600", IllegalSignal),
        ("SIGNAL 1001", IllegalSignal),
        ("BITS 1, 4 = 1E9", IllegalValue),
        ("TIMER 99 = 0", IllegalValue),
        ("DECOMPOSE x = part", TypeMismatch),
        ("DECOMPOSE x[-1] = part", IllegalArrayIndex),
    ],
)
def test_mistakes(line: str, error: type[VrsError]) -> None:
    run = run_lines(PART, line)
    assert type(run.error) is error
    assert isinstance(run.last, Failed)
    assert (run.last.fault.step, run.last.fault.source) == (2, line)


# --- the table ---

BY_THE_COMPILER = {"EXIT", "NEXT", "CALL", "CALLS", "GOSUB", "WAIT", "IFSIG", *DECLARATIONS}
BY_THE_PARSER = {"REMARK"}  # a comment


def test_every_supported_instruction_is_carried_out() -> None:
    supported = {name for name, word in INSTRUCTIONS.items() if word.state is State.SUPPORTED}
    assert supported <= HANDLERS.keys() | BY_THE_COMPILER | BY_THE_PARSER
    assert HANDLERS.keys() <= supported
