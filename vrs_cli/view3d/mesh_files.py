"""Meshes out of files, as URDF files name them: STL, OBJ and DAE, read by trimesh."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from vrs_cli.errors import FileDamaged, FileError, NonexistentFile
from vrs_cli.kinematics.shapes import MeshFile
from vrs_cli.view3d.meshes import Mesh, moved

if TYPE_CHECKING:
    from trimesh import Trimesh

KINDS = (".stl", ".obj", ".dae")
LARGEST = 50_000_000  # [B] of a file: no link of an arm has more
CREASE = 0.6  # [rad] faces that meet at more have an edge between them
MOST_FACES = 1_000_000  # of an OBJ file, whose faces are a few bytes each: so many are in an STL file of that size


def read_mesh(body: MeshFile) -> Mesh:
    """The surface of a body, in the frame of its link. Raises NonexistentFile, FileError, FileDamaged."""
    path = Path(body.path)
    check(path)
    import trimesh
    from trimesh.units import unit_conversion

    try:
        if path.suffix.lower() == ".obj" and (count := path.read_bytes().count(b"\nf ")) > MOST_FACES:
            raise FileError(f"{path}: {count} faces", f"at most {MOST_FACES} are read")
        found = trimesh.load_mesh(path, process=True, skip_materials=True)
        metres = unit_conversion(found.units, "meters") if found.units else 1.0  # DAE says it, the others do not
    except FileError:
        raise
    except Exception as error:  # whatever the readers of many formats run into
        raise FileDamaged(f"{path}: {error or type(error).__name__}", "a mesh is an STL, OBJ or DAE file") from None
    if not len(found.faces) or not np.isfinite(found.vertices).all():
        raise FileDamaged(f"{path}: it has no triangles", "a mesh is an STL, OBJ or DAE file")
    found.apply_transform(np.diag([*(metres * np.array(body.scale)), 1.0]))  # a mirrored one is turned inside out too
    return moved(creased(found), body.pose)


def creased(found: Trimesh) -> Mesh:
    """A mesh whose faces share each corner, with edges: faces that meet at more than CREASE share none any more."""
    found.update_faces(found.nondegenerate_faces(height=0.0))
    faces, smooth = found.faces, found.face_adjacency_angles < CREASE
    ends = found.face_adjacency_edges[smooth]
    one, other = (
        (3 * both[:, None] + (faces[both][:, None, :] == ends[:, :, None]).argmax(axis=2)).reshape(-1)
        for both in found.face_adjacency[smooth].T
    )
    labels = np.arange(faces.size)
    while True:  # corners that are alike take the least number of them
        least = np.minimum(labels[one], labels[other])
        after = labels.copy()
        np.minimum.at(after, one, least)
        np.minimum.at(after, other, least)
        if (after == labels).all():
            break
        labels = after
    kept, place = np.unique(labels, return_inverse=True)
    return Mesh(found.vertices[faces.reshape(-1)[kept]], place.reshape(-1, 3).astype(np.uint32))


def check(path: Path) -> None:
    """Raises NonexistentFile, FileError: only small files of this machine are read, and only meshes."""
    if path.suffix.lower() not in KINDS:
        raise FileError(f"{path}: no mesh", f"its name ends in {', '.join(KINDS)}")
    if str(path).startswith(("//", "\\\\")):
        raise FileError(f"{path}: on another machine", "give a file of this one")
    try:
        size = path.stat().st_size if path.is_file() else None
    except (OSError, ValueError) as error:
        raise FileError(f"{path}: {error}") from None
    if size is None:
        raise NonexistentFile(str(path))
    if size > LARGEST:
        raise FileError(f"{path}: {size} bytes", f"at most {LARGEST} are read")
