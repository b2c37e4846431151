"""What a robot looks like, as values: bodies, each fixed in the frame of one link. Data, never code.

Link 0 is the base, link i is what joint i moves; its frame is `model.link_frames(model, q)[i]`. Metres and radians.
"""

from __future__ import annotations

from collections.abc import Iterable
from functools import reduce
from math import hypot
from typing import NamedTuple

from vrs_cli.kinematics.transform import IDENTITY, Transform, Vector, compose, rotation_about, scaled, translation

MOST_SHAPES = 1000  # of a robot
BEVEL = 0.06  # of the smallest size of a body: how far its edges are broken


class Box(NamedTuple):
    """A box about the origin of `pose`."""

    size: Vector
    pose: Transform = IDENTITY


class Cylinder(NamedTuple):
    """A cylinder between the middles of its ends, or a cone where its two radii differ."""

    start: Vector
    end: Vector
    radii: tuple[float, float]


class Capsule(NamedTuple):
    """The hull of two balls; one ball where both are in one place."""

    start: Vector
    end: Vector
    radii: tuple[float, float]


class Slab(NamedTuple):
    """The hull of two discs, square to `across`, each with its radius; the thickness tapers from end to end."""

    start: Vector
    end: Vector
    across: Vector
    radii: tuple[float, float]
    thickness: tuple[float, float]


class MeshFile(NamedTuple):
    """Triangles in a file (STL, OBJ, DAE), which may be missing where the robot is looked at."""

    path: str
    pose: Transform = IDENTITY
    scale: Vector = (1.0, 1.0, 1.0)


Body = Box | Cylinder | Capsule | Slab | MeshFile


class Opening(NamedTuple):
    """How a part moves while the hand goes from closed to open, in the frame of its link: it slides, and turns about
    a line through `point` [rad], as far as these vectors are long."""

    slide: Vector = (0.0, 0.0, 0.0)
    turn: Vector = (0.0, 0.0, 0.0)
    point: Vector = (0.0, 0.0, 0.0)

    def at(self, hand: float) -> Transform:
        """The motion so far, of a hand that is open (1), closed (0) or between."""
        x, y, z = self.turn
        if not any(self.turn):
            return translation(*scaled(self.slide, hand))
        turned = rotation_about(self.turn, hand * hypot(x, y, z))
        about = compose(compose(translation(*self.point), turned), translation(*scaled(self.point, -1.0)))
        return compose(translation(*scaled(self.slide, hand)), about)


class LinkShape(NamedTuple):
    """A body of a link.

    `opens`: of a part of the hand, what the joints between the link and it do, the first one first, as seen while the
    hand is closed; none of all others.
    """

    link: int
    body: Body
    colour: str = "cream"
    opens: tuple[Opening, ...] = ()


def opened(openings: Iterable[Opening], hand: float) -> Transform:
    """How far a part of a hand has moved that is open (1), closed (0) or between, in the frame of its link."""
    return reduce(compose, (opening.at(hand) for opening in openings), IDENTITY)


COLOURS = {
    "cream": (240, 232, 212),
    "white": (240, 241, 243),
    "grey": (176, 181, 188),
    "dark": (62, 67, 74),
    "steel": (146, 152, 160),
    "orange": (226, 122, 42),
    "blue": (84, 134, 190),
    "red": (190, 62, 54),
    "yellow": (236, 190, 60),
    "green": (92, 150, 96),
}


def rgb(colour: str) -> tuple[int, int, int]:
    """Of a name in COLOURS, or of #rrggbb."""
    if colour in COLOURS:
        return COLOURS[colour]
    return int(colour[1:3], 16), int(colour[3:5], 16), int(colour[5:7], 16)
