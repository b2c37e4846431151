"""Return the shapes of a robot's links: from its file, or capsules computed from its link parameters."""

from __future__ import annotations

import tomllib
from functools import cache
from math import dist, inf
from pathlib import Path

from vrs_cli.kinematics.joints import JointKind
from vrs_cli.kinematics.link_data import Box, Capsule, Cylinder, LinkShape, Opening, ShapeReader
from vrs_cli.kinematics.model import RobotModel, levers, link_frames, link_pose
from vrs_cli.kinematics.model_data import NEEDED_POSES
from vrs_cli.kinematics.robot_file import ROBOTS, load_robot
from vrs_cli.kinematics.transform import Z, along, inverse, position, rotate, translation

SHAPES = Path(ROBOTS, "shapes")  # shapes of built-in robots, in separate files because programs run without them
ORIGIN = (0.0, 0.0, 0.0)
THICK, THIN = 0.055, 0.03  # radii of the capsules of the first link and of the last, as fractions of the arm's reach
# if the cosine of the angle between axis 1 and the vertical is smaller, a block is drawn in place of a pedestal
UPRIGHT = 0.9
SHORT = 1e-6  # [m] parts of links shorter than this are not drawn


def shapes_of(model: RobotModel) -> tuple[LinkShape, ...]:
    """Return the shapes from the robot's file, else those of a built-in robot with the same links, else capsules."""
    if model.shapes:
        return model.shapes
    path = file_of_built_in(model, SHAPES)
    return capsules(model) if path is None else _shapes_in(path, model.joint_count)


def file_of_built_in(model: RobotModel, folder: Path) -> Path | None:
    """Return the file in `folder` named after the built-in robot that has the same links as this model; None if there
    is no such robot.
    """
    for path, known in _built_in_robots(folder):
        if (known.links, known.base, known.flange) == (model.links, model.base, model.flange):
            return path
    return None


@cache
def _built_in_robots(folder: Path) -> tuple[tuple[Path, RobotModel], ...]:
    return tuple((path, load_robot(path.stem)) for path in sorted(folder.glob("*.toml")))


@cache
def _shapes_in(path: Path, joint_count: int) -> tuple[LinkShape, ...]:
    data = tomllib.loads(path.read_text(encoding="utf-8"))
    return ShapeReader(str(path), human=True).shapes(data["shapes"], joint_count)


def size_of(model: RobotModel) -> float:
    """Return the reach of an arm [m], from which drawings take their scale."""
    _, (reach, *_) = levers(model)
    return max(reach, 0.05)  # [m] minimum reach for drawings


# --- capsules ------------------------------------------------------------------------------------------------------


def capsules(model: RobotModel) -> tuple[LinkShape, ...]:
    """Return shapes computed from link parameters alone: for each link a capsule along the axis of its joint, then
    another across to the next axis.
    """
    reach, n = size_of(model), model.joint_count
    radii = [reach * (THICK + (THIN - THICK) * i / n) for i in range(n + 1)]
    first, r = radii[0], radii[n]
    if model.base.az < UPRIGHT:  # the first axis is not vertical: draw the base as a block
        found = [LinkShape(0, Box((3.0 * first, 3.0 * first, 2.0 * first)), "dark")]
    else:  # draw a pedestal, down to below the lowest point of the arm at READY or NEST
        frames = [T for name in NEEDED_POSES for T in link_frames(model, model.poses[name])]
        lowest = min(T.pz for T in frames) - model.base.pz  # [m] height of the lowest joint or flange above frame 0
        low = min(0.0, (lowest if lowest < -SHORT else inf) - 2.0 * first)
        plate, column = (0.0, 0.0, low + 0.4 * first), (1.25 * first, 1.25 * first)
        found = [
            LinkShape(0, Cylinder((0.0, 0.0, low), plate, (2.0 * first, 1.8 * first)), "dark"),
            LinkShape(0, Cylinder((0.0, 0.0, low + 0.35 * first), (0.0, 0.0, 1.2 * first), column), "grey"),
        ]
    for i in range(1, n + 1):
        found += _link(model, i, (radii[i - 1], radii[i]))
    found.append(LinkShape(n, Cylinder((0.0, 0.0, -0.4 * r), ORIGIN, (0.9 * r, 0.9 * r)), "steel"))
    found.append(LinkShape(n, Box((2.6 * r, 1.0 * r, 0.7 * r), translation(0.0, 0.0, 0.35 * r)), "dark"))
    for side in (-1.0, 1.0):  # two fingers, which touch when the hand is closed
        finger = Box((0.3 * r, 0.7 * r, 2.0 * r), translation(side * 0.15 * r, 0.0, 1.7 * r))
        found.append(LinkShape(n, finger, "orange", (Opening((side * 0.9 * r, 0.0, 0.0)),)))
    return tuple(found)


def _link(model: RobotModel, i: int, radii: tuple[float, float]) -> list[LinkShape]:
    """Return the shapes of link i (counted from 1): the hub at its joint, and the bar to the next joint or to the
    flange.
    """
    link = model.links[i - 1]
    slides = link.kind is JointKind.PRISMATIC
    upper = model.upper[i - 1]
    here = inverse(link_pose(model, i, upper if slides else 0.0))  # T_i_i-1: the previous frame in the frame of link i
    axis, start = rotate(here, Z), position(here)
    run = link.d + (upper if slides else 0.0)
    corner = along(start, axis, run)
    thick, thin = radii
    found: list[LinkShape] = []
    if slides:
        # draw a rod from the end of the link through a sleeve that is fixed to the previous link
        sleeve, rod = 1.1 * thick, 0.6 * thin
        found.append(LinkShape(i - 1, Cylinder((0.0, 0.0, -thick), (0.0, 0.0, thick), (sleeve, sleeve)), "dark"))
        reaches = 0.0, -run, upper - model.lower[i - 1] - run
        ends = along(corner, axis, min(reaches) - rod), along(corner, axis, max(reaches) + rod)
        found.append(LinkShape(i, Cylinder(*ends, (rod, rod)), "steel"))
    else:
        hub = along(start, axis, -1.25 * thick), along(start, axis, 1.25 * thick)
        found.append(LinkShape(i, Cylinder(*hub, (1.02 * thick, 1.02 * thick)), "dark"))
        if abs(run) > SHORT:
            found.append(LinkShape(i, Capsule(start, corner, (thick, thick))))
    if dist(corner, ORIGIN) > SHORT:
        found.append(LinkShape(i, Capsule(corner, ORIGIN, (thick, thin))))
    return found
