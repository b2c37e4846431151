"""Mesh files: what a page and contacts get of them, and which are refused."""

from __future__ import annotations

from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from vrs_cli.errors import FileDamaged, FileError, NonexistentFile
from vrs_cli.files import mesh_file
from vrs_cli.files.mesh_file import glb_of, load_mesh

trimesh = pytest.importorskip("trimesh")

GREY = (128, 128, 128)


def written(folder: Path, name: str, mesh: Any) -> Path:
    path = folder / name
    mesh.export(path)
    return path


def surface(path: Path, scale: tuple[float, float, float] = (1.0, 1.0, 1.0)) -> Any:
    """The triangles that a page gets of a file."""
    return trimesh.load_scene(BytesIO(glb_of(path, scale, GREY)), file_type="glb", process=False).to_mesh()


@pytest.mark.parametrize("name", ["brick.stl", "brick.obj", "brick.dae", "BRICK.STL"])
def test_a_brick_of_a_file_is_a_brick(tmp_path: Path, name: str) -> None:
    mesh = surface(written(tmp_path, name, trimesh.creation.box((0.1, 0.2, 0.3))), (2.0, 1.0, 1.0))
    assert len(mesh.vertices) == 24, "an edge is none that two faces share"
    assert mesh.bounds == pytest.approx(np.array([(-0.1, -0.1, -0.15), (0.1, 0.1, 0.15)]), abs=1e-6)
    assert mesh.volume == pytest.approx(0.012, rel=1e-5)


def test_what_is_round_stays_so(tmp_path: Path) -> None:
    ball = trimesh.creation.icosphere(3, 0.1)
    assert len(surface(written(tmp_path, "ball.stl", ball)).vertices) == len(ball.vertices)
    tube = surface(written(tmp_path, "tube.stl", trimesh.creation.cylinder(0.1, 0.3, 32)))
    assert len(tube.vertices) == 32 + 32 + 33 + 33, "round about, and two flat ends"


def test_a_mirrored_mesh_has_its_outside_out(tmp_path: Path) -> None:
    path = written(tmp_path, "brick.stl", trimesh.creation.box((0.1, 0.2, 0.3)))
    assert surface(path, (1.0, 1.0, -1.0)).volume == pytest.approx(0.006, rel=1e-5)


def test_units_of_a_dae_file(tmp_path: Path) -> None:
    path = written(tmp_path, "brick.dae", trimesh.creation.box((10.0, 20.0, 30.0)))
    text = path.read_text(encoding="utf-8")
    path.write_text(text.replace("<up_axis>", '<unit name="centimeter" meter="0.01"/><up_axis>'), encoding="utf-8")
    assert np.ptp(surface(path).vertices, axis=0) == pytest.approx((0.1, 0.2, 0.3), abs=1e-6)


def test_files_that_cannot_be_read(tmp_path: Path) -> None:
    (tmp_path / "folder.stl").mkdir()
    (tmp_path / "empty.stl").write_bytes(b"")
    (tmp_path / "damaged.dae").write_bytes(b"<a>")
    (tmp_path / "text.obj").write_text("v 1 2\nf 7 8 9\n", encoding="utf-8")
    for name, refusal in (
        ("none.stl", NonexistentFile),
        ("folder.stl", NonexistentFile),
        ("\0.stl", NonexistentFile),
        ("empty.stl", FileDamaged),
        ("damaged.dae", FileDamaged),
        ("text.obj", FileDamaged),
        ("mesh.txt", FileError),
    ):
        for read in (load_mesh, surface):
            with pytest.raises(refusal):
                read(tmp_path / name)
    with pytest.raises(FileError, match="on another machine"):
        load_mesh(Path("//elsewhere/arms/mesh.stl"))


def test_a_small_file_of_many_faces_is_not_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(mesh_file, "MAX_FACES", 3)
    (tmp_path / "bomb.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\n" + 4 * "f 1 2 3\n", encoding="utf-8")
    with pytest.raises(FileError, match="4 faces"):
        load_mesh(tmp_path / "bomb.obj")
