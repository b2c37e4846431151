"""Compute torques of an arm by recursive Newton-Euler; find the masses, centres of mass and inertias of its links.

The masses come from the robot's file (`RobotModel.masses`) or, for a built-in robot, from its file in `robots/masses`.
If the file has only the mass of a link, the centre of mass and the inertia of the link are computed from its shapes,
with a uniform density.

Everything is computed over N samples at once, in the base frame of the robot. The recursion is that of Luh, Walker and
Paul, "On-line computational scheme for mechanical manipulators" (1980). Units are metres, radians, kilograms, newtons;
the torque of a prismatic joint is a force.
"""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import lru_cache
from itertools import pairwise
from math import asin, hypot, pi
from pathlib import Path
from random import Random
from typing import NamedTuple

import numpy as np

from vrs_cli.errors import NotAvailable, VrsError
from vrs_cli.files.mesh_file import load_mesh, metres_of
from vrs_cli.kinematics.arrays import Floats, rotation_about_batch
from vrs_cli.kinematics.bodies import file_of_built_in, shapes_of
from vrs_cli.kinematics.joints import JointKind
from vrs_cli.kinematics.link_data import Body, Box, Capsule, Cylinder, LinkMasses, MassReader, MeshFile, Slab
from vrs_cli.kinematics.model import RobotModel, frame, link_pose
from vrs_cli.kinematics.robot_file import ROBOTS
from vrs_cli.kinematics.transform import Transform, Vector, along, any_normal, dot, unit, vector_difference

GRAVITY: Vector = (0.0, 0.0, -9.81)  # [m/s2] acceleration of gravity
AXIS_Z = np.array([0.0, 0.0, 1.0])


class InertialModel(NamedTuple):
    """Masses and drives of an arm with n joints, in the frames of the links (`model.link_frames`).

    `mass` (n,) [kg]; `centre` (n, 3) of mass [m]; `inertia` (n, 3, 3) about the centre [kg m2]. `armature` (n,): the
    inertia that the rotor of each motor adds to its joint [kg m2, kg]; `viscous` (n,) [N m s/rad, N s/m] and `coulomb`
    (n,) [N m, N] friction; `max_torque` (n,) [N m, N].
    """

    mass: Floats
    centre: Floats
    inertia: Floats
    armature: Floats
    viscous: Floats
    coulomb: Floats
    max_torque: Floats


class LinkMotion(NamedTuple):
    """The motion of a link over N samples: R (N, 3, 3) and origin (N, 3) of its frame, its angular velocity and
    acceleration, and the acceleration of the origin minus gravity, each (N, 3). `axis` (N, 3): the axis of its joint;
    `lever` (N, 3): the vector from the origin of the previous link's frame to the origin of this one."""

    slides: bool
    axis: Floats
    lever: Floats
    R: Floats
    origin: Floats
    velocity: Floats
    acceleration: Floats
    linear: Floats


def link_motions(
    model: RobotModel, q: Floats, qd: Floats, qdd: Floats, gravity: Sequence[float] = GRAVITY
) -> list[LinkMotion]:
    """Return the motion of each link for joints, velocities and accelerations of shape (N, n)."""
    n = len(q)
    R, origin = (np.broadcast_to(part, (n, *part.shape)) for part in _parts(model.base))
    w = wd = np.zeros((n, 3))
    a = np.broadcast_to(-np.array(gravity), (n, 3))
    found = []
    for i, link in enumerate(model.links):
        K, k = _parts(link_pose(model, i + 1, 0.0))
        axis, x, v, vd = R[:, :, 2], *(rows[:, i, None] for rows in (q, qd, qdd))
        if slides := link.kind is JointKind.PRISMATIC:
            lever = R @ k + axis * x
            a = a + np.cross(wd, lever) + np.cross(w, np.cross(w, lever)) + 2.0 * np.cross(w, axis) * v + axis * vd
        else:
            R = R @ rotation_about_batch(AXIS_Z, x[:, 0])
            lever = R @ k
            w, wd = w + axis * v, wd + axis * vd + np.cross(w, axis) * v
            a = a + np.cross(wd, lever) + np.cross(w, np.cross(w, lever))
        R, origin = R @ K, origin + lever
        found.append(LinkMotion(slides, axis, lever, R, origin, w, wd, a))
    return found


