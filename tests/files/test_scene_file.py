"""The scene in a cell file: what is read, and what is refused."""

from __future__ import annotations

from importlib import import_module
from math import radians
from pathlib import Path
from typing import Any

import pytest

from vrs_cli.errors import FileDamaged, NonexistentFile
from vrs_cli.files import cell_file, mesh_file, scene_file
from vrs_cli.files.cell_file import parse_cell, read_cell
from vrs_cli.kinematics.transform import from_oat, translation
from vrs_cli.values.scene import (
    Beam,
    BoxShape,
    CylinderShape,
    Feeder,
    GraspPlace,
    Gripper,
    MeshShape,
    Proximity,
    Sensor,
    SphereShape,
    Zone,
)

SCENE = """
floor = -600
[signals]
feeder.go = 3
at.place = 1002

[hand]
opening = 80
tolerance = 3
signal = 1010

[[part]]
name = "Box"
shape = "box"
size = [40, 40, 60]
at = [0, 550, -250]
colour = "red"
mass = 0.2
grasp = [{at = [0, 0, 20], width = 40}]

[[part]]
name = "ring"
shape = "cylinder"
radius = 30
height = 20
at = [100, 550, -250, 90, 0, 45]

[[fixture]]
name = "ball"
shape = "sphere"
radius = 25
at = [0, 0, 0]
colour = [0.5, 0.5, 1]

[[sensor]]
name = "at.feeder"
signal = 1001
kind = "beam"
from = [-100, 550, -250]
to = [100, 550, -250]

[[sensor]]
name = "zone"
signal = "-at.place"
kind = "box"
at = [300, 450, -200]
size = [50, 60, 70]

[[sensor]]
name = "near"
signal = 1003
kind = "proximity"
at = [0, 0, 0]
direction = [0, 0, -2]
range = 12

[[feeder]]
when = "feeder.go"
after = 0.5
parts = ["box", "ring"]
again = true

[[sink]]
when = "-feeder.go"
at = [300, 450, -200]
size = [200, 200, 200]
"""
BOX = '[[part]]\nname = "a"\nshape = "box"\nsize = [1, 2, 3]\nat = [0, 0, 0]\n'
BEAM = '[[sensor]]\nname = "s"\nkind = "beam"\nfrom = [0, 0, 0]\nto = [1, 0, 0]\n'


def test_everything_of_a_scene_is_read_in_metres() -> None:
    scene = parse_cell(SCENE).scene
    box, ring = scene.parts
    assert (box.name, box.shape, box.T_world_part) == ("box", BoxShape((0.04, 0.04, 0.06)), translation(0, 0.55, -0.25))
    assert (box.colour, box.mass, box.grasp) == (scene_file.COLOURS["red"], 0.2, (GraspPlace((0, 0, 0.02), 0.04),))
    assert ring.shape == CylinderShape(0.03, 0.02)
    assert ring.T_world_part == from_oat(0.1, 0.55, -0.25, radians(90), 0.0, radians(45))
    (ball,) = scene.fixtures
    assert (ball.shape, ball.colour) == (SphereShape(0.025), (0.5, 0.5, 1.0))
    assert scene.sensors == (
        Sensor("at.feeder", 1001, Beam((-0.1, 0.55, -0.25), (0.1, 0.55, -0.25), 0.0005)),
        Sensor("zone", -1002, Zone(translation(0.3, 0.45, -0.2), (0.05, 0.06, 0.07))),
        Sensor("near", 1003, Proximity((0, 0, 0), (0, 0, -1), 0.012, 0.0005)),
    )
    assert scene.feeders == (Feeder(("box", "ring"), 3, 0.5, None, True),)
    assert (scene.sinks[0].when, scene.sinks[0].zone.size) == (-3, (0.2, 0.2, 0.2))
    assert scene.gripper == Gripper(0.08, 0.003, Gripper().size, 1010)
    assert scene.floor == -0.6


