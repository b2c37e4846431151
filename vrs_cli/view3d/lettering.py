"""Numbers that lie on the floor: strokes as flat triangles that face up."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise
from math import hypot

import numpy as np

from vrs_cli.view3d.meshes import Mesh, joined

# lines through points (x, y) of a field 4 wide and 6 high
GLYPHS: Mapping[str, tuple[tuple[tuple[float, float], ...], ...]] = {
    "0": (((1, 0), (3, 0), (4, 1), (4, 5), (3, 6), (1, 6), (0, 5), (0, 1), (1, 0)),),
    "1": (((0.5, 4.5), (2, 6), (2, 0)), ((0.5, 0), (3.5, 0))),
    "2": (((0, 5), (1, 6), (3, 6), (4, 5), (4, 4), (0, 0), (4, 0)),),
    "3": (((0, 6), (4, 6), (2, 3.5), (3, 3.5), (4, 2.5), (4, 1), (3, 0), (1, 0), (0, 1)),),
    "4": (((3, 0), (3, 6), (0, 2), (4, 2)),),
    "5": (((4, 6), (0, 6), (0, 3.5), (3, 3.5), (4, 2.5), (4, 1), (3, 0), (1, 0), (0, 1)),),
    "6": (((3.5, 6), (1.5, 6), (0, 4), (0, 1), (1, 0), (3, 0), (4, 1), (4, 2.5), (3, 3.5), (0, 3.5)),),
    "7": (((0, 6), (4, 6), (1.5, 0)),),
    "8": (
        ((1, 3.2), (0, 4.2), (0, 5), (1, 6), (3, 6), (4, 5), (4, 4.2), (3, 3.2), (1, 3.2)),
        ((1, 3.2), (0, 2.2), (0, 1), (1, 0), (3, 0), (4, 1), (4, 2.2), (3, 3.2)),
    ),
    "9": (((0.5, 0), (2.5, 0), (4, 2), (4, 5), (3, 6), (1, 6), (0, 5), (0, 3.5), (1, 2.5), (4, 2.5)),),
    "-": (((0.5, 3), (3.5, 3)),),
    "X": (((0, 0), (4, 6)), ((0, 6), (4, 0))),
    "Y": (((0, 6), (2, 3), (4, 6)), ((2, 3), (2, 0))),
    "m": (((0, 0), (0, 4), (1.2, 4), (2, 3.2), (2, 0)), ((2, 3.2), (2.8, 4), (3.2, 4), (4, 3.2), (4, 0))),
    " ": (),
}
ADVANCE, WIDTH, HEIGHT = 5.6, 4.0, 6.0
STROKE = 0.62  # how thick a line is


def lettered(text: str, height: float) -> Mesh:
    """A text about the origin in the plane z = 0, of such a height [m]; it runs along y, its foot to x."""
    strokes = [
        _stroke((x + ADVANCE * k, y), (u + ADVANCE * k, v))
        for k, letter in enumerate(text)
        for line in GLYPHS[letter]
        for (x, y), (u, v) in pairwise(line)
    ]
    mesh = joined(strokes)
    middle = np.array([0.5 * (ADVANCE * (len(text) - 1) + WIDTH), 0.5 * HEIGHT, 0.0])
    points = (mesh.vertices - middle) * (height / HEIGHT)
    return Mesh(np.stack([-points[:, 1], points[:, 0], points[:, 2]], axis=1), mesh.faces)


def _stroke(start: tuple[float, float], end: tuple[float, float]) -> Mesh:
    """A line of some thickness, a little longer than from end to end, so that corners are filled."""
    (x, y), (u, v) = start, end
    half = 0.5 * STROKE / hypot(u - x, v - y)
    a, b = half * (u - x), half * (v - y)
    corners = [(x - a + b, y - b - a), (u + a + b, v + b - a), (u + a - b, v + b + a), (x - a - b, y - b + a)]
    faces = np.array([(0, 1, 2), (0, 2, 3)], dtype=np.uint32)
    return Mesh(np.array([(*corner, 0.0) for corner in corners]), faces)
