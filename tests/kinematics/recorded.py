"""What arms compute and refuse, as it was recorded: `python -m tests.kinematics.recorded` writes it anew.

`recorded_arms.txt` has for each arm, at random joints: its pose and what is said of the pose; velocities,
accelerations and jerks for a motion of a tool; and all joints, or the refusal, for poses beside that one.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from random import Random

from tests.by_hand import command
from tests.recording import numbers, write_record
from vrs_cli.errors import MotionError
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.clearance import HandPace
from vrs_cli.kinematics.forms import arm_for
from vrs_cli.kinematics.joints import Joints
from vrs_cli.kinematics.robot_file import load_robot, robot_names
from vrs_cli.kinematics.transform import IDENTITY, Transform, Vector, compose, rotation_about, translation, unit

RECORDED = Path(__file__).with_name("recorded_arms.txt")
URDF = Path(__file__).with_name("urdf")
ROBOTS = (*robot_names(), *sorted(path.name for path in URDF.glob("*.urdf")))
POSES = 2  # of each arm
TOOL = compose(translation(0.0, 0.0, 0.08), rotation_about((0.0, 0.0, 1.0), 0.3))
BESIDE = (0.0, 0.01, 0.15, 2.5)  # [m, rad] how far poses are from one that is in reach
PACE = HandPace(0.4, 0.5, 0.6, 0.7, 0.3, 0.2)


def lines(robot: str) -> Iterator[str]:
    random, arm = Random(robot), arm_for(load_robot(URDF / robot if robot.endswith(".urdf") else robot))
    named = list(arm.model.poses.values())
    for k in range(POSES + len(named)):
        q = named[k - POSES] if k >= POSES else _joints(random, arm)
        T = arm.forward(q)
        yield f"joints {numbers(q)}; pose {numbers(T)}"
        yield _state(arm, q, T)
        yield _rates(arm, q, random)
        if k < POSES:
            yield from _inverse(arm, T, random)


def _joints(random: Random, arm: RobotArm) -> Joints:
    rows = zip(arm.model.lower, arm.model.upper, strict=True)
    return tuple(low + random.uniform(0.1, 0.9) * (high - low) for low, high in rows)


def _state(arm: RobotArm, q: Joints, T: Transform) -> str:
    twins = " ".join(map(str, arm.twins(q)))
    near = [numbers(arm.clearance(T, way).sizes) for way in arm.ways]
    return f"{arm.configuration(q)} {twins}; {numbers(arm.singularity(q)[:3])}; {', '.join(near)}; {arm.outward(q):.6f}"


def _rates(arm: RobotArm, q: Joints, random: Random) -> str:
    """Of a tool that moves as joints do that move somehow: an arm with few joints has rates for that too."""
    qd, qdd = ([random.uniform(-0.5, 0.5) for _ in q] for _ in range(2))
    twist, bias = arm.twist(q, tuple(qd), TOOL), arm.acceleration_bias(q, tuple(qd), TOOL)
    rate = tuple(a + b for a, b in zip(arm.twist(q, tuple(qdd), TOOL), bias, strict=True))
    return "; ".join(
        (
            numbers((*twist, *bias)),
            _told(lambda: arm.joint_velocity(q, twist, TOOL)),
            _told(lambda: arm.joint_acceleration(q, tuple(qd), rate, TOOL)),  # type: ignore[arg-type]
            _told(lambda: arm.joint_jerk(q, tuple(qd), tuple(qdd), rate, TOOL)),  # type: ignore[arg-type]
        )
    )


def _inverse(arm: RobotArm, T: Transform, random: Random) -> Iterator[str]:
    before = None
    for far in BESIDE:
        turn = rotation_about(unit(_vector(random)), min(far, 1.5))
        there = compose(T, compose(translation(*(far * x for x in _vector(random))), turn if far > 0.1 else IDENTITY))
        near = _joints(random, arm)
        yield f"select {_told(lambda: arm.select(there, near))}"  # noqa: B023 (called at once)
        for solution in arm.inverse_all(there):
            yield f"{solution.configuration} {numbers(solution.joints or ())}; {solution.outside} {arm.beyond(there)}"
        now = arm.clearance(there, arm.ways[0])
        if before is not None:
            yield numbers(arm.least_clearance(before, now, PACE, far).sizes)
        before = now


def _told(find: Callable[[], Sequence[float]]) -> str:
    try:
        return numbers(find())
    except MotionError as error:
        return str(error)


def _vector(random: Random) -> Vector:
    return random.uniform(-1.0, 1.0), random.uniform(-1.0, 1.0), random.uniform(-1.0, 1.0)


def main() -> None:
    write_record(RECORDED, {robot: lines(robot) for robot in ROBOTS})


if __name__ == "__main__":
    command(main)
