"""`arm_for(model)`: the arm of a robot, of the class that fits its axes.

A closed form where there is one, else a search that finds all solutions, else the numerical one, which knows all axes.
"""

from __future__ import annotations

from functools import lru_cache

from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.model import ArmTask, RobotModel


@lru_cache
def arm_for(model: RobotModel) -> RobotArm:
    """The arm of a model: of the first form that knows its axes; the numerical one knows all."""
    closed = _spherical_wrist(model) or _offset_wrist(model) or _wrist_circle(model) or _parallel_axes(model)
    if closed is not None:
        return closed
    if model.task is ArmTask.STEADY:
        from vrs_cli.kinematics.numeric.steady.arm import SteadyArm

        return SteadyArm(model)
    from vrs_cli.kinematics.numeric.arm import NumericArm

    return NumericArm(model)


# A form is imported when a robot may be of it: most are of the first.


def _spherical_wrist(model: RobotModel) -> RobotArm | None:
    from vrs_cli.kinematics.spherical_wrist.arm import SphericalWristArm
    from vrs_cli.kinematics.spherical_wrist.inverse import ALPHAS, geometry_of, swapped

    geometry = geometry_of(model)
    if geometry is not None and not swapped(geometry, down=False, folded=geometry.d4 * geometry.d6 < 0.0):
        return SphericalWristArm(model, geometry)
    from vrs_cli.kinematics.mapped_arm import MappedArm, canonical

    way = canonical(model, ALPHAS[:5])
    geometry = None if way is None else geometry_of(way.model)
    if way is None or geometry is None:
        return None
    words = swapped(geometry, down=way.down, folded=geometry.d4 * way.hand < 0.0)
    return MappedArm(model, way, SphericalWristArm(way.model, geometry), words)


def _offset_wrist(model: RobotModel) -> RobotArm | None:
    from vrs_cli.kinematics.joints import ARM, ELBOW, WRIST
    from vrs_cli.kinematics.mapped_arm import MappedArm, canonical
    from vrs_cli.kinematics.offset_wrist.arm import OffsetWristArm
    from vrs_cli.kinematics.offset_wrist.inverse import ALPHAS, offsets_of

    way = canonical(model, ALPHAS)
    offsets = None if way is None else offsets_of(way.model)
    if way is None or offsets is None:
        return None
    words = (ARM | ELBOW) * way.down + WRIST * (offsets.right * way.hand < 0.0)
    return MappedArm(model, way, OffsetWristArm(way.model, offsets), words)


def _wrist_circle(model: RobotModel) -> RobotArm | None:
    from vrs_cli.kinematics.mapped_arm import canonical
    from vrs_cli.kinematics.spherical_wrist.inverse import swapped
    from vrs_cli.kinematics.wrist_circle.arm import WristCircleArm
    from vrs_cli.kinematics.wrist_circle.circle import ALPHAS, circle_of

    way = canonical(model, ALPHAS, bare=False)
    circle = None if way is None else circle_of(way.model)
    if way is None or circle is None:
        return None
    words = swapped(circle.arm, down=way.down, folded=circle.straight * circle.arm.d4 * way.hand < 0.0)
    return WristCircleArm(model, way, circle, words)


def _parallel_axes(model: RobotModel) -> RobotArm | None:
    from vrs_cli.kinematics.parallel_axes.arm import ParallelAxesArm
    from vrs_cli.kinematics.parallel_axes.bars import bars_of

    bars = bars_of(model)
    return None if bars is None else ParallelAxesArm(model, bars)