def torques(
    model: RobotModel,
    inertial: InertialModel,
    q: Floats,
    qd: Floats,
    qdd: Floats,
    gravity: Sequence[float] = GRAVITY,
    *,
    friction: bool = True,
) -> Floats:
    """Return the joint torques (N, n) that produce these accelerations. `friction`: include the friction of the
    joints."""
    found = inertial.armature * qdd
    if friction:
        found = found + inertial.viscous * qd + inertial.coulomb * np.sign(qd)
    motions = link_motions(model, q, qd, qdd, gravity)
    force = moment = np.zeros((len(q), 3))
    for i, link in reversed(list(enumerate(motions))):
        centre = link.R @ inertial.centre[i]
        w, wd = link.velocity, link.acceleration
        own = inertial.mass[i] * (link.linear + np.cross(wd, centre) + np.cross(w, np.cross(w, centre)))
        inertia = link.R @ inertial.inertia[i] @ link.R.transpose(0, 2, 1)
        turning = _times(inertia, wd) + np.cross(w, _times(inertia, w)) + np.cross(centre, own)
        force = force + own
        moment = moment + turning + np.cross(link.lever, force)  # moment about the origin of the previous link's frame
        found[:, i] += np.einsum("ni,ni->n", link.axis, force if link.slides else moment)
    return found


def mass_matrix(model: RobotModel, inertial: InertialModel, q: Floats) -> Floats:
    """Return the inertia matrix of the joints (N, n, n) at joints (N, n), including the rotors of the motors."""
    still = np.zeros_like(q)
    return np.stack(
        [
            torques(model, inertial, q, still, still + unit, (0.0, 0.0, 0.0), friction=False)
            for unit in np.eye(model.joint_count)
        ],
        axis=2,
    )


def _times(matrices: Floats, vectors: Floats) -> Floats:
    """Multiply matrices (N, 3, 3) by vectors (N, 3); return (N, 3)."""
    return np.asarray(np.einsum("nij,nj->ni", matrices, vectors))


def _parts(T: Transform) -> tuple[Floats, Floats]:
    """Return the rotation (3, 3) and the position (3,) of a transform."""
    rows = np.array(T).reshape(3, 4)
    return rows[:, :3], rows[:, 3]


MASSES = Path(ROBOTS, "masses")  # folder with the masses of built-in robots; read only when dynamics are computed
ROUNDING = 1e-12  # relative rounding error of a moment of inertia
MIN_MOMENT = 1e-6  # [kg m2] smaller principal moments of inertia are raised to this
POSES, SEED = 100, 1  # number and seed of random poses for drives with unknown data
RESERVE = 2.0  # ratio of an unknown maximum torque to the torque for gravity and maximum acceleration (our choice)
# chosen for unknown data: rotor inertia / maximum inertia of the joint, and friction / maximum torque of the joint
ROTOR_SHARE, VISCOUS_SHARE, COULOMB_SHARE = 0.1, 0.05, 0.02
ROUND = 24  # number of slices along half a circle; gives second moments of a slab to 1e-4


def masses_of(model: RobotModel) -> tuple[LinkMasses, ...]:
    """Return the known masses of a robot: one row for each link, or an empty tuple."""
    if model.masses or (path := file_of_built_in(model, MASSES)) is None:
        return model.masses
    return _masses_in(path, model.joint_count)


@lru_cache
def _masses_in(path: Path, joints: int) -> tuple[LinkMasses, ...]:
    return MassReader(str(path), human=True).masses(tomllib.loads(path.read_text(encoding="utf-8"))["masses"], joints)


def inertial_model(model: RobotModel) -> InertialModel:
    """Return the masses and drives of a robot. Raises NotAvailable, naming the links, if a mass is unknown."""
    known = masses_of(model) or (LinkMasses(),) * model.joint_count
    if missing := [str(i) for i, link in enumerate(known, 1) if link.mass is None]:
        links = f"link {missing[0]}" if len(missing) == 1 else f"links {', '.join(missing[:-1])} and {missing[-1]}"
        right = "write one [[masses]] table for each link into its TOML file, or <inertial> into its URDF file"
        raise NotAvailable(f"nobody says the mass of {links} of {model.title}", right)
    centres, inertias = list[Floats](), list[Floats]()
    for i, link in enumerate(known, 1):
        shaped = None if link.centre and link.inertia else solid_of_link(model, i)
        centre = np.array(link.centre) if link.centre is not None else shaped.centre if shaped else np.zeros(3)
        if link.inertia is not None:
            xx, yy, zz, xy, xz, yz = link.inertia
            inertia = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        else:
            inertia = (link.mass or 0.0) * shaped.inertia if shaped else np.zeros((3, 3))
        centres.append(centre)
        inertias.append(realizable_inertia(inertia))
    mass = np.array([link.mass for link in known], dtype=float)
    return _with_drives(model, known, mass, np.array(centres), np.array(inertias))


