"""The file of a cell, and what it does to programs."""

from __future__ import annotations

from importlib import import_module
from math import radians
from pathlib import Path
from typing import Any

import pytest

from tests.interfaces.terminals import RecordingTerminal
from tests.render.test_layout import drawn
from vrs_cli.errors import FileDamaged, NonexistentFile
from vrs_cli.files import cell_file, mesh_file
from vrs_cli.files.cell_file import parse_cell, read_cell
from vrs_cli.interfaces.session.session import Session
from vrs_cli.interfaces.tasks.limits import Limits
from vrs_cli.kinematics.transform import from_oat, translation
from vrs_cli.values.replies import SignalTable
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

CELL = """
[signals]
feeder.go = 3
"part.there" = 1003
camera.trigger = 4
camera.ready = 1004

[[follow]]
when = "feeder.go"
set = "part.there"
after = 0.8

[[follow]]
when = "-feeder.go"
set = -1003

[[follow]]
when = "camera.trigger"
set = "camera.ready"
after = 0.25
lasting = 0.5
variables = ["found.x", "$kind"]
rows = [[400, "nut"], [420.5, "bolt"]]
{more}
"""
PROGRAM = """
.PROGRAM main()
    FOR i = 1 TO 3
        SIGNAL 3
        WAIT SIG(1003)
        TYPE "part ", /F4.2, TIME
        SIGNAL 4
        WAIT SIG(1004)
        TYPE $kind, /F7.1, found.x, /F6.2, TIME
        SIGNAL -4, -3
        WAIT SIG(-1003, -1004)
        TYPE "empty ", /F4.2, TIME
    END
.END
"""


def session(more: str = "") -> Session:
    made = Session(RecordingTerminal(), limits=Limits(max_time=20.0))
    made.driver.surround(parse_cell(CELL.replace("{more}", more)))
    made.load_text(PROGRAM)
    return made


def test_inputs_follow_outputs_after_a_time() -> None:
    result = session("again = true").execute("main")
    assert result.fault is None
    assert result.typed == (
        "part 0.80",
        "nut  400.0  1.05",
        "empty 1.55",
        "part 2.35",
        "bolt  420.5  2.60",
        "empty 3.10",
        "part 3.90",
        "nut  400.0  4.15",
        "empty 4.65",
    )


def test_the_same_cell_gives_the_same_timeline() -> None:
    first, second = (session("again = true").execute("main").typed for _ in range(2))
    assert first == second


def test_after_the_last_row_nothing_follows() -> None:
    fault = session().execute("main").fault
    assert fault is not None
    assert "waits for SIG(1004) (1004 is camera.ready)" in fault.message


def test_signals_are_shown_by_their_names() -> None:
    made = session()
    made.perform("SIGNAL 3")
    made.perform("IO 1")
    assert isinstance(made.terminal, RecordingTerminal)
    (table,) = (one for one in made.terminal.replies if isinstance(one, SignalTable))
    assert table.banks[0].names == {3: "feeder.go", 4: "camera.trigger"}
    shown = drawn(table, 80)
    assert "3  feeder.go       on" in shown
    assert "4  camera.trigger  off" in shown
    made.perform("WATCH SIG(1003)")
    assert made.tasks.watches[0].text == "SIG(1003) (1003 is part.there)"


def test_what_the_cell_fills_has_a_value() -> None:
    made = Session(RecordingTerminal())
    assert [one.detail for one in made.load_text(PROGRAM)] == [
        "$kind is given a value nowhere",
        "found.x is given a value nowhere",
    ]
    made.driver.surround(parse_cell(CELL.replace("{more}", "")))
    assert made.load_text(PROGRAM) == ()
    assert "found.x" not in made.environment.kinds, "it has none before the camera has found something"


