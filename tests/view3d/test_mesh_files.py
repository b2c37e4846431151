"""Meshes out of files: read as they are, or one word said and capsules in their place."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh

from tests.view3d.test_meshes import assert_closed, volume
from vrs_cli.errors import FileDamaged, FileError, NonexistentFile
from vrs_cli.files import mesh_file
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.kinematics.shapes import Box, LinkShape, MeshFile
from vrs_cli.kinematics.transform import translation
from vrs_cli.view3d.figure import looks_of
from vrs_cli.view3d.meshes import read_mesh


def written(folder: Path, name: str, mesh: trimesh.Trimesh) -> Path:
    path = folder / name
    mesh.export(path)
    return path


@pytest.mark.parametrize("name", ["brick.stl", "brick.obj", "brick.dae", "BRICK.STL"])
def test_a_brick_of_a_file_is_a_brick(tmp_path: Path, name: str) -> None:
    path = written(tmp_path, name, trimesh.creation.box((0.1, 0.2, 0.3)))
    mesh = read_mesh(MeshFile(str(path), translation(1.0, 0.0, 0.0), (2.0, 1.0, 1.0)))
    assert len(mesh.vertices) == 24, "an edge is none that two faces share"
    assert mesh.vertices.min(axis=0) == pytest.approx((0.9, -0.1, -0.15), abs=1e-6)
    assert mesh.vertices.max(axis=0) == pytest.approx((1.1, 0.1, 0.15), abs=1e-6)
    assert volume(mesh) == pytest.approx(0.012, rel=1e-6)
    assert_closed(mesh)


def test_what_is_round_stays_so(tmp_path: Path) -> None:
    ball = trimesh.creation.icosphere(3, 0.1)
    assert len(read_mesh(MeshFile(str(written(tmp_path, "ball.stl", ball)))).vertices) == len(ball.vertices)
    tube = read_mesh(MeshFile(str(written(tmp_path, "tube.stl", trimesh.creation.cylinder(0.1, 0.3, 32)))))
    assert len(tube.vertices) == 32 + 32 + 33 + 33, "round about, and two flat ends"


def test_a_mirrored_mesh_has_its_outside_out(tmp_path: Path) -> None:
    path = written(tmp_path, "brick.stl", trimesh.creation.box((0.1, 0.2, 0.3)))
    assert volume(read_mesh(MeshFile(str(path), scale=(1.0, 1.0, -1.0)))) == pytest.approx(0.006, rel=1e-6)


def test_units_of_a_dae_file(tmp_path: Path) -> None:
    path = written(tmp_path, "brick.dae", trimesh.creation.box((10.0, 20.0, 30.0)))
    text = path.read_text(encoding="utf-8")
    path.write_text(text.replace("<up_axis>", '<unit name="centimeter" meter="0.01"/><up_axis>'), encoding="utf-8")
    assert np.ptp(read_mesh(MeshFile(str(path))).vertices, axis=0) == pytest.approx((0.1, 0.2, 0.3), abs=1e-6)


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
        with pytest.raises(refusal):
            read_mesh(MeshFile(str(tmp_path / name)))
    with pytest.raises(FileError, match="on another machine"):
        read_mesh(MeshFile("//elsewhere/arms/mesh.stl"))


def test_a_small_file_of_many_faces_is_not_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(mesh_file, "MOST_FACES", 3)
    (tmp_path / "bomb.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\n" + 4 * "f 1 2 3\n", encoding="utf-8")
    with pytest.raises(FileError, match="4 faces"):
        read_mesh(MeshFile(str(tmp_path / "bomb.obj")))


def test_capsules_stand_for_missing_files_and_one_word_is_said(tmp_path: Path) -> None:
    there = written(tmp_path, "brick.stl", trimesh.creation.box((0.1, 0.2, 0.3)))
    files = {0: str(there), 1: str(tmp_path / "one.stl"), 2: str(tmp_path / "two.stl")}
    shapes = (*(LinkShape(link, MeshFile(path)) for link, path in files.items()), LinkShape(2, Box((0.1, 0.1, 0.1))))
    found = looks_of(replace(load_robot("planar2"), shapes=shapes))
    assert isinstance(found.looks[0].shape.body, MeshFile)
    assert {look.shape.link for look in found.looks} == {0, 1, 2}
    assert not any(isinstance(look.shape.body, MeshFile) for look in found.looks if look.shape.link)
    assert "one.stl" in found.missing
    assert found.missing.endswith("(and 1 more): capsules stand for what is missing")
    assert looks_of(load_robot("planar2")).missing == ""
