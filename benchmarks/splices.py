"""Jerk-limited interruptions beside Ruckig, which plans each joint for itself: `python -m benchmarks.splices [COUNT]`.

A motion to anywhere is interrupted at any time by another. Prints how our times compare, and the worst of them.
"""

from __future__ import annotations

import sys
from random import Random

from ruckig import InputParameter, Result, Ruckig, Trajectory

from vrs_cli.engine.engine import Engine
from vrs_cli.engine.problem import Here, Problem, state_at
from vrs_cli.engine.single_motion import joint_limits, plan_motion
from vrs_cli.kinematics.joints import Joints, Profile
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.trajectory.segment import Phase
from vrs_cli.trajectory.state import JointState
from vrs_cli.values.commands import Motion, MotionKind, Start

MODEL = load_robot("puma560")
ARM = Engine(MODEL).arm
SHORT = 1e-3  # [s] a motion that is none


def main(count: int = 2000, seed: int = 1) -> None:
    source, rows = Random(seed), []
    for number in range(count):
        here, motion = interruption(source)
        segments = plan_motion(Problem(ARM, here, motion, 0.0))
        theirs = ruckig(here, motion)
        if theirs > SHORT and segments[0].phase is not Phase.DECELERATE:  # no room: it braked first
            rows.append((segments[-1].finish / theirs, number))
    ratios = sorted(ratio for ratio, _ in rows)
    parts = {"median": 0.5, "90 %": 0.9, "99 %": 0.99}
    print(f"{len(rows)} interruptions, our time beside Ruckig's:", end=" ")
    print(", ".join(f"{name} {ratios[int(part * len(ratios))]:.4f}" for name, part in parts.items()), end=", ")
    print("worst", ", ".join(f"{ratio:.3f} (no. {number})" for ratio, number in sorted(rows)[:-6:-1]))


def interruption(source: Random) -> tuple[Here, Motion]:
    """A state in the middle of a motion, and the next motion, at full speed or slower, far or near."""
    part = source.choice((1.0, 1.0, 0.3, 0.05))
    start = _somewhere(source)
    first = _motion(1, _beside(source, start, part), source)
    segments = plan_motion(Problem(ARM, Here(JointState(start, (0.0,) * len(start))), first, 0.0))
    t = source.uniform(0.0, segments[-1].finish)
    segment = [segment for segment in segments if segment.start <= t][-1]
    here = state_at(ARM, segment, t - segment.start)
    return here, _motion(2, _beside(source, here.joints.joints, part), source)


def _motion(number: int, goal: Joints, source: Random) -> Motion:
    speed = source.choice((1.0, source.uniform(0.1, 1.0)))
    return Motion(number, MotionKind.JOINT, Start.AT, goal=goal, speed=speed, profile=Profile.SCURVE)


def _somewhere(source: Random) -> Joints:
    return tuple(map(source.uniform, MODEL.lower, MODEL.upper))


def _beside(source: Random, joints: Joints, part: float) -> Joints:
    return tuple(q + part * (other - q) for q, other in zip(joints, _somewhere(source), strict=True))


def ruckig(here: Here, motion: Motion) -> float:
    """How long Ruckig takes [s]; 0 where it finds no way."""
    state, limits = here.joints, joint_limits(ARM, motion)
    task, trajectory = InputParameter(len(state.joints)), Trajectory(len(state.joints))
    task.current_position, task.current_velocity = state.joints, state.velocity
    task.current_acceleration = state.acceleration
    task.target_position = motion.goal
    task.max_velocity, task.max_acceleration, task.max_jerk = limits.velocity, limits.acceleration, limits.jerk
    found = Ruckig(len(state.joints)).calculate(task, trajectory) == Result.Working
    return float(trajectory.duration) if found else 0.0


if __name__ == "__main__":
    main(*map(int, sys.argv[1:3]))
