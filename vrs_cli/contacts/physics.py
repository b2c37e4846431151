"""Build a MuJoCo model of an arm and of the things around it, and find its nearby pairs of solids. The package is
`mujoco-core`; an installed `mujoco` provides the same module. Four properties of MuJoCo decide how the model is built.

Bodies that no joint moves are never compared with each other, so joints move the links, and mocap bodies are not used.
A geom at the origin of its body ignores `geom_pos`, so a solid whose position changes has its own body (a slot), whose
`body_pos` is set. Two solids are compared only if both their distance and that of their bodies are below the sum of the
margins, so `geom_margin` and `body_margin` are set together. The depth of a cylinder below a plane is computed from the
projection of its axis onto the plane; for an upright cylinder this projection is only a rounding error, and the depth
is wrong by up to the radius. So the floor is tilted by a very small angle: heights change by some micrometres, far less
than the depth of a contact.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from math import dist, hypot
from typing import Any, NamedTuple

import mujoco
import numpy as np

from vrs_cli.contacts.solids import LinkSolids, Solid, SolidForm
from vrs_cli.kinematics.arrays import Floats
from vrs_cli.kinematics.joints import JointKind
from vrs_cli.kinematics.link_data import opening_motion
from vrs_cli.kinematics.model import RobotModel, link_pose
from vrs_cli.kinematics.transform import (
    IDENTITY,
    Transform,
    Vector,
    Z,
    compose,
    inverse,
    position,
    rotate,
    unit_quaternion,
)

ARENA = 4 << 20  # [bytes] MuJoCo's memory for the contacts at one pose
SCENE, ARM = 1, 2  # collision bits: the arm is compared with the scene and with itself, the scene only with the arm
TYPES = {
    SolidForm.BALL: mujoco.mjtGeom.mjGEOM_SPHERE,
    SolidForm.CAPSULE: mujoco.mjtGeom.mjGEOM_CAPSULE,
    SolidForm.CYLINDER: mujoco.mjtGeom.mjGEOM_CYLINDER,
    SolidForm.HULL: mujoco.mjtGeom.mjGEOM_MESH,
}
ALIKE = 1e-9  # [m, rad] axes that differ by less than this coincide
NOBODY = -1  # owner number of an empty slot
TINY = 1e-3  # [m] size of the solid in an empty slot
# quaternion (w, x, y, z) of the floor: a tilt of 5e-6 rad, for the reason given above
LEANING = [1.0, 1.5e-6, 2e-6, 0.0]


class Ball(NamedTuple):
    """A ball around one or more solids. `centre` in the frame of their link, or of their part; `radius` [m]."""

    centre: Vector
    radius: float


class Bounds(NamedTuple):
    """A ball around a solid, in the frame of the link with the number `link`, with which the solid moves."""

    link: int
    ball: Ball


class Standing(NamedTuple):
    """A part at a pose: its owner number, its solids, and T_world_part, or T_flange_part if the hand holds the part."""

    owner: int
    solids: Sequence[Solid]
    T: Transform


class Physics:
    """The MuJoCo model of an arm in a scene. The owner of a solid is a number: the index of a link, or a higher number
    that the caller chooses for another object.

    `fixed`: solids that never move, with their owners. `floor`: its owner and its height [m]. `kinds`: all solids that
    can be put into one of the `slots` of the scene or the `grips` (slots) of the hand. `apart`: pairs of links that are
    not compared.
    """

    def __init__(
        self,
        model: RobotModel,
        links: Sequence[LinkSolids],
        *,
        fixed: Iterable[tuple[int, Solid]] = (),
        floor: tuple[int, float] | None = None,
        kinds: Iterable[Solid] = (),
        slots: int = 0,
        grips: int = 0,
        apart: Iterable[tuple[int, int]] = (),
    ) -> None:
        self.model = model
        self._kinds = {solid: name for name, solid in enumerate(dict.fromkeys(kinds))}
        self._spec = mujoco.MjSpec()
        self._spec.memory = ARENA
        # faster: one contact for each pair of solids is enough
        self._spec.option.disableflags |= mujoco.mjtDisableBit.mjDSBL_MULTICCD
        self._owned: list[int] = []
        world = self._spec.worldbody
        if floor is not None:
            owner, height = floor
            plane = mujoco.mjtGeom.mjGEOM_PLANE
            self._geom(world, owner, SCENE, type=plane, size=[0, 0, 1], pos=[0, 0, height], quat=LEANING)
        for owner, solid in fixed:
            self._add(world, owner, SCENE, solid)
        fingers = self._add_links(links, grips)
        for k in range(slots):
            self._slot(world, f"slot{k}")
        for solid, name in self._kinds.items():
            _add_mesh(self._spec, f"kind{name}", solid)
        for pair in apart:
            one, other = (f"link{link}" for link in pair)
            self._spec.add_exclude(bodyname1=one, bodyname2=other)
        self.m = self._spec.compile()
        self.d = mujoco.MjData(self.m)
        self.owners: list[int] = [self._owned[int(self.m.geom(k).name)] for k in range(self.m.ngeom)]
        self._slots, self._grips = (
            [self._id(f"{what}{k}") for k in range(n)] for what, n in (("slot", slots), ("grip", grips))
        )
        self._links = [self._id(f"link{i}") for i in range(model.joint_count + 1)]
        self._fingers = [(self._id(name), opens) for name, opens in fingers]
        self._kinds_model = _kinds_model(self._kinds)
        self._radix = np.array([self.m.ngeom, 1])
        self._hand = -1.0
        self.place_base(IDENTITY)
        self.open_hand(0.0)

    # --- building ---

    def _geom(self, body: Any, owner: int, bits: int, **form: Any) -> None:
        name = str(len(self._owned))
        self._owned.append(owner)
        body.add_geom(name=name, contype=bits, conaffinity=SCENE | ARM if bits == ARM else 0, density=0.0, **form)

    def _add(self, body: Any, owner: int, bits: int, solid: Solid) -> None:
        name = f"mesh{len(self._owned)}"
        _add_mesh(self._spec, name, solid)
        self._geom(body, owner, bits, **_form(name, solid))

    def _slot(self, parent: Any, name: str) -> None:
        self._geom(_add_body(parent, name, IDENTITY), NOBODY, 0, type=TYPES[SolidForm.BALL], size=[TINY, 0, 0])

    def _add_links(self, links: Sequence[LinkSolids], grips: int) -> list[tuple[str, tuple[Any, ...]]]:
        bodies, fingers = link_bodies(self._spec, self.model), []
        self._spec.add_exclude(
            bodyname1="link0", bodyname2="link1"
        )  # MuJoCo excludes neighbouring bodies by itself only if both can move; the base is fixed
        for number, group in enumerate(links):
            body = bodies[group.link]
            if group.opens:
                fingers.append((f"finger{number}", group.opens))
                body = _add_body(body, f"finger{number}", IDENTITY)
            for solid in group.solids:
                self._add(body, group.link, ARM, solid)
        for k in range(grips):
            self._slot(bodies[-1], f"grip{k}")
        return fingers

    def _id(self, name: str) -> int:
        return int(self.m.body(name).id)

    # --- setting poses ---

    def place_base(self, T_world_robot: Transform) -> None:
        """Set the pose of the arm's base."""
        self._move(self._links[0], compose(T_world_robot, self.model.base))

    def open_hand(self, hand: float) -> None:
        """Set the opening of the hand: 1 is open, 0 closed."""
        if hand == self._hand:
            return
        self._hand = hand
        for body, opens in self._fingers:
            self._move(body, opening_motion(opens, hand))

    def fill(self, standing: Iterable[Standing], held: Standing | None = None) -> None:
        """Put the solids of parts into the slots, replacing the earlier solids. There must be enough slots."""
        self._fill(self._slots, [(SCENE, one.owner, one.T, solid) for one in standing for solid in one.solids])
        self._fill(self._grips, [] if held is None else [(ARM, held.owner, held.T, solid) for solid in held.solids])

    def _fill(self, slots: Sequence[int], rows: Sequence[tuple[int, int, Transform, Solid]]) -> None:
        m = self.m
        for body, (bits, owner, T, solid) in zip(slots, rows, strict=False):
            geom, kind = m.body_geomadr[body], self._kinds[solid]
            kinds, row = self._kinds_model, self._kinds_model.geom(f"kind{kind}").id
            self._move(body, compose(T, _pose(kinds.geom_pos[row], kinds.geom_quat[row])))
            for column in ("geom_type", "geom_size", "geom_rbound", "geom_aabb"):
                getattr(m, column)[geom] = getattr(kinds, column)[row]
            if solid.form is SolidForm.HULL:
                m.geom_dataid[geom] = m.mesh(f"kind{kind}").id
            self._compare(body, geom, bits)
            self.owners[geom] = owner
        for body in slots[len(rows) :]:
            self._compare(body, m.body_geomadr[body], 0)

    def _compare(self, body: int, geom: int, bits: int) -> None:
        m, reach = self.m, SCENE | ARM if bits == ARM else 0
        m.geom_contype[geom] = m.body_contype[body] = bits
        m.geom_conaffinity[geom] = m.body_conaffinity[body] = reach

    def _move(self, body: int, T: Transform) -> None:
        self.m.body_pos[body], self.m.body_quat[body] = position(T), unit_quaternion(T)

    # --- distances ---

    def margin(self, distance: float) -> None:
        """Set the distance below which `near` returns a pair [m]."""
        self.m.geom_margin[:] = self.m.body_margin[:] = 0.5 * distance

    def near(self, joints: Sequence[float] | Floats) -> list[tuple[int, float]]:
        """Return the pairs of solids that are closer than the margin at these joints [rad, m], including pairs within
        the arm. A pair is given by its key and its distance [m], which is negative if the solids overlap."""
        m, d = self.m, self.d
        d.qpos[:] = joints
        mujoco.mj_kinematics(m, d)
        mujoco.mj_collision(m, d)
        if not d.ncon:
            return []
        contacts = d.contact
        return list(zip((contacts.geom @ self._radix).tolist(), contacts.dist.tolist(), strict=True))

    def place(self, number: int) -> Vector:
        """Return the point midway between the two solids of pair number `number` in the last result of `near`, in the
        world frame [m]."""
        x, y, z = self.d.contact.pos[number].tolist()
        return x, y, z

    def pair(self, key: int) -> tuple[int, int]:
        """Return the numbers of the two solids of a pair; `key`: the key of the pair."""
        return divmod(key, int(self.m.ngeom))

    def owners_of(self, key: int) -> tuple[int, int]:
        """Return the owners of the two solids of a pair, the smaller number first; `key`: the key of the pair."""
        one, other = (self.owners[number] for number in self.pair(key))
        return (one, other) if one < other else (other, one)

    # --- bounds ---

    def bounds(self, number: int) -> Bounds:
        """Return a ball around a solid of the arm. For a finger, the ball contains both its open and its closed
        position."""
        m, body = self.m, int(self.m.geom_bodyid[number])
        pose, radius = _pose(m.geom_pos[number], m.geom_quat[number]), float(m.geom_rbound[number])
        opens = dict(self._fingers).get(body, ())
        link = self._links.index(body if body in self._links else int(m.body_parentid[body]))
        if opens:
            return Bounds(
                link,
                around([Ball(position(compose(opening_motion(opens, hand), pose)), radius) for hand in (0.0, 1.0)]),
            )
        T = link_pose(self.model, link, 0.0) if link else IDENTITY
        round_ = m.geom_type[number] in (TYPES[SolidForm.CYLINDER], TYPES[SolidForm.CAPSULE], TYPES[SolidForm.BALL])
        if link and round_ and self.model.links[link - 1].kind is JointKind.REVOLUTE and _on_axis(compose(T, pose)):
            return Bounds(link - 1, Ball(position(compose(T, pose)), radius))  # the solid turns in place on the axis
        return Bounds(link, Ball(position(pose), radius))

    def arm_solids(self) -> list[int]:
        """Return the numbers of all solids that belong to links."""
        return [
            int(number)
            for number in np.flatnonzero(np.array(self.owners) <= self.model.joint_count)
            if self.owners[number] >= 0
        ]

    def ball_of(self, solids: Iterable[Solid]) -> Ball:
        """Return a ball around the solids of a part, in the part's frame. The solids must be among the `kinds`."""
        kinds = self._kinds_model
        rows = [kinds.geom(f"kind{self._kinds[solid]}").id for solid in solids]
        return around([Ball(tuple(kinds.geom_pos[row].tolist()), float(kinds.geom_rbound[row])) for row in rows])


