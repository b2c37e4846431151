"""The task that fits an arm whose file names none: what its joints can do, seen on a few poses in their ranges."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import islice
from math import hypot

from vrs_cli.kinematics.compiled import formulas
from vrs_cli.kinematics.elimination import volume
from vrs_cli.kinematics.joints import JointKind
from vrs_cli.kinematics.model import (
    ALL_PARTS,
    FEWEST,
    ArmTask,
    RobotModel,
    axes_parallel,
    flange_steady,
    joint_axes,
    levers,
    plane_normal,
)
from vrs_cli.kinematics.numeric.search import MEASURED, some_joints
from vrs_cli.kinematics.transform import Vector, cross, dot

NOTHING = 1e-6  # of the volume that rows of a length of 1 could span: what no pose of an arm exceeds it cannot do
WELL = 0.1  # of that, on the mean: what an arm does well
PARALLEL = 1e-6  # sine

SAID = {  # of a location
    ArmTask.STEADY: "its place counts, and the tool is turned as nearly as they can",
    ArmTask.POINTING: "its place counts and where the tool points, not how it is turned about that",
    ArmTask.UPRIGHT: "its place counts and the turn about the tool's axis, which keeps its direction",
    ArmTask.POSE: "all of it counts, and what they cannot do is refused",
}

Rows = list[tuple[float, ...]]


def fitting_task(model: RobotModel) -> ArmTask | None:
    """None for an arm of too few joints, which has to say."""
    count = model.joint_count
    if count >= ALL_PARTS:
        return ArmTask.POSE
    if count >= FEWEST:
        return _of_four_or_five(model)
    planar = axes_parallel(model) and JointKind.PRISMATIC not in model.units.kinds
    if planar:
        return {2: ArmTask.POINT, 3: ArmTask.PLANE}.get(count)
    return ArmTask.POSITION if count == sum(ArmTask.POSITION.counts) else None


def misfit_of(task: ArmTask, model: RobotModel) -> tuple[str, str] | None:
    """Why an arm cannot have a task, and what would be right."""
    if not task.suits(model.joint_count):
        joints = f"{FEWEST} or {ALL_PARTS - 1}" if task is ArmTask.STEADY else str(task.size)
        return f"{task.value!r} takes {joints} joints", f"the robot has {model.joint_count}"
    if task is ArmTask.PLANE and plane_normal(model) is None:
        return f"{task.value!r} is for arms that move in one plane", f"give {ArmTask.POSITION.value!r}"
    if task is ArmTask.UPRIGHT and not flange_steady(model):
        what = f"{task.value!r} is for arms whose flange keeps its direction, and this one tilts it"
        return what, f"give {ArmTask.POSITION.value!r}"
    return None


def said(model: RobotModel) -> tuple[str, ...]:
    """What is told of a task that nobody named, of an arm that cannot do all."""
    if not FEWEST <= model.joint_count < ALL_PARTS or model.task not in SAID:
        return ()
    return (f"{model.joint_count} joints: the task is {model.task.value}, {SAID[model.task]}; --task names another",)


def _of_four_or_five(model: RobotModel) -> ArmTask:
    """The whole pose counts only where less makes no arm of it: the place is not free, or joints do one thing."""
    if flange_steady(model):
        return ArmTask.UPRIGHT if model.joint_count == ArmTask.UPRIGHT.size else ArmTask.POSE
    if model.joint_count == ArmTask.POINTING.size:
        second, third, fourth = (axis.direction for axis in joint_axes(model)[1:4])
        # joints 2 to 4 only tilt the tool in the plane of the arm, so that it points nowhere else
        keeps_plane = model.units.kinds[1:4] == (JointKind.REVOLUTE,) * 3 and all(
            max(map(abs, cross(second, other))) < PARALLEL for other in (third, fourth)
        )
        if not keeps_plane and _mean(model, ArmTask.POINTING) > WELL:
            return ArmTask.POINTING
    places, all_parts = _mean(model, ArmTask.POSITION), _mean(model, ArmTask.POSE)
    return ArmTask.STEADY if min(places, all_parts) > NOTHING else ArmTask.POSE


def _mean(model: RobotModel, task: ArmTask) -> float:
    """How well the joints do what counts, or what they can of it, on the mean of some poses: the volume of the rows, or
    of the columns if these are fewer, of unit length each.
    """
    functions, (_, (reach, *_)) = formulas(model.links, model.base, model.flange), levers(model)
    total = 0.0
    for q in islice(some_joints(model), MEASURED):
        T, J = functions.forward(q), functions.jacobian(q)
        axes: Sequence[Vector] = [(T[i], T[4 + i], T[8 + i]) for i in range(3)]
        turns = [tuple(dot(axis, column) for column in zip(*J[3:], strict=True)) for axis in axes]
        rows: Rows = [tuple(x / reach for x in row) for row in J[:3]] + turns
        counted = [row for row, counts in zip(rows, task.counts, strict=True) if counts]
        vectors = counted if len(counted) <= model.joint_count else list(zip(*counted, strict=True))
        sizes = [hypot(*row) for row in vectors]
        if all(sizes):
            total += volume([[x / size for x in row] for row, size in zip(vectors, sizes, strict=True)])
    return total / MEASURED
