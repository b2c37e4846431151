"""Convex solids: the distance between two, their widths, and the height from which one falls onto another. The distance
is found by the method of Gilbert, Johnson and Keerthi (A fast procedure for computing the distance between complex
objects, IEEE J. Robotics and Automation 4, 1988). It equals the distance of the origin from the Minkowski difference of
the solids, which is searched with simplexes of at most four points. All lengths are in metres."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import hypot, inf, sqrt
from typing import NamedTuple

from vrs_cli.kinematics.transform import (
    IDENTITY,
    Transform,
    Vector,
    compose,
    cross,
    dot,
    inverse,
    moved_point,
    rotated_back,
    scaled_vector,
    vector_difference,
)
from vrs_cli.values.scene import Beam, BoxShape, CylinderShape, MeshShape, Proximity, Shape, SphereShape, Zone

MAX_STEPS = 64  # maximum number of search steps: smooth solids take about twenty, others about five
CLOSE = 1e-12  # [m] tolerance at which a search ends
NOTHING = 1e-11  # [m] maximum distance of solids that count as touching
EDGE = 1e-4  # [m] solids that overlap less than this, seen from above, count as side by side

Support = Callable[[Vector], Vector]


class Solid(NamedTuple):
    """A convex solid in its own frame: all points within `radius` of a core. `support` returns the point of the core
    that is farthest along a direction. `middle`: a point of the core. `reach`: the maximum distance from the middle to
    a point of the solid. `depth`: the radius of a ball around the middle that lies inside the solid."""

    support: Support
    radius: float
    middle: Vector
    reach: float
    depth: float


Solids = tuple[Solid, ...]  # the solids that make up one body, in its frame


def solids_of(shape: Shape | Beam | Zone | Proximity) -> Solids:
    """Return the solids of a shape in its frame. For the region of a sensor, this is the frame that `frame_of`
    returns."""
    match shape:
        case BoxShape() | Zone():
            x, y, z = (0.5 * side for side in shape.size)
            return (Solid(_box(x, y, z), 0.0, _ORIGIN, hypot(x, y, z), min(x, y, z)),)
        case CylinderShape():
            r, h = shape.radius, 0.5 * shape.height
            return (Solid(_cylinder(r, h), 0.0, _ORIGIN, hypot(r, h), min(r, h)),)
        case SphereShape():
            return (Solid(lambda _: _ORIGIN, shape.radius, _ORIGIN, shape.radius, shape.radius),)
        case MeshShape():
            return tuple(map(_piece, shape.pieces))
        case Beam():
            return (_rod(shape.begin, shape.end, shape.radius),)
        case Proximity():
            x, y, z = (a + shape.range * b for a, b in zip(shape.place, shape.direction, strict=True))
            return (_rod(shape.place, (x, y, z), shape.radius),)


_ORIGIN: Vector = (0.0, 0.0, 0.0)


def _box(x: float, y: float, z: float) -> Support:
    def support(d: Vector) -> Vector:
        return (x if d[0] > 0.0 else -x, y if d[1] > 0.0 else -y, z if d[2] > 0.0 else -z)

    return support


def _cylinder(r: float, h: float) -> Support:
    def support(d: Vector) -> Vector:
        across = sqrt(d[0] * d[0] + d[1] * d[1])
        z = h if d[2] > 0.0 else -h
        return (r * d[0] / across, r * d[1] / across, z) if across > 0.0 else (0.0, 0.0, z)

    return support


def _rod(begin: Vector, end: Vector, radius: float) -> Solid:
    """Return a cylinder with round ends."""
    x, y, z = vector_difference(end, begin)
    middle = (begin[0] + 0.5 * x, begin[1] + 0.5 * y, begin[2] + 0.5 * z)

    def support(d: Vector) -> Vector:
        return end if d[0] * x + d[1] * y + d[2] * z > 0.0 else begin

    return Solid(support, radius, middle, 0.5 * hypot(x, y, z) + radius, radius)


def _piece(points: Sequence[Vector]) -> Solid:
    count = len(points)
    middle = (sum(p[0] for p in points) / count, sum(p[1] for p in points) / count, sum(p[2] for p in points) / count)
    reach = max(hypot(*vector_difference(point, middle)) for point in points)

    def support(d: Vector) -> Vector:
        x, y, z = d
        return max(points, key=lambda p: p[0] * x + p[1] * y + p[2] * z)

    return Solid(support, 0.0, middle, reach, 0.0)


# --- distance --------------------------------------------------------------------------------------------------------


class Separation(NamedTuple):
    """The distance between two solids [m], 0 or less if they touch. `toward`: the unit vector from the first solid to
    the second, in the frame of the second; (0, 0, 0) if they touch."""

    distance: float
    toward: Vector


def separation(a: Solid, T_b_a: Transform, b: Solid) -> Separation:
    """Return the separation of two solids a and b. `T_b_a` is the pose of a in the frame of b. If only the rims overlap
    (the cores, without `radius`, are apart), the distance is negative and exact."""
    rims = a.radius + b.radius
    v = vector_difference(b.middle, moved_point(T_b_a, a.middle))  # a vector from solid a to solid b
    if not any(v):
        v = (1e-9, 0.0, 0.0)
    simplex: list[Vector] = []
    gap, best = inf, -inf
    for _ in range(MAX_STEPS):
        far_a = moved_point(T_b_a, a.support(rotated_back(T_b_a, v)))
        w = vector_difference(b.support((-v[0], -v[1], -v[2])), far_a)
        size = sqrt(dot(v, v))
        best = max(best, dot(v, w) / size)
        if gap < inf and (gap - best <= CLOSE or w in simplex):
            break
        simplex.append(w)
        nearer, simplex = _nearest(simplex)
        closer = sqrt(dot(nearer, nearer))
        if closer >= gap or (best > NOTHING and (closer < best - NOTHING or len(simplex) == 4)):
            break  # the rest is rounding error: a plane that separates the solids was found
        if closer < NOTHING or len(simplex) == 4:
            return Separation(-rims, _ORIGIN)
        v, gap = nearer, closer
    size = sqrt(dot(v, v))
    return Separation(size - rims, scaled_vector(v, 1.0 / size))


def _nearest(simplex: list[Vector]) -> tuple[Vector, list[Vector]]:
    """Return the point of a simplex that is nearest to the origin, and the corners of the vertex, edge or face that
    contains it."""
    match simplex:
        case [a]:
            return a, simplex
        case [a, b]:
            return _on_edge(a, b)
        case [a, b, c]:
            return _on_face(a, b, c)
    a, b, c, d = simplex
    faces = ((a, b, c, d), (a, b, d, c), (a, c, d, b), (b, c, d, a))
    outside = [face[:3] for face in faces if not _same_side(*face)]
    if not outside:
        return _ORIGIN, simplex
    return min((_on_face(*face) for face in outside), key=lambda found: dot(found[0], found[0]))


def _same_side(a: Vector, b: Vector, c: Vector, d: Vector) -> bool:
    """Return whether the origin and d are on the same side of the plane through a, b and c; False if all four points
    are in one plane."""
    normal = cross(vector_difference(b, a), vector_difference(c, a))
    return dot(normal, a) * dot(normal, vector_difference(a, d)) > 0.0


def _on_edge(a: Vector, b: Vector) -> tuple[Vector, list[Vector]]:
    ab = vector_difference(b, a)
    t = -dot(a, ab)
    if t <= 0.0:
        return a, [a]
    length = dot(ab, ab)
    if t >= length:
        return b, [b]
    t /= length
    return (a[0] + t * ab[0], a[1] + t * ab[1], a[2] + t * ab[2]), [a, b]


def _on_face(a: Vector, b: Vector, c: Vector) -> tuple[Vector, list[Vector]]:
    """Return the point of a triangle that is nearest to the origin, and the corners of the vertex, edge or face that
    contains it (Ericson, Real-Time Collision Detection, 5.1.5)."""
    ab, ac = vector_difference(b, a), vector_difference(c, a)
    d1, d2 = -dot(ab, a), -dot(ac, a)
    if d1 <= 0.0 and d2 <= 0.0:
        return a, [a]
    d3, d4 = -dot(ab, b), -dot(ac, b)
    if d3 >= 0.0 and d4 <= d3:
        return b, [b]
    d5, d6 = -dot(ab, c), -dot(ac, c)
    if d6 >= 0.0 and d5 <= d6:
        return c, [c]
    vc, vb, va = d1 * d4 - d3 * d2, d5 * d2 - d1 * d6, d3 * d6 - d5 * d4
    if vc <= 0.0 and d1 >= 0.0 and d3 <= 0.0:
        return _on_edge(a, b)
    if vb <= 0.0 and d2 >= 0.0 and d6 <= 0.0:
        return _on_edge(a, c)
    if va <= 0.0 and d4 - d3 >= 0.0 and d5 - d6 >= 0.0:
        return _on_edge(b, c)
    normal = cross(ab, ac)  # project onto the plane, which is more exact than a weighted sum of the corners
    square = dot(normal, normal)
    if not square > 0.0:
        return min((_on_edge(a, b), _on_edge(a, c), _on_edge(b, c)), key=lambda found: dot(found[0], found[0]))
    return scaled_vector(normal, dot(a, normal) / square), [a, b, c]


# --- bodies in the world ---------------------------------------------------------------------------------------------

Bounds = tuple[float, float, float, float, float, float]  # [m] minimum and maximum x, y and z, in this order


def bounds(solids: Solids, T: Transform) -> Bounds:
    """Return the bounding box of a body at T_world_body, along the axes of the world."""
    (x, X), (y, Y), (z, Z) = (spread(solids, T, axis) for axis in _AXES)
    return (x, X, y, Y, z, Z)


_AXES: tuple[Vector, ...] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


def _span(solid: Solid, T: Transform, axis: Vector) -> tuple[float, float]:
    """Return the smallest and the largest coordinate of a solid at T along an axis of the world [m]."""
    d = rotated_back(T, axis)
    high = dot(axis, moved_point(T, solid.support(d))) + solid.radius
    low = dot(axis, moved_point(T, solid.support(scaled_vector(d, -1.0)))) - solid.radius
    return low, high


def spread(solids: Solids, T: Transform, axis: Vector) -> tuple[float, float]:
    """Return the smallest and the largest coordinate of a body at T along a unit vector of the world [m]."""
    spans = [_span(solid, T, axis) for solid in solids]
    return min(low for low, _ in spans), max(high for _, high in spans)


def overlap(a: Bounds, b: Bounds, margin: float = 0.0) -> bool:
    return (
        a[0] <= b[1] + margin
        and b[0] <= a[1] + margin
        and a[2] <= b[3] + margin
        and b[2] <= a[3] + margin
        and a[4] <= b[5] + margin
        and b[4] <= a[5] + margin
    )


def frame_of(region: Beam | Zone | Proximity) -> Transform:
    """Return T_world_region: the frame in which `solids_of` describes the region of a sensor."""
    return region.T_world_zone if isinstance(region, Zone) else IDENTITY


def point_apart(solids: Solids, T: Transform, point: Vector) -> float:
    """Return the distance between a point of the world and a body at T [m]; 0 inside the body."""
    T_body_point = compose(inverse(T), IDENTITY._replace(px=point[0], py=point[1], pz=point[2]))
    return max(0.0, min(separation(_POINT, T_body_point, solid).distance for solid in solids))


_POINT = Solid(lambda _: _ORIGIN, 0.0, _ORIGIN, 0.0, 0.0)


def point_drop(point: Vector, b: Solids, T_world_b: Transform) -> float:
    """Return how far a point must be lowered to meet a body [m]: negative if it must be raised, infinite if it never
    meets the body."""
    T = IDENTITY._replace(px=point[0], py=point[1], pz=point[2])
    return min(_lower_onto(_POINT, T, other, T_world_b) for other in b)


def drop(a: Solids, T_world_a: Transform, b: Solids, T_world_b: Transform) -> float:
    """Return how far body a must be lowered to rest on body b [m]: negative if it must be raised, infinite if it passes
    b or only grazes it."""
    return min(_drop(one, T_world_a, other, T_world_b) for one in a for other in b)


def overlap_by(a: Solids, T_world_a: Transform, b: Solids, T_world_b: Transform, by: float) -> bool:
    """Return whether body a overlaps body b by more than a length [m], that is, whether a still overlaps b after
    shrinking by that length."""
    T_b_a = compose(inverse(T_world_b), T_world_a)
    smaller = [one._replace(support=_shrunk(one, by), radius=max(one.radius - by, 0.0)) for one in a]
    return any(separation(one, T_b_a, other).distance <= 0.0 for one in smaller for other in b)


def _drop(a: Solid, T_world_a: Transform, b: Solid, T_world_b: Transform) -> float:
    thinner = a._replace(support=_shrunk(a, EDGE))  # shrink a, so that it does not count as resting on a body beside it
    misses = _lower_onto(thinner, T_world_a, b, T_world_b) == inf
    return inf if misses else _lower_onto(a, T_world_a, b, T_world_b)


def _shrunk(solid: Solid, by: float) -> Support:
    """Return the support function of a solid whose core is shrunk towards its middle: its farthest points move in by a
    length [m]."""
    factor = 1.0 - min(0.5, by / solid.reach)
    mx, my, mz = solid.middle

    def support(d: Vector) -> Vector:
        x, y, z = solid.support(d)
        return (mx + factor * (x - mx), my + factor * (y - my), mz + factor * (z - mz))

    return support


def _lower_onto(a: Solid, T_world_a: Transform, b: Solid, T_world_b: Transform) -> float:
    """Return how far solid a must be lowered to touch solid b [m], by conservative advancement: each step is the
    longest that cannot pass the first contact."""
    low, top = _span(a, T_world_a, _AXES[2])[0], _span(b, T_world_b, _AXES[2])[1]
    raised = max(0.0, top - low) + 1e-3
    T_b_a = compose(inverse(T_world_b), T_world_a._replace(pz=T_world_a.pz + raised))
    down, way = rotated_back(T_world_b, (0.0, 0.0, -1.0)), 0.0
    limit = 2.0 * (a.reach + b.reach) + 2.0 * raised + abs(low - top)
    for _ in range(MAX_STEPS):
        found = separation(a, T_b_a, b)
        if found.distance < 1e-10:
            break
        closing = dot(found.toward, down)
        if closing <= 1e-9 or way > limit:
            return inf
        step = found.distance / closing
        way += step
        T_b_a = T_b_a._replace(px=T_b_a.px + step * down[0], py=T_b_a.py + step * down[1], pz=T_b_a.pz + step * down[2])
    return way - raised
