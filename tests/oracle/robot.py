"""A robot from its TOML table: forward kinematics by Denavit-Hartenberg links, and nothing of the product's own.

Derivatives are taken by a complex step: f(x + ih) has f'(x) h as its imaginary part, exact to the last bit.
Metres and radians; q is (N, n), frames are (N, 4, 4).
"""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]  # floats, or complex numbers where a derivative is taken

ROBOTS = Path(__file__).parents[2] / "vrs_cli" / "kinematics" / "robots"
STEP = 1e-30
MM = 1e-3
LEVEL = (0.0, 0.0, 0.0, 90.0, -90.0, 0.0)  # a frame that is not turned
BESIDE = 1e-3  # [m] of axis 2 from axis 1: the arm is RIGHTY where its wrist is on that side
SEARCHED = ("iiwa14", "panda", "xarm6")  # joints found by iteration: words may change on a line
WORDS = (("RIGHTY", "LEFTY"), ("ABOVE", "BELOW"), ("NOFLIP", "FLIP"))


def names() -> list[str]:
    """Those whose tool does what it is told: how near an arm of five joints comes to a turn has laws of its own."""
    return sorted(path.stem for path in ROBOTS.glob("*.toml") if 'task = "steady"' not in path.read_text("utf-8"))


@dataclass(frozen=True)
class Robot:
    """Arrays have one entry a joint; `slides` is true of joints in metres."""

    name: str
    links: Array  # (n, 4): a, d, alpha, theta
    slides: Array
    lower: Array
    upper: Array
    velocity: Array
    acceleration: Array
    jerk: Array
    tool: dict[str, float]
    poses: dict[str, Array]
    base: Array  # (4, 4), of the first joint

    @property
    def n(self) -> int:
        return len(self.links)

    @property
    def turns(self) -> bool:
        """Whether the turn of a pose counts for it: two joints can only choose a place."""
        return self.n > 2

    @property
    def rates(self) -> slice:
        """Which rates of a tool count."""
        return slice(None) if self.turns else self.places

    @property
    def places(self) -> slice:
        """Which of X, Y, Z count: an arm of two or three joints stays in its plane."""
        return slice(2 if self.n < 4 else 3)

    def frames(self, q: Array) -> list[Array]:
        """T_base_1 ... T_base_flange."""
        T, found = np.broadcast_to(self.base, (len(q), 4, 4)), []
        for i, (a, d, alpha, theta) in enumerate(self.links):
            turn, slide = (theta, d + q[:, i]) if self.slides[i] else (theta + q[:, i], d)
            T = (
                T
                @ rotation("z", turn, len(q))
                @ shift(0.0, 0.0, slide, len(q))
                @ shift(a, 0.0, 0.0)
                @ rotation("x", alpha)
            )
            found.append(T)
        return found

    def tip(self, q: Array, tool: Array) -> Array:
        """T_base_tool."""
        return self.frames(q)[-1] @ tool

    def twist(self, q: Array, qd: Array, tool: Array) -> Array:
        """(N, 6): velocity of the tip and angular velocity, in the base frame."""
        return rates(self.tip(q + 1j * STEP * qd, tool))

    def words(self, q: Array) -> list[tuple[str, float]]:
        """The configuration words that one joint vector has, each with how far it is from the other one."""
        if self.name in SEARCHED:
            return []
        frames = self.frames(q[None])
        if self.n < 6:
            elbow, hand = frames[0][0, :3, 3], frames[1][0, :3, 3]
            return [_word(0, hand[1] * elbow[0] - hand[0] * elbow[1])]
        shoulder, elbow = (frames[i][0, :3, 3] for i in (0, 1))
        along = np.array([np.cos(q[0]), np.sin(q[0]), 0.0])
        if self.name == "ur5e":
            wrist, out = frames[2][0, :3, 3], frames[4][0, :3, 3] @ along
            arm, forward = out, out
        elif (beside := np.hypot(*shoulder[:2])) > BESIDE:
            wrist, along = frames[3][0, :3, 3], np.array([*shoulder[:2], 0.0]) / beside
            arm = forward = wrist @ along
        else:
            wrist = frames[3][0, :3, 3]
            arm = self.frames((q + 1j * STEP * np.eye(self.n)[1])[None])[3][0, 2, 3].imag / STEP  # joint 2 raises it
            forward = -arm
        f, (up, out) = along * np.sign(forward), ((elbow - shoulder), (wrist - shoulder))
        above = (out @ f) * up[2] - out[2] * (up @ f)
        return [_word(0, arm), _word(1, above), _word(2, np.sin(q[4]))]


