"""The laws of WHY: what it says is reachable is, and what it says is not is refused."""

from __future__ import annotations

import pytest

from tests.laws.motion_laws import check_pose
from vrs_cli.engine.engine import Engine
from vrs_cli.errors import MotionError
from vrs_cli.kinematics.joints import joints_outside
from vrs_cli.kinematics.transform import Transform, compose, inverse
from vrs_cli.values.commands import JointTarget, Move, PoseTarget, SetBase, SetConfiguration, SetTool
from vrs_cli.values.reports import Option, Reach, WayOut

BORDER = 1e-6  # measure of a pose that is in two configurations


def check_reach(engine: Engine, target: PoseTarget | JointTarget) -> Reach:
    """WHY agrees with the arm, with what MOVE does, and with what MOVES does, from where the robot is now."""
    reach = engine.explain(target)
    if isinstance(target, PoseTarget):
        T_robot_flange = compose(compose(engine.frames.base, target.T_world_tool), inverse(engine.frames.tool))
        assert tuple(option.configuration for option in reach.options) == engine.arm.ways
        for option in reach.options:
            _check_option(engine, option, T_robot_flange)
    _check_move(engine, target, reach)
    _check_line(engine, target, reach)
    for out in reach.line.ways_out:
        _check_way_out(engine, target, out)
    return reach


def _check_option(engine: Engine, option: Option, T_robot_flange: Transform) -> None:
    """The joints of a configuration are at the place, and out of range where that is said."""
    if option.joints is None:
        assert engine.arm.branch_joints(T_robot_flange, option.configuration, engine.position().joints) is None
        return
    model = engine.model
    tip = compose(engine.arm.forward(option.joints), engine.frames.tool)
    check_pose(engine, tip, compose(T_robot_flange, engine.frames.tool))
    if min(engine.arm.singularity(option.joints)) > BORDER:
        assert option.configuration == engine.arm.configuration(option.joints)
    assert tuple(over.joint for over in option.overruns) == joints_outside(option.joints, model.lower, model.upper)
    for over in option.overruns:
        assert over.limit + over.by == pytest.approx(option.joints[over.joint - 1])


def _check_move(engine: Engine, target: PoseTarget | JointTarget, reach: Reach) -> None:
    """What MOVE would take is what it takes, and what it would be refused with is that."""
    other = standing_here(engine)
    refusal = refused(other, Move(target, straight=False))
    if refusal is not None:
        assert (reach.chosen, reach.reason) == (None, str(refusal))
        return
    assert reach.chosen == engine.arm.configuration(other.position().joints)
    if isinstance(target, PoseTarget) and reach.chosen in [option.configuration for option in reach.options]:
        (option,) = (option for option in reach.options if option.configuration == reach.chosen)
        assert option.usable, "MOVE goes where a configuration is in reach"


def _check_line(engine: Engine, target: PoseTarget | JointTarget, reach: Reach) -> None:
    """The straight line takes as long as MOVES does, or stops for its reason."""
    other = standing_here(engine)
    begin = other.end
    refusal = refused(other, Move(target, straight=True))
    if refusal is not None:
        assert (reach.line.duration, reach.line.trouble) == (None, str(refusal))
        return
    assert reach.line.duration == pytest.approx(other.end - begin)


def _check_way_out(engine: Engine, target: PoseTarget | JointTarget, out: WayOut) -> None:
    """What is named instead of a line is possible."""
    other = standing_here(engine)
    if not (out.words or out.via):
        assert refused(other, Move(target, straight=False)) is None
    else:
        first = Move(PoseTarget(out.via or engine.position().T_world_tool), straight=out.via is not None)
        for word in out.words:
            other.perform(SetConfiguration(next(flag for flag in engine.arm.words if flag.name == word)))
        assert refused(other, first) is None
        assert refused(other, Move(target, straight=True)) is None


def refused(engine: Engine, move: Move) -> MotionError | None:
    """What a motion is refused with."""
    try:
        engine.perform(move)
    except MotionError as refusal:
        return refusal
    return None


def standing_here(engine: Engine) -> Engine:
    """Another robot that stands where this one is now, under the same settings."""
    other = Engine(engine.model, start=engine.position().joints)
    other.perform(SetTool(engine.frames.tool))
    other.perform(SetBase(engine.frames.base))
    other.settings = engine.settings
    return other
