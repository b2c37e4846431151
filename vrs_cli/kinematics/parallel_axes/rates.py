"""Joint rates of an arm whose axes are all parallel, in closed form; the bars are those of `parallel_axes.bars`.

The wrist goes as both bars turn, each at its rate: v = i (w1 bar1 + w2 bar2), as complex numbers in their plane.
"""

from __future__ import annotations

from collections.abc import Callable
from math import cos, sin
from operator import itemgetter

from vrs_cli.kinematics.jacobian import Twist
from vrs_cli.kinematics.joints import Joints
from vrs_cli.kinematics.parallel_axes.bars import Bars
from vrs_cli.kinematics.transform import IDENTITY, Transform, at_position, rotate

CLEAR = 1e-3  # of the measure of the singularity, from which on the rates are in closed form


def make_rates(bars: Bars) -> Callable[[Joints, Twist, Transform], Joints | None]:
    """[rad/s, m/s] for a twist of a tool; None next to a singular pose, and for a tip that the arm turns as it goes."""
    (l1, l2), (b1, b2), plane, flange = bars.lengths, bars.bearings, bars.T_plane_base, bars.flange
    level = at_position(plane, 0.0, 0.0, 0.0) == IDENTITY
    i1, i2, *i3 = bars.turns
    third, signs = (*i3, i2)[0], bars.signs
    s1, s2, s3, s4 = signs[i1], signs[i2], signs[third], signs[(*bars.slides, i1)[0]]
    places = dict(zip(bars.turns, range(3), strict=False)) | dict.fromkeys(bars.slides, 3)
    in_order = itemgetter(*(places[i] for i in range(len(places))))
    near = CLEAR * l1 * l2

    def rates(q: Joints, twist: Twist, T_flange_tool: Transform) -> Joints | None:
        px, py, pz = T_flange_tool[3], T_flange_tool[7], T_flange_tool[11]
        tx = bars.hand.real + (flange[0] * px + flange[1] * py + flange[2] * pz)
        ty = bars.hand.imag + (flange[4] * px + flange[5] * py + flange[6] * pz)
        a1 = s1 * q[i1]
        a2 = a1 + s2 * q[i2]
        x1, y1, x2, y2 = l1 * cos(a1 + b1), l1 * sin(a1 + b1), l2 * cos(a2 + b2), l2 * sin(a2 + b2)
        across = x1 * y2 - y1 * x2
        if -near < across < near or ((tx or ty) and not i3):
            return None
        x, y, rise, _, _, turn = twist if level else (*rotate(plane, twist[:3]), *rotate(plane, twist[3:]))
        if i3:
            a3 = a2 + s3 * q[third]
            c, s = cos(a3), sin(a3)
            x, y = x + turn * (c * ty + s * tx), y - turn * (c * tx - s * ty)
        w1 = (x * x2 + y * y2) / across
        w2 = -(x * x1 + y * y1) / across
        found: Joints = in_order((s1 * w1, s2 * (w2 - w1), s3 * (turn - w2), s4 * rise))
        return found

    return rates