def _word(place: int, measure: float) -> tuple[str, float]:
    return WORDS[place][0 if measure >= 0.0 else 1], abs(measure)


def load(name: str) -> Robot:
    data = tomllib.loads((ROBOTS / f"{name}.toml").read_text())
    joints = data["joints"]
    slides = np.array([joint.get("kind") == "prismatic" for joint in joints])
    unit = np.where(slides, MM, np.pi / 180.0)

    def column(key: str) -> Array:
        return np.array([joint[key] for joint in joints]) * unit

    links = [(j["a"] * MM, j["d"] * MM, np.radians(j["alpha"]), np.radians(j.get("theta", 0.0))) for j in joints]
    tool = {key: value * (MM if key.startswith("linear") else np.pi / 180.0) for key, value in data["tool"].items()}
    columns = map(column, ("lower", "upper", "max_velocity", "max_acceleration", "max_jerk"))
    poses = {key: np.array(value) * unit for key, value in data["poses"].items()}
    return Robot(name, np.array(links), slides, *columns, tool, poses, frame(*data.get("base", LEVEL)))


# --- frames ------------------------------------------------------------------------------------------------------


def rotation(axis: str, angle: Any, count: int = 1) -> Array:
    """About x, y or z by one angle or (N,)."""
    k = "xyz".index(axis)
    i, j = (k + 1) % 3, (k + 2) % 3
    T = np.tile(np.eye(4, dtype=np.result_type(angle, float)), (count, 1, 1))
    T[:, i, i] = T[:, j, j] = np.cos(angle)
    T[:, j, i] = np.sin(angle)
    T[:, i, j] = -T[:, j, i]
    return T


def shift(x: Any, y: Any, z: Any, count: int = 1) -> Array:
    T = np.tile(np.eye(4, dtype=np.result_type(x, y, z, float)), (count, 1, 1))
    T[:, 0, 3], T[:, 1, 3], T[:, 2, 3] = x, y, z
    return T


def about(axis: Array, angle: Array) -> Array:
    """(N, 3, 3): rotations about a unit axis, by Rodrigues' formula."""
    x, y, z = axis
    K = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + np.sin(angle)[:, None, None] * K + (1.0 - np.cos(angle))[:, None, None] * (K @ K)


def rates(T: Array) -> Array:
    """(N, 6): what a frame that was computed with a complex step does: velocity, angular velocity."""
    W = (T.imag[:, :3, :3] / STEP) @ np.swapaxes(T.real[:, :3, :3], 1, 2)
    return np.concatenate((T.imag[:, :3, 3] / STEP, np.stack((W[:, 2, 1], W[:, 0, 2], W[:, 1, 0]), axis=1)), axis=1)


def trans(x: float, y: float, z: float, o: float, a: float, t: float) -> Array:
    """(4, 4) of TRANS(x, y, z, o, a, t) [mm, deg]: yaw O - 90, pitch A + 90, roll T about Z, Y, Z."""
    turn = rotation("z", np.radians(o - 90.0)) @ rotation("y", np.radians(a + 90.0)) @ rotation("z", np.radians(t))
    return np.asarray((shift(x * MM, y * MM, z * MM) @ turn)[0])


def frame(x: float, y: float, z: float, o: float, a: float, t: float) -> Array:
    """(4, 4): the inverse of `numbers`."""
    yaw, pitch, roll = np.radians((o - 90.0, a + 90.0, t))
    turned: Array = rotation("z", yaw) @ rotation("y", pitch) @ rotation("z", roll)
    return (shift(x * MM, y * MM, z * MM) @ turned)[0]


def numbers(T: Array) -> tuple[float, ...]:
    """X, Y, Z, O, A, T of a frame [mm, deg]."""
    sine = np.hypot(T[0, 2], T[1, 2])
    pitch = np.arctan2(sine, T[2, 2])
    if sine < 1e-9:  # only the sum of both turns is known
        yaw, roll = 0.0, np.arctan2(T[1, 0], T[1, 1])
    else:
        yaw, roll = np.arctan2(T[1, 2], T[0, 2]), np.arctan2(T[2, 1], -T[2, 0])
    return (*(T[:3, 3] / MM), *np.degrees([yaw + np.pi / 2, pitch - np.pi / 2, roll]))


def angle(A: Array, B: Array) -> Array:
    """(N,): by how much frames are turned against each other."""
    return 2.0 * np.arcsin(
        np.minimum(np.linalg.norm(A[..., :3, :3] - B[..., :3, :3], axis=(-2, -1)) / np.sqrt(8.0), 1.0)
    )