def realizable_inertia(inertia: Floats) -> Floats:
    """Return the nearest inertia (3, 3) that a body can have: no principal moment exceeds the sum of the other two, and
    none is below MIN_MOMENT.
    """
    moments, axes = np.linalg.eigh(inertia)
    moments = np.maximum(moments, MIN_MOMENT)
    if (excess := moments[2] - moments[0] - moments[1]) > 0.0:
        moments = moments + excess / 3.0 * np.array([1.0, 1.0, -1.0])
        moments[2] = (1.0 - ROUNDING) * (moments[0] + moments[1])
    elif np.all(np.linalg.eigvalsh(inertia) >= MIN_MOMENT):
        return inertia
    return np.asarray(axes * moments @ axes.T)


def _with_drives(
    model: RobotModel, known: Sequence[LinkMasses], mass: Floats, centre: Floats, inertia: Floats
) -> InertialModel:
    """Add the drives. Unknown data are set to fixed fractions of the arm's inertias and torques in random poses."""
    none = np.zeros(len(mass))
    bare = InertialModel(mass, centre, inertia, none, none, none, none)
    random, ranges = Random(SEED), list(zip(model.lower, model.upper, strict=True))
    q = np.array([[random.uniform(*ends) for ends in ranges] for _ in range(POSES)])
    own = np.max(np.einsum("nii->ni", mass_matrix(model, bare, q)), axis=0)
    still = np.zeros_like(q)
    holding = np.max(np.abs(torques(model, bare, q, still, still)), axis=0)

    def or_usual(values: Iterable[float | None], usual: Floats) -> Floats:
        return np.array([x if y is None else y for x, y in zip(usual.tolist(), values, strict=True)])

    gear = or_usual((link.gear for link in known), none + 1.0)
    armature = or_usual((link.rotor for link in known), ROTOR_SHARE * own / gear**2) * gear**2
    usual = RESERVE * (holding + (own + armature) * np.array(model.max_acceleration))
    max_torque = or_usual((link.max_torque for link in known), usual)
    damping = VISCOUS_SHARE * usual / np.array(model.max_velocity)
    viscous = or_usual((link.viscous for link in known), damping / gear**2) * gear**2
    coulomb = or_usual((link.coulomb for link in known), COULOMB_SHARE * usual / gear) * gear
    return bare._replace(armature=armature, viscous=viscous, coulomb=coulomb, max_torque=max_torque)


# --- inertias of shapes --------------------------------------------------------------------------------------------


Slice = Iterator[tuple[Vector, float]]  # yields points of a cross-section, each with the area that it represents [m2]


class UnitSolid(NamedTuple):
    """A body of one kilogram: its centre of mass (3,) [m], and its inertia (3, 3) about this centre [kg m2]."""

    centre: Floats
    inertia: Floats


class PointMasses(NamedTuple):
    """Points (k, 3) [m] with volumes (k,) [m3]: together they have the volume, the centre of mass and the second
    moments of a body."""

    points: Floats
    volumes: Floats


def solid_of_link(model: RobotModel, link: int) -> UnitSolid | None:
    """Return the centre of mass and the inertia of a link, computed from all its shapes as if it weighed 1 kg. The
    hand's shapes are taken in the closed position. Return None if the link has no readable shape. Volumes in which
    shapes overlap count twice."""
    parts = list[PointMasses]()
    for shape in shapes_of(model):
        if shape.link == link:
            try:
                parts.append(point_masses(shape.body))
            except VrsError:  # the link has a mesh that cannot be read
                continue
    volumes = np.concatenate([part.volumes for part in parts]) if parts else np.zeros(0)
    if not volumes.sum() > 0.0:
        return None
    points = np.concatenate([part.points for part in parts])
    shares = volumes / volumes.sum()
    centre = shares @ points
    moments = (points - centre).T @ (shares[:, None] * (points - centre))
    return UnitSolid(centre, np.trace(moments) * np.eye(3) - moments)


def point_masses(body: Body) -> PointMasses:
    """Return point masses equivalent to a body. Raises FileError, FileDamaged for a mesh that cannot be read."""
    match body:
        case Box(size, pose):
            return _move_points(
                pose, _slices((-0.5 * size[2], 0.5 * size[2]), lambda z: _rectangle(z, size[0], size[1]))
            )
        case Cylinder(start, end, (r, s)):
            far = hypot(*vector_difference(end, start))
            slices = _slices((0.0, far), lambda z: _disc(z, r + (s - r) * z / far))
            return _move_points(_along_z(start, vector_difference(end, start)), slices)
        case Capsule(start, end, radii):
            return _capsule(start, end, radii)
        case Slab():
            return _slab(body)
        case MeshFile(path, pose, scale):
            mesh = load_mesh(Path(path))
            corners = mesh.vertices[mesh.faces] * (metres_of(mesh.units) * np.array(scale))
            return _move_points(pose, _tetrahedra(corners))


