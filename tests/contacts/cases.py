"""Random scenes and motions, and their first contacts found by looking at all poses, one after the other."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import islice
from math import pi
from random import Random
from typing import NamedTuple

import numpy as np

from vrs_cli.contacts.checker import APART, Checker
from vrs_cli.contacts.physics import Physics
from vrs_cli.contacts.sweep import HeldPart, Stage
from vrs_cli.engine.engine import Engine
from vrs_cli.engine.position import joints_over
from vrs_cli.errors import MotionError
from vrs_cli.kinematics.arrays import Floats
from vrs_cli.kinematics.joints import JointKind
from vrs_cli.kinematics.model import RobotModel
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.kinematics.transform import IDENTITY, Transform, at_position, compose, rotation_about, translation
from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.values.commands import JointTarget, Move, PoseTarget
from vrs_cli.values.scene import BoxShape, CellScene, CylinderShape, Fixture, MeshShape, ScenePart, Shape, SphereShape
from vrs_cli.values.world import Contact

GREY = (0.5, 0.5, 0.5)
TICK = 5e-4  # [s] between two poses that are looked at
EXACT = 1e-3 + TICK  # [s] of a first contact
ROUNDING = 3e-6  # [m] of the distance between two solids
HELD = "held"


class Case(NamedTuple):
    """A motion among things that stand, with a part in the hand or without."""

    checker: Checker
    timeline: Timeline
    stage: Stage

    def found(self) -> Contact | None:
        return self.checker.first_in(self.timeline, [self.stage])


class Dense(NamedTuple):
    """When two things touch first [s], at the earliest and at the latest, for distances are known to `ROUNDING`; and
    when a touch first lasts for a millisecond. None where none does.
    """

    earliest: float | None
    latest: float | None
    lasting: float | None

    def agrees(self, found: Contact | None) -> bool:
        """Return whether a first contact that was found is that of the look at all poses."""
        if found is None or self.earliest is None:
            return self.lasting is None if found is None else False
        return self.earliest - EXACT <= found.t <= (found.t if self.latest is None else self.latest + EXACT)


def cases(rng: Random, count: int, robot: str = "puma560", motions: int = 30) -> Iterator[Case]:
    """Yield motions, so many in each scene."""
    return islice(_cases(rng, load_robot(robot), motions), count)


def _cases(rng: Random, model: RobotModel, motions: int) -> Iterator[Case]:
    while True:
        engine, scene = Engine(model), random_scene(rng)
        checker = Checker(engine.arm, scene)
        held = HeldPart(HELD, compose(translation(0.0, 0.0, 0.12), random_turn(rng)))
        for _ in range(motions):
            begin = engine.end
            if not _moved(rng, engine):
                continue
            holds = rng.random() < 0.5
            standing = {one.name: one.T_world_part for one in scene.parts if one.name != HELD}
            opening = ([begin], [float(rng.randrange(2))])
            stage = Stage(begin, engine.end, engine.frames, standing, held if holds else None, opening)
            yield Case(checker, engine.timeline, stage)


def _moved(rng: Random, engine: Engine) -> bool:
    """Append a random motion of some length. Return whether the arm can do it."""
    model, here = engine.model, engine.position(engine.end)
    part = rng.uniform(0.05, 0.5)
    joints = [
        min(max(q + part * rng.uniform(-0.5, 0.5) * (high - low), low), high)
        for q, low, high in zip(here.joints, model.lower, model.upper, strict=True)
    ]
    place = tuple(
        x + part * rng.uniform(-0.6, 0.6) for x in (here.T_world_tool.px, here.T_world_tool.py, here.T_world_tool.pz)
    )
    straight = rng.random() < 0.3
    target = PoseTarget(at_position(here.T_world_tool, *place)) if straight else JointTarget(tuple(joints))
    try:
        engine.perform(Move(target, straight, speed=rng.choice((1.0, 0.5, 0.1)) if not straight else None))
    except MotionError:
        return False
    return True


def random_scene(rng: Random) -> CellScene:
    """Return fixtures and parts in reach, and one more part, which is held."""
    fixtures, parts = [], []
    for k in range(rng.randint(2, 8)):
        T = at_position(random_turn(rng), rng.uniform(-0.8, 0.8), rng.uniform(-0.8, 0.8), rng.uniform(-0.5, 0.7))
        if k % 2:
            parts.append(ScenePart(f"part{k}", random_shape(rng), T, GREY, 1.0))
        else:
            fixtures.append(Fixture(f"fixture{k}", random_shape(rng), T, GREY))
    parts.append(ScenePart(HELD, BoxShape((0.06, 0.04, 0.1)), IDENTITY, GREY, 1.0))
    return CellScene(tuple(parts), tuple(fixtures))


def random_shape(rng: Random) -> Shape:
    x, y, z = (rng.uniform(0.03, 0.2) for _ in range(3))
    corners = tuple((i * x, j * y, k * z) for i in (-0.5, 0.5) for j in (-0.4, 0.5) for k in (-0.5, 0.3))
    shapes = (BoxShape((x, y, z)), CylinderShape(0.5 * x, y), SphereShape(0.5 * z), MeshShape((corners,), "wedge.stl"))
    return rng.choice(shapes)


def random_turn(rng: Random) -> Transform:
    axis = rng.uniform(-1.0, 1.0), rng.uniform(-1.0, 1.0), rng.uniform(0.1, 1.0)
    return rotation_about(axis, rng.uniform(0.0, pi))


def looked_at_all(case: Case, tick: float = TICK, *, skips: bool = True) -> Dense:
    """Look at all poses. A pair that touches in the first pose counts once it has come apart.

    It `skips` the poses between which the joints turn too little for any pair to begin to touch, or to come apart.
    """
    checker, stage = case.checker, case.stage
    case.found()  # puts the scene into the model
    physics = checker.physics()
    times = np.arange(stage.begin, stage.end + tick, tick)
    q = joints_over(checker.arm, case.timeline, times)
    ways = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(q, axis=0)) @ longest_levers(physics))])
    excused, earliest, latest, since, k = None, None, None, dict[tuple[int, int], float](), 0
    while k < len(times):
        t, near = float(times[k]), dict[tuple[int, int], float]()
        for key, distance in physics.near(q[k]):
            owners = physics.owners_of(key)
            near[owners] = min(distance, near.get(owners, distance))
        excused = {owners for owners, d in near.items() if d < APART and (excused is None or owners in excused)}
        counting = {owners: distance for owners, distance in near.items() if owners not in excused}
        least = min(counting.values(), default=1.0)
        earliest = t if earliest is None and least < checker.limit + ROUNDING else earliest
        latest = t if latest is None and least < checker.limit - ROUNDING else latest
        since = {owners: since.get(owners, t) for owners, d in counting.items() if d < checker.limit - ROUNDING}
        if any(t - begun >= 1e-3 for begun in since.values()):
            return Dense(earliest, latest, t)
        apart = [min(least, checker.margin) - checker.limit, *(APART - near[owners] for owners in excused)]
        k = max(k + 1, int(np.searchsorted(ways, ways[k] + min(apart) - 2.0 * ROUNDING)) if skips else 0)
    return Dense(earliest, latest, None)


def longest_levers(physics: Physics) -> Floats:
    """Return how far any solid comes at most as a joint turns by a radian, or slides by a metre: the lengths of the
    bodies one after the other, as MuJoCo's model has them, and the ball around the solid, whatever the pose.
    """
    m, model = physics.m, physics.model
    found = np.zeros(model.joint_count)
    for geom in range(m.ngeom):
        body, far = int(m.geom_bodyid[geom]), float(np.linalg.norm(m.geom_pos[geom]) + m.geom_rbound[geom])
        while body:
            for joint in range(m.body_jntadr[body], m.body_jntadr[body] + m.body_jntnum[body]):
                to_axis = float(np.linalg.norm(m.jnt_pos[joint]))
                if model.links[joint].kind is JointKind.PRISMATIC:
                    found[joint] = 1.0
                    far += max(abs(model.lower[joint]), abs(model.upper[joint]))
                else:
                    found[joint] = max(found[joint], far + to_axis)
                    far += 2.0 * to_axis
            far += float(np.linalg.norm(m.body_pos[body]))
            body = int(m.body_parentid[body])
    return found