def link_bodies(spec: Any, model: RobotModel) -> list[Any]:
    """Add the links of an arm to a MuJoCo model, the base first: bodies `link0`, `link1`, ... with the frames of
    `model.link_frames` and unit masses, moved by joints `joint1`, `joint2`, ..."""
    bodies = [_add_body(spec.worldbody, "link0", model.base)]
    for i in range(1, model.joint_count + 1):
        T = link_pose(model, i, 0.0)
        body, back = _add_body(bodies[-1], f"link{i}", T), inverse(T)
        slides = model.links[i - 1].kind is JointKind.PRISMATIC
        kind = mujoco.mjtJoint.mjJNT_SLIDE if slides else mujoco.mjtJoint.mjJNT_HINGE
        body.add_joint(name=f"joint{i}", type=kind, axis=list(rotate(back, Z)), pos=list(position(back)))
        bodies.append(body)
    return bodies


def _add_body(parent: Any, name: str, T: Transform) -> Any:
    body = parent.add_body(name=name, pos=list(position(T)), quat=unit_quaternion(T))
    body.explicitinertial, body.mass, body.inertia = True, 1.0, [1.0, 1.0, 1.0]
    return body


def _on_axis(T: Transform) -> bool:
    """Return whether the z axis of a frame lies on the z axis of its parent."""
    return hypot(T.px, T.py) < ALIKE and hypot(T.ax, T.ay) < ALIKE


