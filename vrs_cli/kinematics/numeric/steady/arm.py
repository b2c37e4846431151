"""Solve arms of four or five joints that reach the position of the tool exactly, and its orientation as closely as
possible (formulas: `conditions`).

Even if the desired orientation is impossible, the desired pose determines the joints. So joint velocities depend on the
desired pose as well as on the actual pose.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property, lru_cache
from math import dist
from typing import TYPE_CHECKING

from vrs_cli.errors import JointOutOfRange, LocationOutOfRange, LocationTooFar
from vrs_cli.kinematics.clearance import Unchanging
from vrs_cli.kinematics.joints import Configuration, Demands, Joints, Twist
from vrs_cli.kinematics.model import RobotModel, levers
from vrs_cli.kinematics.numeric.arm import NumericArm
from vrs_cli.kinematics.transform import IDENTITY, Transform, at_position, compose, length, position

if TYPE_CHECKING:
    from vrs_cli.kinematics.numeric.steady.batch import SteadyBatch, SteadyContinuation


class SteadyArm(NumericArm):
    """An arm of four or five joints with the task STEADY. It has one configuration, which no word (RIGHTY, ABOVE ...)
    selects. The methods are those of `arm.RobotArm`.
    """

    method = "damped least squares within the limits, the tool turned as nearly as can be"

    def __init__(self, model: RobotModel, T_flange_tool: Transform = IDENTITY) -> None:
        super().__init__(model)
        # the orientation determines the joints that the position leaves free
        self.redundancy, self.still_joints, self.guesses = 0, (), False
        self.steady = self
        self.tool = at_position(IDENTITY, *position(T_flange_tool))

    def for_tool(self, T_flange_tool: Transform) -> SteadyArm:
        if position(T_flange_tool) == position(self.tool):
            return self
        return _steady_arm(self.model, at_position(IDENTITY, *position(T_flange_tool)))

    @cached_property
    def unchanging(self) -> Unchanging:
        """Return an `Unchanging` that allows every pose, because the arm accepts orientations that it cannot reach."""
        return Unchanging()

    def check_tool(self, T_flange_tool: Transform) -> None:
        """Accept every tool, because only the position of its tip counts."""

    @cached_property
    def batch(self) -> SteadyBatch:  # type: ignore[override] # its searches have other steps
        from vrs_cli.kinematics.numeric.steady.batch import SteadyBatch  # imported here because it loads numpy

        return SteadyBatch(self.model, self.unchanging, self.tool)

    # --- inverse ---------------------------------------------------------------------------------------------

    def branch_joints(self, T: Transform, configuration: Configuration, near: Joints) -> Joints | None:  # noqa: ARG002
        return self.batch.follow(T, near)

    def branches(self, T: Transform) -> tuple[Joints | None, ...]:
        return (self._least(T, self.middle),)

    def within_ranges(self, T: Transform, near: Joints) -> Joints | None:
        return self.batch.within_ranges(T, near)

    def missing_turn(self, q: Joints, T: Transform) -> float:
        from vrs_cli.kinematics.numeric.steady.conditions import PointConditions  # imported here because it loads numpy

        return float(PointConditions(self.batch.conditions, q, T).at.angle[0])

    def beyond(self, T: Transform) -> bool:  # noqa: ARG002 (the search decides)
        return False

    def _nowhere(self, T: Transform, near: Joints) -> LocationOutOfRange | JointOutOfRange:
        """Return the error for a location that cannot be reached: a joint would be out of its range, or the location is
        too far away.
        """
        found = self.batch.without_limits(T, near)
        if found:
            best = self._best_turns(found[0][0])
            return self._joint_refusal(best, "turn the location, or move it nearer")
        return self._out_of_reach(T, self.ways[0], "")

    def _out_of_reach(self, T: Transform, configuration: Configuration, hint: str) -> LocationOutOfRange:
        """Return the error for a pose out of reach, with the distance of the tool's tip, because only the tip's
        position is prescribed.
        """
        start, (most, *_) = levers(self.model)
        tip, most = position(compose(T, self.tool)), most + length(position(self.tool))
        far = dist(tip, start)
        if far <= most:
            return super()._out_of_reach(at_position(T, *start), configuration, hint)
        return LocationTooFar(
            f"the tool would be {1000 * far:.1f} mm from the axis of joint 1, "
            f"all links in one line are {1000 * most:.1f} mm",
            hint or f"move the location at least {1000 * (far - most):.1f} mm nearer",
            value=far,
            upper=most,
        )

    @cached_property
    def continuation(self) -> SteadyContinuation:  # type: ignore[override] # made on demand because it loads numpy
        from vrs_cli.kinematics.numeric.steady.batch import SteadyContinuation

        return SteadyContinuation(self.batch.conditions)

    # --- velocities ------------------------------------------------------------------------------------------

    def joint_velocity(
        self,
        q: Joints,
        twist: Twist,
        T_flange_tool: Transform = IDENTITY,
        demands: Demands = (),  # noqa: ARG002 (no redundant joints)
    ) -> Joints:
        T = self.forward(q)
        return self.rates_on(q, lambda _: T, twist, T_flange_tool, 1)[0]

    def rates_on(
        self, q: Joints, poses: Callable[[float], Transform], twist: Twist, T_flange_tool: Transform, order: int
    ) -> tuple[Joints, ...]:
        # imported here because it loads numpy
        from vrs_cli.kinematics.numeric.steady.conditions import CannotFollow, PointConditions

        try:
            return PointConditions(self.for_tool(T_flange_tool).batch.conditions, q, poses(0.0)).rates(
                twist, poses, order
            )
        except CannotFollow:
            raise self._cannot_move_so(q) from None

    # --- singularity -----------------------------------------------------------------------------------------

    def freedom(self, q: Joints) -> float:
        """Return how well the joints move the tip, times how well they turn the tool while the tip is at rest (see
        `PointConditions.freedom`).
        """
        from vrs_cli.kinematics.numeric.steady.conditions import PointConditions  # imported here because it loads numpy

        return PointConditions(self.batch.conditions, q, self.forward(q)).freedom


_steady_arm = lru_cache(SteadyArm)