def test_a_cell_without_a_scene_has_an_empty_one() -> None:
    assert parse_cell("[signals]\na = 3").scene.empty


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("[[parts]]", ":1: parts: did you mean part?"),
        ("part = 3", ":1: part: write [[part]]"),
        ("part = [3]", ":1: [[part]] 1: part: it is a table"),
        (BOX.replace("size = [1, 2, 3]\n", ""), "size: it is missing: [x, y, z] in mm"),
        (BOX.replace("[1, 2, 3]", "[1, 2, 0]"), ":4: [[part]] 1: size: sizes are from 0.01 to 100000 mm"),
        (BOX.replace("[1, 2, 3]", "[1, 2, nan]"), "size: [1, 2, nan]: [x, y, z]"),
        (BOX.replace("[1, 2, 3]", f"[1, 2, 1{'0' * 400}]"), "size: [1, 2, 10000"),
        (BOX.replace('"box"', '"bx"'), ":3: [[part]] 1: shape: did you mean box?"),
        (BOX.replace('"box"', "[]"), ":3: [[part]] 1: shape: it is one of box, cylinder, sphere, mesh"),
        (BOX + "radius = 3", ":6: [[part]] 1: radius: a shape of kind box has size"),
        (BOX + "dense = 3", ":6: [[part]] 1: dense: there are name, shape"),
        (BOX.replace('"a"', '"2a"'), ":2: [[part]] 1: name: a letter, then"),
        (BOX.replace('"a"', '"floor"'), ":2: [[part]] 1: name: floor is the name of another"),
        (BOX + BOX, ":7: [[part]] 2: name: a is the name of another"),
        (BOX.replace("at = [0, 0, 0]", "at = [0, 0]"), ":5: [[part]] 1: at: [0, 0]: [X, Y, Z] in mm, or"),
        (BOX + "mass = 0", ":6: [[part]] 1: mass: a mass is more than 0"),
        (BOX + 'colour = "pink"', ":6: [[part]] 1: colour: one of red"),
        (BOX + "grasp = [3]", ":6: [[part]] 1: grasp: a list of at most 20 places"),
        (BOX + "grasp = [{at = [0, 0, 0]}]", ":6: [[part]] 1: grasp: width: it is missing"),
        (BOX.replace('"box"', '"mesh"').replace("size = [1, 2, 3]", "file = 3"), "file: the name of an STL"),
        (BOX.replace('"box"', '"mesh"').replace("size = [1, 2, 3]", 'file = "no.stl"'), ":4: [[part]] 1: file: no.stl"),
        (BEAM, "[[sensor]] 1: signal: it is missing"),
        (BEAM + "signal = 3", ":6: [[sensor]] 1: signal: 3 is no input: a sensor sets one of 1001 to 1512"),
        (BEAM + "signal = 1001\nsize = [1, 1, 1]", "size: a sensor of kind beam has from, to, radius"),
        (
            f"{BEAM}signal = 1001\n{BEAM}signal = -1001",
            ":12: [[sensor]] 2: signal: 1001 is set by [[sensor]] 1",
        ),
        (BEAM + "signal = 1001\n[hand]\nsignal = 1001", ":8: [hand] signal: 1001 is set by [[sensor]] 1 already"),
        ("hand = 3", ":1: hand: write [hand]"),
        ("floor = true", ":1: floor: a height"),
        ('[[feeder]]\nwhen = 3\nparts = ["b"]', ":3: [[feeder]] 1: parts: no part is called b"),
        (BOX + '[[feeder]]\nwhen = 3\nparts = ["a", "a"]', ":8: [[feeder]] 1: parts: a is fed already"),
        ("[[feeder]]\nwhen = 3\nparts = []", ":3: [[feeder]] 1: parts: a list of names"),
        ("[[sink]]\nwhen = 3\nat = [0, 0, 0]", ":1: [[sink]] 1: size: it is missing"),
        (
            '[[sensor]]\nname = "s"\nsignal = 1001\nkind = "proximity"\n'
            "at = [0, 0, 0]\ndirection = [0, 0, 0]\nrange = 1",
            ":6: [[sensor]] 1: direction: [0, 0, 0] has no direction",
        ),
    ],
)
def test_a_scene_that_is_wrong_says_where(text: str, told: str) -> None:
    with pytest.raises(FileDamaged) as refused:
        parse_cell(text, "my.toml")
    assert told in refused.value.detail
    assert refused.value.detail.startswith("my.toml:")
    assert "\n" not in refused.value.detail, "one mistake is told once"


# --- meshes ----------------------------------------------------------------------------------------------------------


@pytest.fixture
def trimesh() -> Any:
    """The module, which takes a second to load: not where these tests are only collected."""
    return import_module("trimesh")


def mesh_cell(folder: Path, name: str, more: str = "") -> Path:
    path = folder / "cell.toml"
    path.write_text(f'[[part]]\nname = "a"\nshape = "mesh"\nfile = "{name}"\nat = [0, 0, 0]\n{more}', encoding="utf-8")
    return path


@pytest.mark.parametrize("name", ["a.stl", "a.obj", "a.glb"])
def test_a_convex_mesh_is_read_in_its_units(tmp_path: Path, name: str, trimesh: Any) -> None:
    metres = 1.0 if name.endswith("glb") else 1000.0
    trimesh.creation.box((0.02 * metres, 0.04 * metres, 0.06 * metres)).export(tmp_path / name)
    shape = read_cell(str(mesh_cell(tmp_path, name))).scene.parts[0].shape
    assert isinstance(shape, MeshShape)
    (piece,) = shape.pieces
    assert sorted(tuple(round(x, 8) for x in point) for point in piece) == [
        (x, y, z) for x in (-0.01, 0.01) for y in (-0.02, 0.02) for z in (-0.03, 0.03)
    ]