def around(balls: Sequence[Ball]) -> Ball:
    """Return a ball that contains the given balls; without balls, a ball of radius 0 at the origin."""
    if not balls:
        return Ball((0.0, 0.0, 0.0), 0.0)
    low, high = ([side(x) for x in zip(*(ball.centre for ball in balls), strict=True)] for side in (min, max))
    x, y, z = (0.5 * (a + b) for a, b in zip(low, high, strict=True))
    return Ball((x, y, z), max(dist((x, y, z), ball.centre) + ball.radius for ball in balls))


def _pose(place: Floats, turn: Floats) -> Transform:
    matrix = np.empty(9)
    mujoco.mju_quat2Mat(matrix, turn)
    return Transform(*np.column_stack([matrix.reshape(3, 3), place]).ravel().tolist())


def _form(mesh: str, solid: Solid) -> dict[str, Any]:
    """Return the arguments from which MuJoCo makes the geom of a solid."""
    form = {"type": TYPES[solid.form], "pos": list(position(solid.pose)), "quat": unit_quaternion(solid.pose)}
    return form | ({"meshname": mesh} if solid.form is SolidForm.HULL else {"size": list(solid.sizes)})


def _add_mesh(spec: Any, name: str, solid: Solid) -> None:
    if solid.form is not SolidForm.HULL:
        return
    mesh = spec.add_mesh(name=name, inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_CONVEX)
    mesh.uservert = [x for point in solid.points for x in point]


def _kinds_model(kinds: dict[Solid, int]) -> Any:
    """Compile a model that contains one solid of each kind. Slots copy their geometry from its rows."""
    spec = mujoco.MjSpec()
    for solid, number in kinds.items():
        name = f"kind{number}"
        _add_mesh(spec, name, solid)
        spec.worldbody.add_geom(name=name, **_form(name, solid))
    return spec.compile()
