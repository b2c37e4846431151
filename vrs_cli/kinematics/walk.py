"""What a walk along a straight line tells of it, for an arm with joints too many (`numeric.redundancy`)."""

from __future__ import annotations

from operator import mul
from typing import NamedTuple

from vrs_cli.kinematics.joints import Joints

Asked = tuple[tuple[int, float], ...]  # joints, by index, and where each is to end: there its own guide leads


class Walk(NamedTuple):
    """What the guides of a line follow from: the joints at its end, their weights, how far all joints keep from the
    ends of their ranges, as a part of these, and whether they bring the flange there.
    """

    end: Joints
    weights: tuple[Joints, ...]
    margin: float
    arrives: bool

    @property
    def ends(self) -> tuple[float, ...]:
        return tuple([sum(map(mul, weights, self.end)) for weights in self.weights])
