"""Convert data for the page: shapes of a robot to tables, meshes to GLB, a saved trajectory with its cell to JSON."""

from __future__ import annotations

import re
from base64 import b64encode
from hashlib import sha256
from itertools import groupby
from pathlib import Path
from threading import Lock
from typing import Any
from urllib.parse import quote

from vrs_cli.engine.feed import Snapshot
from vrs_cli.engine.position import position_at
from vrs_cli.engine.settings import Settings
from vrs_cli.errors import NonexistentFile, VrsError
from vrs_cli.files.mesh_file import check, glb_of, missing_package
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.bodies import capsules, shapes_of
from vrs_cli.kinematics.link_data import LinkShape, MeshFile, rgb, shape_tables
from vrs_cli.kinematics.model import RobotModel
from vrs_cli.kinematics.model_data import to_dict
from vrs_cli.language.run.signals import Cell
from vrs_cli.net.course_teller import WholeCourse, whole_course
from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.values.commands import MotionKind
from vrs_cli.wire.cells import cell_record
from vrs_cli.wire.codec import table_of
from vrs_cli.wire.messages import snapshot_record

MESH = "mesh"
MAX_KEPT_BYTES = 100_000_000  # maximum bytes of converted meshes kept in memory


class ServedShapes:
    """The shapes of the links of robot `name`. `tables`: the shapes as data for clients; `glb` in a table is the
    address of the mesh in GLB format. `shows_paths`: include the paths of files, because the clients run on this
    machine for the same user.
    """

    def __init__(self, name: str, model: RobotModel, *, shows_paths: bool) -> None:
        self._meshes: dict[str, LinkShape] = {}
        self._converted: dict[str, bytes] = {}
        self._lock = Lock()
        self.tables = list[dict[str, Any]]()
        shapes = shapes_of(model)
        keys = {shape: _key(shape, shape.body) for shape in shapes if isinstance(shape.body, MeshFile)}
        bare = {shape.link for shape, key in keys.items() if key is None}  # a capsule replaces an unreadable file
        drawn = [one for one in shapes if one.link not in bare]
        drawn += [one for one in capsules(model) if one.link in bare] if bare else []
        for shape in drawn:
            (table,) = shape_tables((shape,))
            if isinstance(shape.body, MeshFile) and (key := keys[shape]) is not None:
                self._meshes[key] = shape
                table["glb"] = f"/robots/{quote(name, safe='')}/{MESH}/{key}.glb"
                table["file"] = shape.body.path if shows_paths else Path(shape.body.path).name
            self.tables.append(table)

    def glb(self, file: str) -> bytes:
        """Return a mesh in GLB format; `file`: the last part of its address. Any thread may call this method. Raises
        NonexistentFile for an unknown mesh, and FileError or FileDamaged if the file cannot be converted.
        """
        shape = self._meshes.get(file.removesuffix(".glb"))
        if shape is None or not isinstance(shape.body, MeshFile):
            raise NonexistentFile(file)
        with self._lock:  # one conversion at a time, because each needs much memory
            if file not in self._converted:
                found = glb_of(Path(shape.body.path), shape.body.scale, rgb(shape.colour))
                if sum(map(len, self._converted.values())) + len(found) > MAX_KEPT_BYTES:
                    self._converted.clear()
                self._converted[file] = found
            return self._converted[file]


def _key(shape: LinkShape, body: MeshFile) -> str | None:
    """Return a name for a mesh that is hard to guess and changes with the file, its scale and its colour; None if the
    file cannot be read."""
    if missing_package(Path(body.path).suffix.lower()[1:]):
        return None
    try:
        check(Path(body.path))
        found = Path(body.path).stat()
    except (VrsError, OSError):
        return None
    said = (body.path, found.st_mtime_ns, found.st_size, body.scale, shape.colour)
    return sha256(repr(said).encode()).hexdigest()[:32]


FORMAT = "vrs page 1"
MAX_PLACES = 200  # maximum number of named locations on a page
PLACE = re.compile(r"MOVE[ST]* ([A-Z][A-Z0-9_.]*)", re.IGNORECASE)  # a motion to a named location and nothing else
GLB = "data:model/gltf-binary;base64,"


def recorded_page(
    arm: RobotArm,
    timeline: Timeline,
    *,
    title: str = "",
    rate: float = 1.0,
    cell: Cell | None = None,
    between: tuple[float, float] | None = None,
    picture: int = 0,
) -> dict[str, Any]:
    """Return the data of a page that shows a recording of a timeline, as JSON values, with all meshes, the named
    targets of motions, and the states over time of the parts in the `cell`.

    `rate`: the initial playback rate. `between`: show only the motions between these two times [s]. `picture`: if not
    0, show only the 3-D picture, for photographs, in this quality (1 is the finest).
    """
    return {**moments(arm, timeline, title=title, rate=rate, cell=cell, between=between, picture=picture), **robot(arm)}


def robot(arm: RobotArm) -> dict[str, Any]:
    """Return the robot model with all meshes: the fields of the page's data that are the same for all timelines."""
    shapes = ServedShapes("", arm.model, shows_paths=False)
    model = to_dict(arm.model)
    model.pop("collision", None)  # contains paths of this machine
    return {"model": {**model, "shapes": [_with_mesh(shapes, table) for table in shapes.tables]}}


def moments(
    arm: RobotArm,
    timeline: Timeline,
    *,
    title: str = "",
    rate: float = 1.0,
    cell: Cell | None = None,
    between: tuple[float, float] | None = None,
    picture: int = 0,
) -> dict[str, Any]:
    """Return the fields of the page's data that depend on the timeline: all except the fields that `robot` returns."""
    snapshot = Snapshot.of(timeline, Settings())
    if between is not None:
        first, last = (timeline.index_at(t) for t in between)
        snapshot = Snapshot.part(timeline, Settings(), first, last + 1)
    return {
        "format": FORMAT,
        "title": title or arm.model.title,
        "rate": rate,
        "snapshot": table_of(snapshot_record(snapshot)),
        "cell": None if cell is None else cell_record(cell),
        "world": None if cell is None else table_of(_course(arm, timeline, cell, between)),
        "places": _places(arm, timeline),
        "between": between,
        "picture": picture,
    }


def _course(arm: RobotArm, timeline: Timeline, cell: Cell, between: tuple[float, float] | None) -> WholeCourse:
    from vrs_cli.world.course import World

    return whole_course(World(arm, cell), timeline, between)


def _with_mesh(shapes: ServedShapes, table: dict[str, Any]) -> dict[str, Any]:
    """Return the table of a shape with its mesh as data; without the mesh if the file cannot be converted."""
    if "glb" not in table:
        return table
    try:
        found = shapes.glb(table["glb"].rpartition("/")[2])
    except VrsError:
        return {key: value for key, value in table.items() if key != "glb"}
    return {**table, "glb": GLB + b64encode(found).decode()}


def _places(arm: RobotArm, timeline: Timeline) -> list[dict[str, Any]]:
    """Return the named locations to which motions go, each with the tool pose at the end of the motion."""
    found: dict[str, dict[str, Any]] = {}
    for _, segments in groupby(timeline, lambda segment: segment.motion.number):
        *_, last = segments
        motion = last.motion
        named = PLACE.fullmatch(motion.text.strip())
        if named and motion.kind in (MotionKind.JOINT, MotionKind.STRAIGHT) and motion.relative is None:
            name = named[1]
            if name not in found and len(found) < MAX_PLACES:
                found[name] = {"name": name, "pose": position_at(arm, timeline, last.finish).T_world_tool}
    return list(found.values())
