"""What the planner asks of a velocity profile, and `LAWS[profile]`. The file named after a profile has its `LAW`."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from importlib import import_module
from typing import NamedTuple

from vrs_cli.kinematics.joints import Joints
from vrs_cli.kinematics.profile import Profile
from vrs_cli.kinematics.transform import Transform
from vrs_cli.trajectory.segment import Segment, ToolStretch
from vrs_cli.trajectory.state import JointLimits, JointState, Target, ToolLimits, ToolState
from vrs_cli.values.commands import Motion

VERSION = (
    2  # of the laws: what they plan from the same state to the same target. 1: SCURVE had common times out of motion
)
Pieces = tuple[tuple[float, float], ...]  # (duration, jerk) of one joint, one after the other
Row = tuple[
    int, float, float, float, float, float
]  # an instant of the time grid, the same in seconds, a cubic from there
Coming = Callable[[], Sequence[Sequence[Row]] | None]  # what each joint was to do from now on, where that is cubics


class NoTimes(ValueError):
    """No times within the limits bring the motion to its target from the state that it starts in."""


class Law(NamedTuple):
    """How motions of a profile gain and lose velocity.

    `smooth`: the acceleration does not jump, and the jerk is limited. `samples`: in how many places each stretch of a
    straight line is looked at, before the joints ask for more. All end at rest:

    `joint_motion(state, goal, limits, start, motion, least)`: the segments of a joint-interpolated motion to `goal`;
    `least`: the least duration [s]. Raises NoTimes.
    `joint_stops(state, limits, start, motion)`: ways of braking, the one to try first first.
    `straight_motion(state, target, limits, least)`: the stretches of a straight line to T_robot_tool `target`; empty
    when the tool is there already. Raises NoTimes.
    `straight_stop(state, limits)`: the tool to rest on the line that it moves on. Raises NoTimes.
    `steer(state, target, limits, hardest, tick, start, motion, coming)`: a tick [s] towards a target that moves, then
    a stop; `hardest`: the limits of braking. Empty where neither a tick nor what is `coming` keeps the limits.
    `steered(state, rates, limits, tick, start, motion)`: the same again from what `steering_of(segments)` says of each
    joint; None where that is not enough.
    """

    smooth: bool
    samples: int
    joint_motion: Callable[[JointState, Joints, JointLimits, float, Motion, float], tuple[Segment, ...]]
    joint_stops: Callable[[JointState, JointLimits, float, Motion], Iterator[tuple[Segment, ...]]]
    straight_motion: Callable[[ToolState, Transform, ToolLimits, float], list[ToolStretch]]
    straight_stop: Callable[[ToolState, ToolLimits], list[ToolStretch]]
    steer: Callable[[JointState, Target, JointLimits, JointLimits, float, float, Motion, Coming], tuple[Segment, ...]]
    steered: Callable[[JointState, Joints, JointLimits, float, float, Motion], tuple[Segment, ...]]
    steering_of: Callable[[Sequence[Segment]], Joints | None]


class _Laws(dict[Profile, Law]):
    def __missing__(self, profile: Profile) -> Law:
        """Read the file that is named after the profile, which most programs do for one profile alone."""
        law: Law = import_module(f"{__package__}.{profile.value}").LAW
        return self.setdefault(profile, law)


LAWS = _Laws()