def test_a_concave_mesh_is_refused_and_its_pieces_are_read(tmp_path: Path, trimesh: Any) -> None:
    base, wall = trimesh.creation.box((40, 40, 10)), trimesh.creation.box((10, 40, 40))
    wall.apply_translation((15, 0, 25))
    trimesh.util.concatenate([base, wall]).export(tmp_path / "angle.stl")
    with pytest.raises(FileDamaged, match=r"cell.toml:4: .*file: .*angle.stl is concave; give it as convex pieces"):
        read_cell(str(mesh_cell(tmp_path, "angle.stl")))
    trimesh.Scene([base, wall]).export(tmp_path / "angle.glb")
    shape = read_cell(str(mesh_cell(tmp_path, "angle.glb", "scale = 0.001"))).scene.parts[0].shape
    assert isinstance(shape, MeshShape)
    assert [len(piece) for piece in shape.pieces] == [8, 8]


def test_meshes_that_are_flat_fine_or_too_many_are_refused(
    tmp_path: Path, trimesh: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    flat = trimesh.Trimesh([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)])
    flat.export(tmp_path / "flat.stl")
    with pytest.raises(FileDamaged, match=r"flat.stl is flat; give a solid"):
        read_cell(str(mesh_cell(tmp_path, "flat.stl")))
    trimesh.creation.icosphere(2).export(tmp_path / "ball.stl")
    monkeypatch.setattr(mesh_file, "MOST_POINTS", 100)
    with pytest.raises(FileDamaged, match=r"ball.stl has 162 points; simplify it"):
        read_cell(str(mesh_cell(tmp_path, "ball.stl")))


def test_a_small_file_that_claims_a_huge_mesh_is_refused(tmp_path: Path, trimesh: Any) -> None:
    content = bytearray(trimesh.creation.box().export(file_type="glb"))
    at = content.index(b'"count":') + 8
    content[at : at + 2] = b"9e"  # the length of the JSON part stays
    (tmp_path / "bomb.glb").write_bytes(bytes(content).replace(b'"count":9e', b'"count":99', 1))
    with pytest.raises(FileDamaged, match=r"bomb.glb"):
        read_cell(str(mesh_cell(tmp_path, "bomb.glb")))


def test_without_trimesh_one_line_says_how_to_install_it(
    tmp_path: Path, trimesh: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    trimesh.creation.box().export(tmp_path / "a.stl")
    monkeypatch.setitem(__import__("sys").modules, "trimesh", None)
    with pytest.raises(
        FileDamaged, match=r"meshes need trimesh, which is not installed; .* install pillow pycollada trimesh"
    ) as refused:
        read_cell(str(mesh_cell(tmp_path, "a.stl")))
    assert "\n" not in refused.value.detail


def test_a_dae_file_needs_one_more_package(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(__import__("sys").modules, "collada", None)
    assert [mesh_file.missing_package(kind) for kind in ("stl", "dae")] == ["", "pycollada"]


def test_large_meshes_and_many_meshes_are_refused(
    tmp_path: Path, trimesh: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in "abc":
        trimesh.creation.box((10, 10, 10)).export(tmp_path / f"{name}.stl")
    parts = "".join(
        f'[[part]]\nname = "{name}"\nshape = "mesh"\nfile = "{name}.stl"\nat = [0, 0, 0]\n' for name in "abc"
    )
    path = str(tmp_path / "cell.toml")
    monkeypatch.setattr(scene_file, "MOST_MESH_BYTES", 2 * (tmp_path / "a.stl").stat().st_size)
    with pytest.raises(FileDamaged, match=r":14: \[\[part\]\] 3: file: .*c.stl: 684 bytes; at most 0 are read"):
        parse_cell(parts, path)
    monkeypatch.setattr(scene_file, "LARGEST_MESH", 100)
    with pytest.raises(FileDamaged, match=r":4: \[\[part\]\] 1: file: .*a.stl: 684 bytes; at most 100 are read"):
        parse_cell(parts, path)


# --- bounds ----------------------------------------------------------------------------------------------------------


def test_a_cell_that_is_too_long_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cell_file, "LARGEST", 100)
    with pytest.raises(FileDamaged, match="at most 100 are read"):
        parse_cell("#" * 101)
    (tmp_path / "long.toml").write_text("#" * 101, encoding="utf-8")
    with pytest.raises(NonexistentFile, match="more than 100 bytes"):
        read_cell(str(tmp_path / "long.toml"))


def test_a_cell_of_too_many_bodies_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(scene_file, "MOST_BODIES", 2)
    with pytest.raises(FileDamaged, match="3 parts and fixtures, at most 2 are read"):
        parse_cell(BOX * 3)


def test_of_many_mistakes_the_first_are_told() -> None:
    with pytest.raises(FileDamaged) as refused:
        parse_cell("[[part]]\n" * 100)
    lines = refused.value.detail.split("\n")
    assert len(lines) == 51
    assert lines[-1].endswith("there are more mistakes")
