"""Compute the outermost positions that the tip of a tool reaches, and a cross section of the reach of an arm whose
joint 1 turns.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.forms import arm_for
from vrs_cli.kinematics.joints import Configuration
from vrs_cli.kinematics.model import RobotModel
from vrs_cli.kinematics.transform import TURN, Vector, inverse

POSES = 40_000  # number of random sample poses for the cross section
# samples are drawn from ranges extended by this fraction and then clipped, so that many are at the ends of ranges
BEYOND = 0.12
CELLS = 44  # number of grid cells across the larger dimension of the reach
LEVEL = 0.5  # the contour is drawn where this fraction of a cell and its neighbours is reached
FLAT = 1e-3  # [m] if the reach is less high than this, the arm counts as moving in a plane

Grid = NDArray[np.float64]  # (R, H): rows by distance from the first axis, columns by height
Points = NDArray[np.float64]  # (N, 3) [m]
Sections = NDArray[np.float64]  # (S, 2, 3): line segments; each end has distance, height and angle about the first axis


# number of directions searched in each plane; with 64, the outline of a circle is at most 0.12 % too small
DIRECTIONS = 64
# number of random poses in the first round; number of variations of each direction's best pose in each later round
FIRST_POSES, TRIES = 3_000, 10
# number of rounds; spread of the first variations (fraction of a range), and its factor after each round
ROUNDS, SPREAD, NARROWER = 32, 0.6, 0.77
CHANGED = 0.4  # probability that a variation changes a given joint


@lru_cache(maxsize=8)
def outermost(model: RobotModel, p_flange_tip: Vector) -> tuple[Vector, ...]:
    """Return the outermost points that a tool tip reaches, in the robot's frame [m]. Seen from above and from the side,
    their convex outlines are those of the whole reach.

    The search is random: each round picks, from all poses of the previous round, the pose that reaches farthest in each
    direction, and varies it.
    """
    arm, random = arm_for(model), np.random.default_rng(1)
    lower, upper = np.array(model.lower), np.array(model.upper)
    angles = np.linspace(0.0, TURN, DIRECTIONS, endpoint=False)
    c, s, zeros = np.cos(angles), np.sin(angles), np.zeros(DIRECTIONS)
    # only two planes, because numpy would use many threads for larger products
    ways = np.array([[c, s, zeros], [c, zeros, s]])
    q = random.uniform(lower, upper, (FIRST_POSES, len(lower)))
    for k in range(ROUNDS + 1):
        T = arm.batch.forward(q)
        points: Points = T[:, :, :3] @ np.array(p_flange_tip) + T[:, :, 3]
        best = (points @ ways).argmax(axis=1).ravel()
        size = (TRIES, len(best), len(lower))
        steps = random.standard_normal(size) * (random.random(size) < CHANGED) * SPREAD * NARROWER**k
        tries = np.clip(q[best] + steps * (upper - lower), lower, upper)
        q = np.concatenate((q[best], tries.reshape(-1, len(lower))))
    return tuple(dict.fromkeys(map(tuple, points[best].tolist())))


def lines_of(sections: Sections) -> list[tuple[Vector, ...]]:
    """Join line segments at their common ends to lines of points. The segments may be in any order and direction."""
    ends: dict[Vector, list[int]] = {}
    pieces: list[tuple[Vector, Vector]] = [(tuple(a), tuple(b)) for a, b in sections.round(9).tolist()]
    for k, piece in enumerate(pieces):
        for point in piece:
            ends.setdefault(point, []).append(k)
    left, lines = dict.fromkeys(range(len(pieces))), list[tuple[Vector, ...]]()
    while left:
        lone = (k for k in left if any(len(ends[point]) == 1 for point in pieces[k]))
        k = next(lone, next(iter(left)))
        a, b = pieces[k]
        line = [b, a] if len(ends[b]) == 1 else [a, b]
        del left[k]
        while (k := next((one for one in ends[line[-1]] if one in left), -1)) >= 0:
            del left[k]
            a, b = pieces[k]
            line.append(b if a == line[-1] else a)
        lines.append(tuple(line))
    return lines


def outline(arm: RobotArm, configuration: Configuration, tip: Vector) -> Sections:
    """Return the boundary of the positions that a tool tip reaches in one configuration while joint 1 is 0, as line
    segments in cylindrical coordinates about axis 1. `tip`: the tip in the frame of the flange [m].
    """
    # compute sample positions of the tip (N, 3) in frame 0 while joint 1 is 0
    model = arm.model
    lower, upper = np.array(model.lower), np.array(model.upper)
    parts = np.random.default_rng(1).random((POSES, model.joint_count)) * (1.0 + 2.0 * BEYOND) - BEYOND
    q = lower + np.clip(parts, 0.0, 1.0) * (upper - lower)
    q[:, 0] = 0.0
    if len(arm.ways) > 1:
        q = q[[arm.configuration(tuple(row)) == configuration for row in q.tolist()]]
    T = arm.batch.forward(q)
    back = np.array(inverse(model.base)).reshape(3, 4)
    points: Points = T[:, :, :3] @ np.array(tip) + T[:, :, 3]
    seen: Points = points @ back[:, :3].T + back[:, 3]
    x, y, z = seen.T
    far, angle = np.hypot(x, y), np.arctan2(y, x)
    if not len(far):
        return np.zeros((0, 2, 3))
    return _line(far, z, angle) if np.ptp(z) < FLAT else _contour(far, z, angle)


def _line(far: Grid, z: Grid, angle: Grid) -> Sections:
    """Return the reach of an arm that moves in a plane: a line from the nearest to the farthest distance from axis 1,
    at the mean angle of the samples at each distance.
    """
    edges = np.linspace(far.min(), far.max(), CELLS + 1)
    cell = np.clip(np.digitize(far, edges) - 1, 0, CELLS - 1)
    sums = np.array([np.bincount(cell, weights, CELLS) for weights in (np.cos(angle), np.sin(angle))])
    turned = np.arctan2(sums[1], sums[0])
    points = np.column_stack([edges, np.full(CELLS + 1, z.mean()), np.append(turned, turned[-1])])
    return np.stack([points[:-1], points[1:]], axis=1)


def _contour(far: Grid, z: Grid, angle: Grid) -> Sections:
    """Return the contour of the sample positions on a grid of cells: the lines where the reached fraction, averaged
    over neighbouring cells, is LEVEL (marching squares).
    """
    size = max(float(far.max()), float(np.ptp(z))) / CELLS
    low = float(z.min()) - 3.0 * size
    shape = int(far.max() / size) + 4, int(np.ptp(z) / size) + 7
    at = (far / size).astype(np.intp), ((z - low) / size).astype(np.intp)
    cells = at[0] * shape[1] + at[1]
    count, c, s = (
        np.bincount(cells, weights, shape[0] * shape[1]).reshape(shape).astype(float)
        for weights in (np.ones_like(far), np.cos(angle), np.sin(angle))
    )
    hit = count > 0.0
    # fill cells that samples missed by chance: add all neighbours of reached cells, then remove the outermost layer
    for combined in (np.logical_or, np.logical_and):
        for axis in (0, 1):
            hit = combined.reduce(tuple(_shift(hit, axis)))
    pieces = _march_squares(_blur(hit.astype(float)))
    nearest = np.clip(np.rint(pieces).astype(np.intp), 0, np.array(shape) - 1)
    turned = np.arctan2(_blur(s), _blur(c))[nearest[..., 0], nearest[..., 1]]
    middles = size * (pieces + 0.5)
    return np.stack([middles[..., 0], low + middles[..., 1], turned], axis=2)


def _blur(grid: Grid) -> Grid:
    """Return the weighted mean of each cell and its neighbours."""
    for axis in (0, 1):
        first, middle, last = _shift(grid, axis)
        grid = 0.25 * first + 0.5 * middle + 0.25 * last
    return grid


def _shift(grid: Any, axis: int) -> Iterator[Any]:
    """Yield the grid shifted along an axis by one cell back, not shifted, and shifted by one cell ahead; cells at the
    edges are repeated.
    """
    wide = np.pad(grid, [(1, 1) if k == axis else (0, 0) for k in (0, 1)], mode="edge")
    return (np.take(wide, range(k, k + grid.shape[axis]), axis) for k in (0, 1, 2))


def _march_squares(grid: Grid) -> NDArray[np.float64]:
    """Return the lines along which the values of a grid are LEVEL, as segments (S, 2, 2) in units of cells, at most one
    for each half of a square.
    """
    found = []
    for corners in (((0, 0), (1, 0), (0, 1)), ((1, 1), (0, 1), (1, 0))):
        n, m = grid.shape[0] - 1, grid.shape[1] - 1
        values = np.stack([grid[i : i + n, j : j + m] for i, j in corners])
        inside = values > LEVEL
        for one in range(3):  # `one` is the corner of the triangle whose value is alone on its side of LEVEL
            others = [k for k in range(3) if k != one]
            cut = np.argwhere((inside[one] != inside[others[0]]) & (inside[one] != inside[others[1]]))
            rows, columns = cut.T
            ends = []
            for other in others:
                a, b = values[one, rows, columns], values[other, rows, columns]
                part = ((LEVEL - a) / (b - a))[:, None]
                ends.append(cut + np.array(corners[one]) * (1.0 - part) + np.array(corners[other]) * part)
            found.append(np.stack(ends, axis=1))
    return np.concatenate(found)