def test_at_the_prompt_time_brings_what_follows() -> None:
    made = session()
    made.perform("SIGNAL 3")
    assert not made.environment.signals.read(1003)
    made.perform("DELAY 1")
    assert made.environment.signals.read(1003)


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("[signals", "a table declaration"),
        (f"a = {'1' * 5000}", "a cell is a TOML file"),
        (f"a = {'[' * 5000}", "a cell is a TOML file"),
        ("[signls]\na = 1", ":1: signls: did you mean signals?"),
        ("[signals]\n\nb = 7000", ":3: b: 7000 is no signal"),
        ("[signals]\nb = true", ":2: b: True is no signal"),
        ("[signals]\na.ab = 3\na.b = 0", ":3: a.b: 0 is no signal"),
        ("[signals.part]\nthere = 1003\ngone = 1003", ":3: part.gone: signal 1003 is called part.there already"),
        (
            '[signals]\npart = 1001\n[[follow]]\nwhen = "prat"\nset = 1002',
            ":4: [[follow]] 1: when: no signal is called prat (did you mean part?)",
        ),
        (
            "[[follow]]\nwhen = 1\nset = 1001\n\n[[follow]]\nwhen = 7000\nset = 1002",
            ":6: [[follow]] 2: when: 7000 is no signal",
        ),
        ("follow = [{when = 1, set = 7000}]", ":1: [[follow]] 1: set: 7000 is no signal"),
        ("[[follow]]\nset = 1001", ":1: [[follow]] 1: when: it is missing"),
        ("[[follow]]\nwhen = 1\nset = 3", ":3: [[follow]] 1: set: an output is the program's"),
        ("[[follow]]\nwhen = 1", ":1: [[follow]] 1: set: nothing follows"),
        ("[[follow]]\nwhen = 1\nset = 1001\nafter = -1", ":4: [[follow]] 1: after: -1 is no time"),
        ("[[follow]]\nwhen = 1\nset = 1001\nafter = true", "after: True is no time"),
        ("[[follow]]\nwhen = 1\nset = 1001\nafter = nan", "after: nan is no time"),
        ("[[follow]]\nwhen = 1\nset = 1001\nafterr = 1", ":4: [[follow]] 1: afterr: did you mean after?"),
        ('[[follow]]\nwhen = 1\nset = 1001\nagain = "no"', "again: 'no' is neither true nor false"),
        ('[[follow]]\nwhen = 1\nvariables = ["x"]', "variables and rows belong together"),
        ("[[follow]]\nwhen = 1\nrows = [[1]]", "variables and rows belong together"),
        ('[[follow]]\nwhen = 1\nvariables = ["x"]\nrows = [[1, 2]]', "row 1: a value for each of x is wanted"),
        ('[[follow]]\nwhen = 1\nvariables = ["x"]\nrows = [1]', "rows: a list of rows"),
        ('[[follow]]\nwhen = 1\nvariables = ["x"]\nrows = [[{}]]', "row 1"),
        ('[[follow]]\nwhen = 1\nvariables = ["x"]\nrows = [[nan]]', "row 1"),
        (f'[[follow]]\nwhen = 1\nvariables = ["x"]\nrows = [[1{"0" * 400}]]', "row 1"),
        ('[[follow]]\nwhen = 1\nvariables = ["$s"]\nrows = [[1]]', "row 1"),
        (f'[[follow]]\nwhen = 1\nvariables = ["$s"]\nrows = [["{"s" * 129}"]]', "row 1"),
        ('[[follow]]\nwhen = 1\nvariables = "x"\nrows = [[1]]', ":3: [[follow]] 1: variables: a list of names"),
        ('[[follow]]\nwhen = 1\nvariables = ["2x"]\nrows = [[1]]', ":3: [[follow]] 1: variables: '2x' is no name"),
        ('[[follow]]\nwhen = 1\nvariables = ["#p"]\nrows = [[1]]', "'#p' is no name"),
        ('[[follow]]\nwhen = 1\nvariables = ["x[1]"]\nrows = [[1]]', "'x[1]' is no name"),
        ('[[follow]]\nwhen = 1\nvariables = ["to"]\nrows = [[1]]', "TO is a word of the language"),
        ("follow = 3", ":1: follow: write [[follow]]"),
        ("[[follow]]\nwhen = 1\nset = 1001\n[signals.follow]\na = 3\nb = 3", ":6: follow.b: signal 3 is called"),
        ("signals = 3", ":1: signals: write [signals]"),
    ],
)
def test_a_cell_that_is_wrong_says_where(text: str, told: str) -> None:
    with pytest.raises(FileDamaged) as refused:
        parse_cell(text, "my.toml")
    assert told in f"{refused.value.detail} ({refused.value.hint})"
    assert refused.value.detail.startswith("my.toml:")
    assert "\n" not in refused.value.detail, "one mistake is told once"


def test_a_cell_that_is_not_there() -> None:
    with pytest.raises(NonexistentFile):
        read_cell("/never/there.toml")


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
    assert (box.colour, box.mass, box.grasp) == (cell_file.COLOURS["red"], 0.2, (GraspPlace((0, 0, 0.02), 0.04),))
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
    monkeypatch.setattr(mesh_file, "MAX_PIECE_POINTS", 100)
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
    monkeypatch.setattr(cell_file, "MAX_ALL_MESH_BYTES", 2 * (tmp_path / "a.stl").stat().st_size)
    with pytest.raises(FileDamaged, match=r":14: \[\[part\]\] 3: file: .*c.stl: 684 bytes; at most 0 are read"):
        parse_cell(parts, path)
    monkeypatch.setattr(cell_file, "MAX_MESH_FILE_BYTES", 100)
    with pytest.raises(FileDamaged, match=r":4: \[\[part\]\] 1: file: .*a.stl: 684 bytes; at most 100 are read"):
        parse_cell(parts, path)


# --- bounds ----------------------------------------------------------------------------------------------------------


def test_a_cell_that_is_too_long_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cell_file, "MAX_CELL_CHARS", 100)
    with pytest.raises(FileDamaged, match="at most 100 are read"):
        parse_cell("#" * 101)
    (tmp_path / "long.toml").write_text("#" * 101, encoding="utf-8")
    with pytest.raises(NonexistentFile, match="more than 100 bytes"):
        read_cell(str(tmp_path / "long.toml"))


def test_a_cell_of_too_many_bodies_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cell_file, "MAX_BODIES", 2)
    with pytest.raises(FileDamaged, match="3 parts and fixtures, at most 2 are read"):
        parse_cell(BOX * 3)


def test_of_many_mistakes_the_first_are_told() -> None:
    with pytest.raises(FileDamaged) as refused:
        parse_cell("[[part]]\n" * 100)
    lines = refused.value.detail.split("\n")
    assert len(lines) == 51
    assert lines[-1].endswith("there are more mistakes")