def _capsule(start: Vector, end: Vector, radii: tuple[float, float]) -> PointMasses:
    """Return point masses of the convex hull of two balls: a cap of each ball, and the cone between the caps."""
    (r, s), far = radii, hypot(*vector_difference(end, start))
    if far <= abs(r - s):  # one ball contains the other, so the hull is the larger ball
        centre, r, s, far = (start, r, r, 0.0) if r >= s else (end, s, s, 0.0)
        T = _along_z(centre, (0.0, 0.0, 1.0))
    else:
        T = _along_z(start, vector_difference(end, start))
    lean = asin((r - s) / far) if far else 0.0
    # heights of the two circles at which the cone touches the balls
    low, high = r * np.sin(lean), far + s * np.sin(lean)
    r_low, r_high = r * np.cos(lean), s * np.cos(lean)
    parts = [_slices((-r, low), lambda z: _disc(z, (max(r * r - z * z, 0.0)) ** 0.5))]
    if high - low > 0.0:
        parts.append(_slices((low, high), lambda z: _disc(z, r_low + (r_high - r_low) * (z - low) / (high - low))))
    parts.append(_slices((high, far + s), lambda z: _disc(z, (max(s * s - (z - far) ** 2, 0.0)) ** 0.5)))
    return _move_points(T, PointMasses(*(np.concatenate(columns) for columns in zip(*parts, strict=True))))


def _slab(body: Slab) -> PointMasses:
    """Return point masses of the convex hull of two discs. Each slice perpendicular to its length is a rectangle, whose
    thickness changes linearly from one end to the other."""
    way, (r1, r2), (t1, t2) = vector_difference(body.end, body.start), body.radii, body.thickness
    far, x = hypot(*way), unit(way)
    z = unit(along(body.across, x, -dot(body.across, x)))
    lean = asin((r1 - r2) / far)
    ends = -r1, r1 * np.sin(lean), far + r2 * np.sin(lean), far + r2

    def half_width(u: float) -> float:
        if u < ends[1]:
            return float(max(r1 * r1 - u * u, 0.0) ** 0.5)
        if u > ends[2]:
            return float(max(r2 * r2 - (u - far) ** 2, 0.0) ** 0.5)
        return float((r1 + (r2 - r1) * u / far) / np.cos(lean) if r1 != r2 else r1)

    def across(u: float) -> Slice:
        return _rectangle(u, 2.0 * half_width(u), t1 + (t2 - t1) * (u + r1) / (far + r1 + r2))

    parts = [_slices((a, b), across, ROUND) for a, b in pairwise(ends)]
    points, volumes = (np.concatenate(columns) for columns in zip(*parts, strict=True))
    return _move_points(frame(x, z, body.start), PointMasses(points[:, [2, 0, 1]], volumes))


def _slices(ends: tuple[float, float], slice_at: Callable[[float], Slice], count: int = 4) -> PointMasses:
    """Return point masses of slices at Gauss-Legendre nodes. The result is exact for integrands up to the 7th degree in
    z."""
    low, high = ends
    places, weights = (0.5 * (high - low) * row for row in np.polynomial.legendre.leggauss(count))
    rows = [
        (point, area * weight)
        for z, weight in zip(0.5 * (low + high) + places, weights, strict=True)
        for point, area in slice_at(float(z))
    ]
    return PointMasses(np.array([point for point, _ in rows]), np.array([volume for _, volume in rows]))


def _disc(z: float, radius: float) -> Slice:
    """Yield four points that have the area and the second moments of a disc."""
    far, area = radius / 2**0.5, pi * radius * radius / 4.0
    for x, y in ((far, 0.0), (-far, 0.0), (0.0, far), (0.0, -far)):
        yield (x, y, z), area


def _rectangle(z: float, width: float, depth: float) -> Slice:
    x, y = width / 12**0.5, depth / 12**0.5
    for corner in ((x, y), (-x, y), (x, -y), (-x, -y)):
        yield (*corner, z), width * depth / 4.0


def _tetrahedra(corners: Floats) -> PointMasses:
    """Return point masses of the tetrahedra between the origin and each triangle (k, 3, 3)."""
    volumes = np.einsum("ni,ni->n", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6.0
    centres = corners.sum(axis=1) / 4.0
    points = np.concatenate([*corners.transpose(1, 0, 2), np.zeros_like(centres), centres])
    return PointMasses(points, np.concatenate([volumes / 20.0] * 4 + [volumes * 0.8]))


def _along_z(place: Vector, way: Vector) -> Transform:
    z = unit(way)
    return frame(any_normal(z), z, place)


def _move_points(T: Transform, solid: PointMasses) -> PointMasses:
    rows = np.array(T).reshape(3, 4)
    return PointMasses(solid.points @ rows[:, :3].T + rows[:, 3], solid.volumes)
