"""Record what the laws plan: `python -m tests.trajectory.laws.recorded` writes `recorded_laws.txt` anew.

A recording belongs to a `VERSION` of `vrs_cli.trajectory.laws.law`. If a law plans otherwise, record anew and give the
laws a new version.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from random import Random

from tests.by_hand import command
from tests.recording import numbers, write_record
from vrs_cli.kinematics.joints import Profile
from vrs_cli.kinematics.transform import Vector, at_position, compose, rotation_about, translation
from vrs_cli.trajectory.laws.law import LAWS, NoTimes
from vrs_cli.trajectory.polynomial import value
from vrs_cli.trajectory.segment import JointPath, Segment, ToolStretch
from vrs_cli.trajectory.state import GuideState, JointLimits, JointState, Target, ToolLimits, ToolState
from vrs_cli.values.commands import Motion, MotionKind, Start

RECORDED = Path(__file__).with_name("recorded_laws.txt")
SPEED, GAIN, JERK, RANGE = (1.4, 0.9, 2.0), (4.8, 3.1, 9.0), (48.0, 31.0, 60.0), (3.0, 1.0, 0.6)
LIMITS = JointLimits(SPEED, GAIN, JERK, SPEED, tuple(-x for x in RANGE), RANGE)
TOOL = {"speed": 0.5, "acceleration": 2.0, "spin": 1.0, "spin_acceleration": 4.0, "jerk": 20.0, "spin_jerk": 25.0}
TOOL_LIMITS = ToolLimits(**TOOL, guide=1.0, guide_acceleration=5.0, guide_jerk=50.0)
WAYS = (0.0, 0.001, 0.03, 0.2, 1.0)  # of the ranges, or [m, rad]
TICK = 1.0 / 64.0  # [s]
CASES = tuple((profile, what) for profile in Profile for what in ("joints", "stops", "lines", "line stops", "steering"))


def lines(profile: Profile, what: str) -> Iterator[str]:
    """Yield what a law plans in random cases of one kind, seldom more than ten numbers for each."""
    random, law = Random(f"{profile.value} {what}"), LAWS[profile]
    motion = Motion(1, MotionKind.JOINT, Start.AT, profile=profile)
    for case in range(8 if what == "steering" else 32):
        joints, tool, size = _joints(random, law.smooth), _tool(random, law.smooth), random.choice(WAYS)
        least = random.choice((0.0, 0.0, 0.0, 1.5))
        try:
            match what:
                case "joints":
                    goal = tuple(q + size * random.uniform(-r, r) for q, r in zip(joints.joints, RANGE, strict=True))
                    yield _of_joints(law.joint_motion(joints, goal, LIMITS, 0.0, motion, least))
                case "stops":
                    yield " or ".join(map(_of_joints, law.joint_stops(joints, LIMITS, 0.0, motion)))
                case "lines":
                    way = compose(
                        translation(*_vector(random, size)), rotation_about((0.0, 0.6, 0.8), size * case / 16)
                    )
                    yield _of_tool(law.straight_motion(tool, compose(tool.pose, way), TOOL_LIMITS, least))
                case "line stops":
                    yield "at rest" if tool.at_rest else _of_tool(law.straight_stop(tool, TOOL_LIMITS))
                case _:
                    yield from _steering(profile, joints, random)
        except NoTimes as error:
            yield f"no times: {error}"


def _steering(profile: Profile, state: JointState, random: Random) -> Iterator[str]:
    """Plan some ticks one after the other, after targets that jump now and then."""
    law, motion = LAWS[profile], Motion(1, MotionKind.STEERED, Start.AT, profile=profile)
    place, speed = state.joints, tuple(random.uniform(-0.5, 0.5) * v for v in SPEED)
    for _ in range(4):
        place = tuple(
            q + random.choice((0.0, 0.0, 0.3)) * r + w * TICK for q, r, w in zip(place, RANGE, speed, strict=True)
        )
        segments = law.steer(state, Target(place, speed), LIMITS, LIMITS, TICK, 0.0, motion, lambda: None)
        if not segments:
            yield "no room"
            return
        rates = law.steering_of(segments)
        again = () if rates is None else law.replay_steering(state, rates, LIMITS, TICK, 0.0, motion)
        yield f"{_of_joints(segments)}; {again == segments and _shown(rates or ())}"
        path = segments[0].path
        assert isinstance(path, JointPath)
        state = JointState(path.joints(TICK), path.velocity(TICK), path.acceleration(TICK) if law.smooth else ())


def _shown(values: Iterable[float]) -> str:
    return numbers(values, 7)


def _vector(random: Random, most: float) -> Vector:
    return random.uniform(-most, most), random.uniform(-most, most), random.uniform(-most, most)


def _joints(random: Random, smooth: bool) -> JointState:
    fast, hard = random.choice((0.0, 0.3, 0.95)), random.choice((0.0, 0.5)) * smooth
    return JointState(
        tuple(random.uniform(-0.9, 0.9) * r for r in RANGE),
        tuple(fast * random.uniform(-v, v) for v in SPEED),
        tuple(hard * random.uniform(-a, a) for a in GAIN) if hard else (),
    )


def _tool(random: Random, smooth: bool) -> ToolState:
    fast, hard = random.choice((0.0, 0.1, 0.3)), random.choice((0.0, 0.5)) * smooth
    guides = tuple(GuideState((1.0, 0.0), 0.0, random.uniform(-1.0, 1.0)) for _ in range(random.choice((0, 0, 1))))
    return ToolState(
        at_position(rotation_about((0.6, 0.0, 0.8), random.uniform(-2.0, 2.0)), *_vector(random, 0.3)),
        _vector(random, fast),
        _vector(random, random.choice((0.0, fast))),
        _vector(random, hard),
        _vector(random, hard),
        guides,
    )


def _of_joints(segments: Sequence[Segment]) -> str:
    """Return the phases and times, and the joints in the middle of each."""
    rows = []
    for one in segments:
        assert isinstance(one.path, JointPath)
        rows.append(f"{one.phase.name[0]} {_shown((one.duration, *one.path.joints(0.5 * one.duration)))}")
    return ", ".join(rows) or "nothing"


def _of_tool(stretches: Sequence[ToolStretch]) -> str:
    """Return the phases and times, and the place, the turn and the guides in the middle of each."""
    rows = []
    for one in stretches:
        s = 0.5 * one.duration
        angles = [value(angle, s) for _, angle in one.turns]
        guides = [value(guide, s) for guide in one.guides]
        place = [value(a, s) for a in one.position]
        rows.append(f"{one.phase.name[0]} {_shown((one.duration, *place, *angles, *guides))}")
    return ", ".join(rows) or "nothing"


def main() -> None:
    write_record(RECORDED, {f"{profile.value} {what}": lines(profile, what) for profile, what in CASES})


if __name__ == "__main__":
    command(main)
