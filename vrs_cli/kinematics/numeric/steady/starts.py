"""Joints from which searches of steady arms start.

Arms whose joints 2 to 4 have parallel axes, as most arms for teaching have, start from a table. While the last joint of
five stands at an angle, joint 1 follows from the place of the tip: it turns the plane of joints 2 to 4 to where the tip
is as far out of it as these leave it, in two ways. For each direction of the hand in that plane joints 2 and 3 are two
bars that reach a point, in two ways (complex numbers are vectors of the plane). So all joints that reach a place are a
table over the angle of the last joint and the direction of the hand, and each least turn is near an entry that is less
than its neighbours. Axes may be parallel as nearly as a measured robot's are: a search makes the joints exact.

Other arms start from those of many joints in their ranges that bring the tip nearest to a place.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import islice
from math import cos, pi, sqrt

import numpy as np

from vrs_cli.kinematics.arrays import Flags, Floats
from vrs_cli.kinematics.joints import TURN
from vrs_cli.kinematics.model import RobotModel, joint_axes, link_frames
from vrs_cli.kinematics.numeric.search import some_joints
from vrs_cli.kinematics.serial_batch import SerialBatch
from vrs_cli.kinematics.transform_batch import rotation_about_batch

FIRST = 4  # joints: one turns the plane, three move in it
PARALLEL = 0.01  # [rad] between axes that are parallel enough
SHORTEST = 1e-3  # [m] a bar
ROLLS, DIRECTIONS = 24, 24  # angles of the last joint; directions of the hand on either side of the shoulder
# of the way from one end of the directions to the other: dense near the ends, where the bars turn fast, and without
# these, where they are stretched or folded and a search does not know which way to bend them
PARTS = 0.5 - 0.5 * np.cos(np.linspace(0.02, pi - 0.02, DIRECTIONS))
BEYOND = 0.02  # of the length of both bars: a place so little out of reach may be in reach between two entries
OUTSIDE = 8.0  # [rad/rad] turn that outweighs an angle outside of its range
WORSE = 0.5  # [rad] entries that miss so much more than the best one do not lead to a lesser turn
MOST_STARTS = 16
ON_AXIS = 1e-6  # [m] of the tip from axis 1: joint 1 may stand anywhere


def is_planar(batch: SerialBatch) -> bool:
    """Whether joints 2 to 4 of an arm have parallel axes."""
    if batch.joints not in (FIRST, FIRST + 1) or not batch.turning.all():
        return False
    points, ways = (np.array(rows) for rows in zip(*joint_axes(batch.model), strict=True))
    bars = np.cross(ways[1], np.diff(points[1:FIRST], axis=0))
    leaning = np.linalg.norm(np.cross(ways[1], np.stack((ways[0], *ways[2:FIRST]))), axis=1)
    return bool(leaning[0] > 0.5 and (leaning[1:] < PARALLEL).all() and (np.linalg.norm(bars, axis=1) > SHORTEST).all())


class PlanarStarts:
    """Starts for one arm and the tip of one tool (3,), in the frame of the flange."""

    def __init__(self, batch: SerialBatch, tip: Floats) -> None:
        model, self.tip = batch.model, tip
        points, ways = (np.array(rows) for rows in zip(*joint_axes(model), strict=True))
        T = np.reshape(link_frames(model, (0.0,) * batch.joints)[-1], (3, 4))
        self.axis, self.point, self.normal = ways[0], points[0], ways[1]
        across = np.cross(self.normal, self.axis)
        across /= np.linalg.norm(across)
        self.plane = across + 1j * np.cross(self.normal, across)  # (3,) takes vectors to complex numbers
        self.signs = np.sign(ways[2:FIRST] @ self.normal)
        self.rolls = np.linspace(batch.lower[-1], batch.upper[-1], ROLLS) if batch.joints > FIRST else np.zeros(1)
        turns = rotation_about_batch(ways[-1], self.rolls if batch.joints > FIRST else np.zeros(1))[:, :, :3]
        self.hands = turns @ T[:, :3]  # (rolls, 3, 3)
        tips = points[-1] + turns @ (T[:, :3] @ tip + T[:, 3] - points[-1])
        self.beside = (tips - points[1]) @ self.normal  # (rolls,) of the tip, out of the plane
        self.shoulder = points[1]
        self.upper, self.fore = np.diff(points[1:FIRST], axis=0) @ self.plane
        self.hand = ((tips - points[FIRST - 1]) @ self.plane)[:, None]  # (rolls, 1)
        self.bends, *reach = (np.array(rows) for rows in zip(*self._reach(model), strict=True))
        self.reach, self.slack = np.stack(reach), BEYOND * (abs(self.upper) + abs(self.fore))
        self.joints, self.middle, self.half = (
            batch.joints,
            (batch.lower + batch.upper) / 2,
            (batch.upper - batch.lower) / 2,
        )

    def of(self, T: Floats) -> Floats | None:
        """(k, n): joints near those that bring the tip to the place of a pose (3, 4) and turn it least. No rows for a
        place that is out of reach; None where joint 1 may stand anywhere.
        """
        out = T[:, :3] @ self.tip + T[:, 3] - self.point
        outward, sideways = out - self.axis * (self.axis @ out), np.cross(self.axis, out)
        a, b = self.normal @ outward, -self.normal @ sideways
        far = np.hypot(a, b)
        if far < ON_AXIS:
            return None
        part = (self.beside + self.normal @ (self.shoulder - self.point - self.axis * (self.axis @ out))) / far
        reached = np.abs(part) * far < far + self.slack  # (rolls,)
        q1 = np.arctan2(b, a) + np.arccos(np.clip(part, -1.0, 1.0))[:, None] * (1.0, -1.0)  # (rolls, 2)
        turned_back = np.cos(q1)[..., None] * outward - np.sin(q1)[..., None] * sideways
        place = (turned_back + self.axis * (self.axis @ out) + self.point - self.shoulder) @ self.plane
        angles, apart = self._in_plane(place)
        reached = reached[:, None, None, None, None] & (apart < self.slack)
        joints = np.empty((*angles[0].shape, self.joints))
        joints[..., 0], joints[..., -1] = q1[:, :, None, None, None], self.rolls[:, None, None, None, None]
        for i, angle in enumerate(angles, 1):
            joints[..., i] = angle
        joints[..., :FIRST] -= TURN * np.rint((joints[..., :FIRST] - self.middle[:FIRST]) / TURN)
        missed = self._missed(q1, T, angles[0] + self.signs[0] * angles[1] + self.signs[1] * angles[2])
        outside = np.maximum(np.abs(joints - self.middle) - self.half, 0.0).sum(axis=-1)
        missed = np.where(reached, missed, np.inf)
        within = np.where(outside > 0.0, np.inf, missed)
        least = _least(within) | _least(missed + OUTSIDE * outside)
        # where the bars just reach a place, all directions are one: its copies may not crowd out the others
        _, once = np.unique(np.round(joints[least], 6), axis=0, return_index=True)
        found, size = joints[least][once], (missed + OUTSIDE * outside)[least][once]
        order = np.argsort(size)[:MOST_STARTS]
        return np.asarray(found[order][size[order] < within.min() + WORSE])

    def _reach(self, model: RobotModel) -> Iterator[tuple[float, float, float]]:
        """Both signs of the angle between the bars, as far as joint 3 can have them, and how far the bars reach at
        least and at most [m].
        """
        upper, fore = abs(self.upper), abs(self.fore)
        straight = np.angle(self.fore) - np.angle(self.upper)
        ends = sorted((self.signs[0] * model.lower[2] + straight, self.signs[0] * model.upper[2] + straight))
        for sign in (1.0, -1.0):
            low, high = ends if sign > 0.0 else (-ends[1], -ends[0])
            turns = [TURN * k for k in range(-3, 4) if low - TURN * k <= pi and high - TURN * k >= 0.0]
            if turns:
                least = max(min([low - turn for turn in turns]), 0.0)
                most = min(max([high - turn for turn in turns]), pi)
                square, twice = upper * upper + fore * fore, 2.0 * upper * fore
                yield sign, sqrt(square + twice * cos(most)), sqrt(square + twice * cos(least))

    def _in_plane(self, place: Floats) -> tuple[tuple[Floats, Floats, Floats], Floats]:
        """Joints 2 to 4 (rolls, 2, 2, bends, directions) for places of the tip from the shoulder (rolls, 2), and by how
        much the bars are too short or too long to reach the wrist there [m].
        """
        upper, fore, hand = np.abs(self.upper), np.abs(self.fore), np.maximum(np.abs(self.hand), SHORTEST)[..., None]
        far = np.maximum(np.abs(place), SHORTEST)[..., None]
        first, last = (
            np.arccos(np.clip((far**2 + hand**2 - r**2) / (2.0 * far * hand), -1.0, 1.0)) for r in self.reach
        )
        swing = first[..., None] + (last - first)[..., None] * PARTS
        shoulder = (np.angle(place) - np.angle(self.hand))[..., None, None, None]
        directions = shoulder + np.stack((swing, -swing), axis=2)
        wrist = place[..., None, None, None] - np.exp(1j * directions) * self.hand[..., None, None, None]
        reach = np.abs(wrist)
        apart = np.maximum(reach - self.reach[1, :, None], self.reach[0, :, None] - reach)
        bent = (
            np.arccos(np.clip((reach**2 - upper**2 - fore**2) / (2.0 * upper * fore), -1.0, 1.0)) * self.bends[:, None]
        )
        q2 = np.angle(wrist) - np.angle(upper + fore * np.exp(1j * bent)) - np.angle(self.upper)
        q3 = self.signs[0] * (bent - np.angle(self.fore) + np.angle(self.upper))
        return (q2, q3, self.signs[1] * (directions - q2 - self.signs[0] * q3)), apart

    def _missed(self, q1: Floats, T: Floats, direction: Floats) -> Floats:
        """The turn that the hand misses [rad]: from the trace of a product of rotations, one about the normal."""
        back = rotation_about_batch(self.axis, q1.ravel())[:, :, :3].reshape(*q1.shape, 3, 3)
        rest = (self.hands @ T[:, :3].T)[:, None] @ back
        along = np.einsum("i,...ij,j->...", self.normal, rest, self.normal)
        across = np.trace(rest, axis1=-2, axis2=-1) - along
        x, y, z = self.normal
        around = (
            x * (rest[..., 1, 2] - rest[..., 2, 1])
            + y * (rest[..., 2, 0] - rest[..., 0, 2])
            + z * (rest[..., 0, 1] - rest[..., 1, 0])
        )
        along, across, around = (one[..., None, None, None] for one in (along, across, around))
        cosine = 0.5 * (along + across * np.cos(direction) + around * np.sin(direction) - 1.0)
        return np.asarray(np.arccos(np.clip(cosine, -1.0, 1.0)))


def _least(missed: Floats) -> Flags:
    """The entries of a table that are not above their neighbours."""
    wide = np.pad(missed, ((1, 1), (0, 0), (0, 0), (0, 0), (1, 1)), constant_values=np.inf)
    least = np.isfinite(missed)
    for i in range(3):
        for k in range(3):
            least &= missed <= wide[i : i + missed.shape[0], ..., k : k + missed.shape[-1]]
    return least


SAMPLES = 512
FIRST_SAMPLES, OTHERS = 16, 32  # starts of one pose
TURN_COUNTS = 0.1  # [lengths of the arm/rad] of a turn that is missing, beside the way


class SampledStarts:
    """Starts for one arm and the tip of one tool (3,), in the frame of the flange."""

    def __init__(self, batch: SerialBatch, tip: Floats) -> None:
        self.tip, self.joints = tip, np.array(list(islice(some_joints(batch.model), SAMPLES)))
        self.poses = batch.forward(self.joints)
        self.tips = self.poses[:, :, :3] @ tip + self.poses[:, :, 3]
        self.length = np.ptp(self.tips, axis=0).max() / 2.0

    def near(self, T: Floats, after: int, count: int) -> Floats:
        """(count, n): samples that miss a pose (3, 4) least, after so many that miss it less."""
        away = np.linalg.norm(self.tips - (T[:, :3] @ self.tip + T[:, 3]), axis=1)
        cosine = 0.5 * (np.einsum("nij,ij->n", self.poses[:, :, :3], T[:, :3]) - 1.0)
        missed = away / self.length + TURN_COUNTS * np.arccos(np.clip(cosine, -1.0, 1.0))
        return np.asarray(self.joints[np.argsort(missed)[after : after + count]])
