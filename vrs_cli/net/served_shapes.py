"""The shapes of a served robot as tables for clients, and its mesh files as GLB, which browsers read."""

from __future__ import annotations

from hashlib import sha256
from pathlib import Path
from threading import Lock
from typing import Any
from urllib.parse import quote

from vrs_cli.errors import NonexistentFile, VrsError
from vrs_cli.files.mesh_file import check, glb_of, missing_package
from vrs_cli.kinematics.bodies import capsules, shapes_of
from vrs_cli.kinematics.model import RobotModel
from vrs_cli.kinematics.shapes import LinkShape, MeshFile, rgb, to_tables

MESH = "mesh"
MAX_KEPT_BYTES = 100_000_000  # of converted meshes


class ServedShapes:
    """The shapes of robot `name`. Clients get `tables`; each mesh has the address of its GLB in `glb`. `shows_paths`:
    its clients run on this machine for the same user, and may know where the files are.
    """

    def __init__(self, name: str, model: RobotModel, *, shows_paths: bool) -> None:
        self._meshes: dict[str, LinkShape] = {}
        self._converted: dict[str, bytes] = {}
        self._lock = Lock()
        self.tables = list[dict[str, Any]]()
        shapes = shapes_of(model)
        keys = {shape: _key(shape, shape.body) for shape in shapes if isinstance(shape.body, MeshFile)}
        bare = {shape.link for shape, key in keys.items() if key is None}  # capsules stand for unreadable files
        drawn = [one for one in shapes if one.link not in bare]
        drawn += [one for one in capsules(model) if one.link in bare] if bare else []
        for shape in drawn:
            (table,) = to_tables((shape,))
            if isinstance(shape.body, MeshFile) and (key := keys[shape]) is not None:
                self._meshes[key] = shape
                table["glb"] = f"/robots/{quote(name, safe='')}/{MESH}/{key}.glb"
                table["file"] = shape.body.path if shows_paths else Path(shape.body.path).name
            self.tables.append(table)

    def glb(self, file: str) -> bytes:
        """Return a mesh as GLB by the last part of its address. In any thread. Raises NonexistentFile for an unknown
        one, FileError, FileDamaged for a file that cannot be converted.
        """
        shape = self._meshes.get(file.removesuffix(".glb"))
        if shape is None or not isinstance(shape.body, MeshFile):
            raise NonexistentFile(file)
        with self._lock:  # conversions take memory: one at a time
            if file not in self._converted:
                found = glb_of(Path(shape.body.path), shape.body.scale, rgb(shape.colour))
                if sum(map(len, self._converted.values())) + len(found) > MAX_KEPT_BYTES:
                    self._converted.clear()
                self._converted[file] = found
            return self._converted[file]


def _key(shape: LinkShape, body: MeshFile) -> str | None:
    """Return a name that changes with the file, its scale and its colour, and that nobody guesses; None if the file
    cannot be read.
    """
    if missing_package(Path(body.path).suffix.lower()[1:]):
        return None
    try:
        check(Path(body.path))
        found = Path(body.path).stat()
    except (VrsError, OSError):
        return None
    said = (body.path, found.st_mtime_ns, found.st_size, body.scale, shape.colour)
    return sha256(repr(said).encode()).hexdigest()[:32]
