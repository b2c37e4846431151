"""Read mesh files (STL, OBJ, GLB, DAE) with the package trimesh, which only this module imports. A mesh file is read
completely before trimesh parses it. Other files are read only for colours: small local files with materials and
textures near the mesh file.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from importlib.util import find_spec
from io import BytesIO
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

from vrs_cli.errors import FileDamaged, FileError, NonexistentFile, VrsError
from vrs_cli.extras import MESH_PACKAGES, how_to_install
from vrs_cli.kinematics.transform import Vector

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray
    from trimesh import Trimesh

KINDS = (".stl", ".obj", ".dae", ".glb")
MAX_MESH_BYTES = 50_000_000  # [B] maximum size of a mesh file; meshes of robot links are smaller
MAX_FACES = 1_000_000  # maximum number of faces of a mesh: as many as an STL file of the maximum size has
MAX_PIECES = 64  # maximum number of convex pieces of a part or fixture
MAX_PIECE_POINTS = 4000  # maximum number of points of a convex piece
COLOUR_KINDS = (".mtl", ".png", ".jpg", ".jpeg", ".tga", ".bmp")  # suffixes of files with materials and textures
MAX_TEXTURE_BYTES, MAX_PIXELS = 20_000_000, 20_000_000
CREASE = 0.6  # [rad] an edge between faces at a larger angle counts as sharp
# a piece counts as convex if its faces are at most this deep inside its hull, as a fraction of the piece's size
DENT = 1e-3
FLAT = 1e-6  # a piece that is thinner than this fraction of its size counts as flat


class MeshMissing(FileError, text="No mesh reader"):
    """The error for a mesh file when trimesh is not installed."""


def load_mesh(path: Path) -> Trimesh:
    """Read all triangles of a file as one mesh, in the units of the file. Raises NonexistentFile, FileError,
    FileDamaged.
    """
    mesh: Trimesh = _load_scene(path).to_mesh()
    return mesh


def glb_of(path: Path, scale: Vector, colour: tuple[int, int, int]) -> bytes:
    """Convert a mesh file to GLB, in metres and with normals. The mesh has the file's colours and textures, or `colour`
    (red, green, blue) if the file has neither. Raises NonexistentFile, FileError, FileDamaged.
    """
    import numpy as np
    from trimesh import Scene
    from trimesh import Trimesh as Surface

    found = _load_scene(path, coloured=True)
    size, shown = metres_of(found.units) * np.array(scale), Scene()
    for piece in found.dump():
        piece.apply_transform(np.diag([*size, 1.0]))  # this also corrects the orientation of faces in a mirrored piece
        if not _has_texture(piece.visual):
            look = _plain_look(_main_colour(piece.visual) or (*colour, 255))
            shown.add_geometry(Surface(*split_creases(piece), visual=look, process=False))
        else:
            shown.add_geometry(piece)
    content: Any = shown
    return bytes(content.export(file_type="glb", include_normals=True))


def _plain_look(colour: tuple[int, ...]) -> Any:
    """Return the visual of a mesh with a single colour (red, green, blue, opacity) that is visible from both sides."""
    from trimesh import visual

    room: Any = visual  # Any, because trimesh has no types for this module
    material = room.material.PBRMaterial(
        baseColorFactor=colour, metallicFactor=0.0, roughnessFactor=0.6, doubleSided=True
    )
    return room.TextureVisuals(material=material)


def _has_texture(visual: Any) -> bool:
    material = getattr(visual, "material", None)
    image = getattr(material, "baseColorTexture", None) or getattr(material, "image", None)
    return getattr(visual, "uv", None) is not None and image is not None and image.width * image.height <= MAX_PIXELS


def _main_colour(visual: Any) -> tuple[int, ...] | None:
    """Return the colour (red, green, blue, opacity) of a piece of a mesh: the main colour of its material, or the mean
    colour of its faces; None if it has neither.
    """
    material = getattr(visual, "material", None)
    if material is not None:
        return tuple(map(int, material.main_color))
    return tuple(map(int, visual.face_colors.mean(axis=0).round())) if visual.defined else None


class FilesBeside:
    """Finds the materials and textures that a mesh file names. They must be below the parent of the mesh's folder,
    because a package has `meshes` and `textures` as neighbouring folders.
    """

    def __init__(self, path: Path) -> None:
        self.folder = path.absolute().parent

    def get(self, name: str) -> bytes:
        """Return the content of a named material or texture. Raises FileError if the file is not allowed
        or too large.
        """
        path = (self.folder / name.strip()).resolve()
        if path.suffix.lower() not in COLOUR_KINDS or not path.is_relative_to(self.folder.parent.resolve()):
            raise FileError(f"{path}: neither material nor texture of this mesh")
        if path.stat().st_size > MAX_TEXTURE_BYTES:
            raise FileError(f"{path}: more than {MAX_TEXTURE_BYTES} bytes")
        return path.read_bytes()

    __getitem__ = get


def convex_pieces(path: Path, scale: float) -> tuple[tuple[Vector, ...], ...]:
    """Return the convex pieces of a mesh file, each as its points in metres. `scale`: a factor of all sizes. If the
    file states no units, STL, OBJ and DAE are in millimetres, GLB in metres. Raises NonexistentFile, FileError,
    FileDamaged.
    """
    scene = _load_scene(path)
    pieces = scene.dump()
    if not 0 < len(pieces) <= MAX_PIECES:
        raise FileDamaged(f"{path}: {len(pieces)} pieces", f"from 1 to {MAX_PIECES} pieces are read")
    unit = metres_of(scene.units, 1e-3)
    return tuple(
        _hull(f"{path}: piece {number}" if len(pieces) > 1 else str(path), piece, unit * scale)
        for number, piece in enumerate(pieces, 1)
    )


def metres_of(units: str | None, otherwise: float = 1.0) -> float:
    """Return the length of a named unit [m]; `otherwise` if `units` is None, as in STL and OBJ files."""
    from trimesh.units import unit_conversion

    return float(unit_conversion(units, "meters")) if units else otherwise


def _load_scene(path: Path, *, coloured: bool = False) -> Any:
    """Read a mesh file as a scene of trimesh. `coloured`: whether to read materials and textures too. Raises
    NonexistentFile, FileError, FileDamaged.
    """
    check(path)
    kind = path.suffix.lower()[1:]
    if lacking := missing_package(kind):
        raise MeshMissing(f"{path}: meshes need {lacking}, which is not installed", how_to_install(MESH_PACKAGES))
    import trimesh

    try:
        content = path.read_bytes()
        count = content.count(b"\nf ") if kind == "obj" else 0
        # check sizes first, because trimesh allocates the memory that the JSON part of the file asks for
        if kind == "glb":
            length = int.from_bytes(content[12:16], "little")
            count = sum(row.get("count", 0) for row in json.loads(content[20 : 20 + length]).get("accessors", ()))
        if count > MAX_FACES:
            raise FileError(f"{path}: {count} faces", f"at most {MAX_FACES} are read")
        beside: Any = FilesBeside(path) if coloured else None
        found = trimesh.load_scene(
            BytesIO(content),
            file_type=kind,
            process=True,
            skip_materials=not coloured,
            resolver=beside,
        )
        if not found.dump() or not all(_sound(piece) for piece in found.dump()):
            raise FileDamaged(f"{path}: it has no triangles", _WANTED)
        return found
    except VrsError:
        raise
    except Exception as error:  # the readers of the formats raise many kinds of errors
        raise FileDamaged(f"{path}: {str(error) or type(error).__name__}", _WANTED) from None


def missing_package(kind: str) -> str:
    """Return the name of a package that is required for a kind of file (such as "dae") and is not installed; "" if none
    is missing.
    """
    if find_spec("trimesh") is None:
        return "trimesh"
    return "pycollada" if kind == "dae" and find_spec("collada") is None else ""


_WANTED = "a mesh is an STL, OBJ, GLB or DAE file"


def _sound(piece: Any) -> bool:
    import numpy as np

    return hasattr(piece, "faces") and len(piece.faces) > 0 and bool(np.isfinite(piece.vertices).all())


def check(path: Path, largest: int = MAX_MESH_BYTES) -> int:
    """Check a mesh file, and return its size [B]. Raises NonexistentFile, and FileError if it is too large, on another
    machine, or no mesh file.
    """
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
    if size > largest:
        raise FileError(f"{path}: {size} bytes", f"at most {largest} are read")
    return size


def split_creases(found: Trimesh) -> tuple[NDArray[np.float64], NDArray[np.uint32]]:
    """Duplicate vertices at sharp edges, so that faces that meet at an angle above CREASE share no vertices. Return the
    vertices (N, 3) and faces (M, 3).
    """
    import numpy as np

    found.update_faces(found.nondegenerate_faces(height=0.0))
    faces, smooth = found.faces, found.face_adjacency_angles < CREASE
    ends = found.face_adjacency_edges[smooth]
    one, other = (
        (3 * both[:, None] + (faces[both][:, None, :] == ends[:, :, None]).argmax(axis=2)).reshape(-1)
        for both in found.face_adjacency[smooth].T
    )
    labels = np.arange(faces.size)
    # give corners that are connected by smooth edges the smallest of their indexes; repeat until nothing changes
    while True:
        least = np.minimum(labels[one], labels[other])
        after = labels.copy()
        np.minimum.at(after, one, least)
        np.minimum.at(after, other, least)
        if (after == labels).all():
            break
        labels = after
    kept, place = np.unique(labels, return_inverse=True)
    return found.vertices[faces.reshape(-1)[kept]], place.reshape(-1, 3).astype(np.uint32)


# --- convex pieces ---------------------------------------------------------------------------------------------------


def _hull(name: str, piece: Trimesh, scale: float) -> tuple[Vector, ...]:
    """Return the points of a convex piece's hull [m]. `name`: the piece in errors. Raises FileDamaged if the piece is
    concave or flat, or has too many points.
    """
    import numpy as np

    points = np.unique(piece.vertices[np.unique(piece.faces)], axis=0)
    if len(points) > MAX_PIECE_POINTS:
        raise FileDamaged(f"{name} has {len(points)} points", f"simplify it to at most {MAX_PIECE_POINTS} points")
    size = float(np.ptp(points, axis=0).max())
    if not size > 0.0 or np.linalg.svd(points - points.mean(axis=0), compute_uv=False)[-1] < FLAT * size:
        raise FileDamaged(f"{name} is flat", "give a solid")
    if any(gap > DENT * size for gap in _dents(piece, points)):
        raise FileDamaged(f"{name} is concave", "give it as convex pieces: several objects in one OBJ or GLB file")
    return tuple((float(x), float(y), float(z)) for x, y, z in points * scale)


def _dents(piece: Trimesh, points: np.ndarray[Any, np.dtype[np.float64]]) -> Iterator[float]:
    """Yield for each face the greatest distance of a point beyond the plane of the face. The mean of all points is on
    the inner side of the plane.
    """
    import numpy as np

    corners = piece.vertices[piece.faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    lengths = np.linalg.norm(normals, axis=1)
    size = float(np.ptp(points, axis=0).max())
    kept = lengths > (1e-6 * size) ** 2
    normals, corners = normals[kept] / lengths[kept, None], corners[kept]
    inward = np.einsum("ij,ij->i", normals, points.mean(axis=0) - corners[:, 0]) > 0.0
    normals[inward] *= -1.0
    chunk = max(1, 2_000_000 // len(points))
    for first, last in pairwise([*range(0, len(normals), chunk), len(normals)]):
        above = points @ normals[first:last].T - np.einsum("ij,ij->i", normals[first:last], corners[first:last, 0])
        yield float(above.max())
