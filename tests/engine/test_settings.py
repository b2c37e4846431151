"""Tests of settings, which are a value: a change makes another one, and leaves the old one as it was."""

from __future__ import annotations

import pytest

from vrs_cli.engine.settings import Settings
from vrs_cli.engine.targets import After
from vrs_cli.errors import IllegalValue, UsageError
from vrs_cli.kinematics.joints import NONE, Arm, Configuration, Elbow, Wrist
from vrs_cli.kinematics.transform import IDENTITY
from vrs_cli.values.commands import (
    JointTarget,
    Mode,
    Motion,
    MotionKind,
    NamedTarget,
    PoseTarget,
    SetAcceleration,
    SetConfiguration,
    SetDuration,
    SetMode,
    SetMonitorSpeed,
    SetParameter,
    SetSpeed,
    SetSwitch,
    SetSwivel,
    SettingChange,
    Start,
    Swivel,
)

JOINTS, POSE = JointTarget((0.0,) * 6), PoseTarget(IDENTITY)


@pytest.mark.parametrize(
    "change",
    [
        SetSpeed(50.0),
        SetSpeed(50.0, always=True),
        SetMonitorSpeed(50.0),
        SetDuration(1.0),
        SetConfiguration(Arm.LEFTY),
        SetMode(Mode.SINGLE, on=True),
        SetParameter("STRETCH", 3.0),
        SetSwitch("CP", on=False),
    ],
    ids=repr,
)
def test_a_change_is_another_value(change: SettingChange) -> None:
    before = Settings()
    after = before.after(change)
    assert after != before == Settings()
    assert after.after(change) == after


def test_what_is_for_one_motion_ends_with_it_and_the_rest_stays() -> None:
    always = Settings().after(SetSpeed(40.0, always=True)).after(SetMode(Mode.OVERLAP, on=False, always=True))
    once = always.after(SetSpeed(10.0)).after(SetDuration(2.0)).after(SetMode(Mode.SINGLE, on=True))
    assert (once.speed.present.value, once.duration.present, once.mode(Mode.SINGLE)) == (10.0, 2.0, True)
    assert once.after_motion(POSE) == always
    assert always.after_motion(POSE) is always


@pytest.mark.parametrize("target", [JOINTS, NamedTarget("ready")])
def test_a_motion_to_joints_ends_the_configuration_words(target: JointTarget | NamedTarget) -> None:
    told = Settings()
    for flag in (Arm.LEFTY, Elbow.BELOW, Wrist.FLIP, Arm.RIGHTY):
        told = told.after(SetConfiguration(flag))
    assert told.configuration == Configuration.of(Arm.RIGHTY, Elbow.BELOW, Wrist.FLIP)
    assert told.after_motion(POSE).configuration == told.configuration
    assert told.after_motion(target).configuration == NONE


def test_names_may_be_cut_short_and_words_stand_for_values() -> None:
    told = Settings().after(SetParameter("ins", "off")).after(SetParameter("ROUND", 30.0)).after(SetSwitch("dry", True))
    assert (told.inserts, told.rounding, told.moves) == (False, 0.03, False)
    assert Settings().after(SetParameter("INSERT", -1.0)).inserts
    assert (told.parameter("STR"), told.switch("UP")) == (20.0, True)


@pytest.mark.parametrize(
    ("change", "error"),
    [
        (SetParameter("PROFILE", "SOFT"), IllegalValue),
        (SetParameter("STRETCH", "OFF"), IllegalValue),
        (SetParameter("HAND.TIME", -1.0), IllegalValue),
        (SetParameter("NOSUCH", 1.0), UsageError),
        (SetSwitch("P0WER", on=True), UsageError),
        (SetSpeed(50.0, rotation=0.0), IllegalValue),
    ],
    ids=repr,
)
def test_what_makes_no_sense_is_refused(change: SettingChange, error: type[Exception]) -> None:
    with pytest.raises(error):
        Settings().after(change)


def test_a_motion_has_what_is_set_for_its_kind() -> None:
    """Only a line uses where a joint is to end; a rest has no speed of its own; only a blend is rounded."""
    swivel = Swivel(3, 0.5)
    settings = Settings().after(SetSwivel(swivel)).after(SetAcceleration(40.0)).after(SetParameter("ROUNDING", 7.0))
    before = Motion(4, MotionKind.JOINT, Start.AT, goal=JOINTS.joints)
    after = After(before, 5, settings)
    goals = zip(Start, (None, IDENTITY, JOINTS.joints), strict=True)
    stand, line, joint = (after.motion(start, goal) for start, goal in goals)
    assert [one.kind for one in (stand, line, joint)] == [MotionKind.REST, MotionKind.STRAIGHT, MotionKind.JOINT]
    assert [one.swivel for one in (stand, line, joint)] == [None, swivel, None]
    assert [one.acceleration for one in (stand, line, joint)] == [1.0, 0.4, 0.4]
    assert [one.pose for one in (stand, line, joint)] == [None, IDENTITY, None]
    assert [one.goal for one in (stand, line, joint)] == [None, None, JOINTS.joints]
    for one in (stand, line, joint):
        assert (one.number, one.frames) == (5, before.frames)
        assert (one.rounding is None) == (one.start is not Start.BLEND)
    other = after.motion(Start.AT, IDENTITY, duration=2.0, text="MOVES a")
    assert (other.duration, other.text) == (2.0, "MOVES a")
