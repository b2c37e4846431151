"""The masses, centres and inertias of a robot's links, and what its drives do.

What a robot's file says of its masses goes first (`RobotModel.masses`, of a built-in robot the file in
`robots/masses`). Where it gives only the mass of a link, centre and inertia are those of its shapes, as if they were of
one material. Every inertia is that of some body: of its three moments none is greater than the other two together.
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
from vrs_cli.kinematics.arrays import Floats
from vrs_cli.kinematics.axes import frame
from vrs_cli.kinematics.bodies import file_of_built_in, shapes_of
from vrs_cli.kinematics.masses import LinkMasses, MassReader
from vrs_cli.kinematics.model import RobotModel
from vrs_cli.kinematics.robot_file import ROBOTS
from vrs_cli.kinematics.shapes import Body, Box, Capsule, Cylinder, MeshFile, Slab
from vrs_cli.kinematics.transform import Transform, Vector, along, any_normal, dot, subtracted, unit
from vrs_cli.twin.dynamics import InertialModel, mass_matrix, torques

MASSES = ROBOTS / "masses"  # of the built-in robots: files of their own, for who runs a program reads none
ROUNDING = 1e-12  # of a moment of inertia
LEAST = 1e-6  # [kg m2] a moment of inertia
POSES, SEED = 100, 1  # random ones, for what nobody says of a drive
RESERVE = 2.0  # ours: how many times the torque that gravity and the greatest acceleration ask for a drive has
ROTOR_SHARE, VISCOUS_SHARE, COULOMB_SHARE = 0.1, 0.05, 0.02  # ours: of the greatest inertia, and of RESERVE torques
ROUND = 24  # places of slices along half a circle: second moments of a slab to 1e-4


def masses_of(model: RobotModel) -> tuple[LinkMasses, ...]:
    """Return what is known of the masses of a robot: of each link, or nothing at all."""
    if model.masses or (path := file_of_built_in(model, MASSES)) is None:
        return model.masses
    return _masses_in(path, model.joint_count)


@lru_cache
def _masses_in(path: Path, joints: int) -> tuple[LinkMasses, ...]:
    data = tomllib.loads(path.read_text(encoding="utf-8"))
    return MassReader(str(path), human=True).masses(data["masses"], joints)


def inertial_model(model: RobotModel) -> InertialModel:
    """Return the masses and drives of a robot. Raises NotAvailable with the links of which nobody says the mass."""
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
        inertias.append(balanced(inertia))
    mass = np.array([link.mass for link in known], dtype=float)
    return _with_drives(model, known, mass, np.array(centres), np.array(inertias))


def balanced(inertia: Floats) -> Floats:
    """Return the nearest inertia (3, 3) that a body can have: of its three moments none is greater than the other two
    together, and none is less than LEAST.
    """
    moments, axes = np.linalg.eigh(inertia)
    moments = np.maximum(moments, LEAST)
    if (excess := moments[2] - moments[0] - moments[1]) > 0.0:
        moments = moments + excess / 3.0 * np.array([1.0, 1.0, -1.0])
        moments[2] = (1.0 - ROUNDING) * (moments[0] + moments[1])
    elif np.all(np.linalg.eigvalsh(inertia) >= LEAST):
        return inertia
    found: Floats = axes * moments @ axes.T
    return found


def _with_drives(
    model: RobotModel, known: Sequence[LinkMasses], mass: Floats, centre: Floats, inertia: Floats
) -> InertialModel:
    """Add the drives. What nobody says of them is ours, in shares of what the arm needs in random poses."""
    none = np.zeros(len(mass))
    bare = InertialModel(mass, centre, inertia, none, none, none, none)
    random, ranges = Random(SEED), list(zip(model.lower, model.upper, strict=True))
    q = np.array([[random.uniform(*ends) for ends in ranges] for _ in range(POSES)])
    own = np.max(np.einsum("nii->ni", mass_matrix(model, bare, q)), axis=0)
    still = np.zeros_like(q)
    holding = np.max(np.abs(torques(model, bare, q, still, still)), axis=0)

    def said(values: Iterable[float | None], usual: Floats) -> Floats:
        return np.array([x if y is None else y for x, y in zip(usual.tolist(), values, strict=True)])

    gear = said((link.gear for link in known), none + 1.0)
    armature = said((link.rotor for link in known), ROTOR_SHARE * own / gear**2) * gear**2
    needed = holding + (own + armature) * np.array(model.max_acceleration)
    usual = RESERVE * needed
    max_torque = said((link.max_torque for link in known), usual)
    damping = VISCOUS_SHARE * usual / np.array(model.max_velocity)
    viscous = said((link.viscous for link in known), damping / gear**2) * gear**2
    coulomb = said((link.coulomb for link in known), COULOMB_SHARE * usual / gear) * gear
    return bare._replace(armature=armature, viscous=viscous, coulomb=coulomb, max_torque=max_torque)


# --- inertias of shapes --------------------------------------------------------------------------------------------


Slice = Iterator[tuple[Vector, float]]  # points with their areas [m2]


class UnitSolid(NamedTuple):
    """Centre (3,) [m] and inertia (3, 3) about it [m2] of a body of one kilogram."""

    centre: Floats
    inertia: Floats


class PointMasses(NamedTuple):
    """Points (k, 3) [m] with volumes (k,) [m3] that have the volume, the centre and the second moments of a body."""

    points: Floats
    volumes: Floats


def solid_of_link(model: RobotModel, link: int) -> UnitSolid | None:
    """Return what the shapes of a link are together, the hand closed; None of a link without a shape that can be
    read. Where shapes overlap, both count.
    """
    parts = list[PointMasses]()
    for shape in shapes_of(model):
        if shape.link == link:
            try:
                parts.append(point_masses(shape.body))
            except VrsError:  # a mesh that cannot be read
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
    """Return points that stand for a body. Raises FileError, FileDamaged for a mesh that cannot be read."""
    match body:
        case Box(size, pose):
            return _placed(pose, _slices((-0.5 * size[2], 0.5 * size[2]), lambda z: _rectangle(z, size[0], size[1])))
        case Cylinder(start, end, (r, s)):
            far = hypot(*subtracted(end, start))
            slices = _slices((0.0, far), lambda z: _disc(z, r + (s - r) * z / far))
            return _placed(_along_z(start, subtracted(end, start)), slices)
        case Capsule(start, end, radii):
            return _capsule(start, end, radii)
        case Slab():
            return _slab(body)
        case MeshFile(path, pose, scale):
            mesh = load_mesh(Path(path))
            corners = mesh.vertices[mesh.faces] * (metres_of(mesh.units) * np.array(scale))
            return _placed(pose, _tetrahedra(corners))


def _capsule(start: Vector, end: Vector, radii: tuple[float, float]) -> PointMasses:
    """The hull of two balls: a cap of each, and a cone between the circles in which it touches them."""
    (r, s), far = radii, hypot(*subtracted(end, start))
    if far <= abs(r - s):  # one ball holds the other
        centre, r, s, far = (start, r, r, 0.0) if r >= s else (end, s, s, 0.0)
        T = _along_z(centre, (0.0, 0.0, 1.0))
    else:
        T = _along_z(start, subtracted(end, start))
    lean = asin((r - s) / far) if far else 0.0
    low, high = r * np.sin(lean), far + s * np.sin(lean)  # heights of the two circles
    r_low, r_high = r * np.cos(lean), s * np.cos(lean)

    def cone(z: float) -> Slice:
        return _disc(z, r_low + (r_high - r_low) * (z - low) / (high - low))

    parts = [_slices((-r, low), lambda z: _disc(z, (max(r * r - z * z, 0.0)) ** 0.5))]
    if high - low > 0.0:
        parts.append(_slices((low, high), cone))
    parts.append(_slices((high, far + s), lambda z: _disc(z, (max(s * s - (z - far) ** 2, 0.0)) ** 0.5)))
    found = PointMasses(*(np.concatenate(columns) for columns in zip(*parts, strict=True)))
    return _placed(T, found)


def _slab(body: Slab) -> PointMasses:
    """The hull of two discs: rectangles across it, of a thickness that tapers."""
    way, (r1, r2), (t1, t2) = subtracted(body.end, body.start), body.radii, body.thickness
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
        thickness = t1 + (t2 - t1) * (u + r1) / (far + r1 + r2)
        return _rectangle(u, 2.0 * half_width(u), thickness)

    parts = [_slices((a, b), across, ROUND) for a, b in pairwise(ends)]
    points, volumes = (np.concatenate(columns) for columns in zip(*parts, strict=True))
    return _placed(frame(x, z, body.start), PointMasses(points[:, [2, 0, 1]], volumes))


def _slices(ends: tuple[float, float], slice_at: Callable[[float], Slice], count: int = 4) -> PointMasses:
    """Points of slices at the places of Gauss and Legendre: exact for slices that grow as z to the 7th at most."""
    low, high = ends
    places, weights = (0.5 * (high - low) * row for row in np.polynomial.legendre.leggauss(count))
    rows = [
        (point, area * weight)
        for z, weight in zip(0.5 * (low + high) + places, weights, strict=True)
        for point, area in slice_at(float(z))
    ]
    return PointMasses(np.array([point for point, _ in rows]), np.array([volume for _, volume in rows]))


def _disc(z: float, radius: float) -> Slice:
    """Four points with the area and the second moments of a disc."""
    far, area = radius / 2**0.5, pi * radius * radius / 4.0
    for x, y in ((far, 0.0), (-far, 0.0), (0.0, far), (0.0, -far)):
        yield (x, y, z), area


def _rectangle(z: float, width: float, depth: float) -> Slice:
    x, y = width / 12**0.5, depth / 12**0.5
    for corner in ((x, y), (-x, y), (x, -y), (-x, -y)):
        yield (*corner, z), width * depth / 4.0


def _tetrahedra(corners: Floats) -> PointMasses:
    """Points of the tetrahedra between the origin and each triangle (k, 3, 3): their corners, and their centres."""
    volumes = np.einsum("ni,ni->n", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6.0
    centres = corners.sum(axis=1) / 4.0
    points = np.concatenate([*corners.transpose(1, 0, 2), np.zeros_like(centres), centres])
    return PointMasses(points, np.concatenate([volumes / 20.0] * 4 + [volumes * 0.8]))


def _along_z(place: Vector, way: Vector) -> Transform:
    z = unit(way)
    return frame(any_normal(z), z, place)


def _placed(T: Transform, solid: PointMasses) -> PointMasses:
    rows = np.array(T).reshape(3, 4)
    return PointMasses(solid.points @ rows[:, :3].T + rows[:, 3], solid.volumes)
