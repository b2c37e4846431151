"""Tables of shapes: what they say, what is said of wrong ones, and the way out and back."""

from __future__ import annotations

import json
from math import cos, pi, sin
from pathlib import Path

import pytest
from msgspec import structs

from vrs_cli.errors import FileDamaged
from vrs_cli.kinematics.bodies import SHAPES, shapes_of
from vrs_cli.kinematics.link_data import (
    COLOURS,
    KINDS,
    Box,
    Capsule,
    Cylinder,
    LinkMasses,
    LinkShape,
    MassReader,
    MeshFile,
    Opening,
    Slab,
    opening_motion,
    rgb,
)
from vrs_cli.kinematics.model_data import from_dict, to_dict
from vrs_cli.kinematics.robot_file import ROBOTS, load_robot, robot_names
from vrs_cli.kinematics.transform import IDENTITY, from_oat, position, translation

ALL_KINDS = """
shapes = [
  { link = 0, kind = "box", size = [100, 200, 300], at = [1, 2, 3] },
  { link = 1, kind = "box", size = [100, 200, 300], at = [1, 2, 3, 90, -90, 30], colour = "#0080ff" },
  { link = 1, kind = "cylinder", from = [0, 0, 0], to = [0, 0, 250], radius = 40, colour = "dark" },
  { link = 1, kind = "cylinder", from = [0, 0, 0], to = [0, 0, 250], radius = [40, 20] },
  { link = 2, kind = "capsule", from = [0, 0, 0], to = [0, 0, 250], radius = 40 },
  { link = 2, kind = "capsule", from = [0, 0, 7], radius = 40 },
  { link = 2, kind = "slab", from = [0, 0, 0], to = [400, 0, 0], across = [0, 0, 1], radius = [80, 50], thickness = 6 },
  { link = 2, kind = "mesh", file = "meshes/tip.stl", scale = [0.001, 0.001, 0.001] },
  { link = 2, kind = "box", size = [1, 1, 1], opens = [20, 0, 0] },
  { link = 2, kind = "box", size = [1, 1, 1], opens = { turn = [0, 0, 90], point = [10, 0, 0] } },
  { link = 2, kind = "box", size = [1, 1, 1], opens = [{ slide = [5, 0, 0] }, { turn = [0, -90, 0] }] },
]
"""
PLANAR = Path(ROBOTS, "planar2.toml").read_text(encoding="utf-8")


def with_shapes(folder: Path, shapes: str) -> Path:
    path = folder / "arm.toml"
    path.write_text(shapes + PLANAR, encoding="utf-8")
    return path


def test_what_tables_say(tmp_path: Path) -> None:
    turned = from_oat(0.001, 0.002, 0.003, *(x * 3.141592653589793 / 180 for x in (90, -90, 30)))
    assert load_robot(with_shapes(tmp_path, ALL_KINDS)).shapes == (
        LinkShape(0, Box((0.1, 0.2, 0.3), translation(0.001, 0.002, 0.003))),
        LinkShape(1, Box((0.1, 0.2, 0.3), turned), "#0080ff"),
        LinkShape(1, Cylinder((0.0, 0.0, 0.0), (0.0, 0.0, 0.25), (0.04, 0.04)), "dark"),
        LinkShape(1, Cylinder((0.0, 0.0, 0.0), (0.0, 0.0, 0.25), (0.04, 0.02))),
        LinkShape(2, Capsule((0.0, 0.0, 0.0), (0.0, 0.0, 0.25), (0.04, 0.04))),
        LinkShape(2, Capsule((0.0, 0.0, 0.007), (0.0, 0.0, 0.007), (0.04, 0.04))),
        LinkShape(2, Slab((0.0, 0.0, 0.0), (0.4, 0.0, 0.0), (0.0, 0.0, 1.0), (0.08, 0.05), (0.006, 0.006))),
        LinkShape(2, MeshFile(str(tmp_path / "meshes/tip.stl"), scale=(0.001, 0.001, 0.001))),
        LinkShape(2, Box((0.001, 0.001, 0.001)), opens=(Opening((0.02, 0.0, 0.0)),)),
        LinkShape(2, Box((0.001, 0.001, 0.001)), opens=(Opening(turn=(0.0, 0.0, pi / 2), point=(0.01, 0.0, 0.0)),)),
        LinkShape(2, Box((0.001, 0.001, 0.001)), opens=(Opening((0.005, 0.0, 0.0)), Opening(turn=(0.0, -pi / 2, 0.0)))),
    )


def test_a_part_that_turns_goes_about_its_point() -> None:
    quarter = Opening(turn=(0.0, 0.0, pi / 2), point=(0.01, 0.0, 0.0))
    assert position(opening_motion((quarter,), 1.0)) == pytest.approx((0.01, -0.01, 0.0))
    assert position(opening_motion((Opening((0.0, 0.0, 0.3)), quarter), 0.5)) == pytest.approx(
        (0.01 - 0.01 * cos(pi / 4), -0.01 * sin(pi / 4), 0.15)
    )
    assert opening_motion((), 1.0) == IDENTITY


def test_the_way_out_and_back(tmp_path: Path) -> None:
    model = load_robot(with_shapes(tmp_path, ALL_KINDS))
    assert {shape["kind"] for shape in to_dict(model)["shapes"]} == set(KINDS)
    assert from_dict(json.loads(json.dumps(to_dict(model)))) == model


def test_built_in_robots_say_nothing_of_shapes_in_their_data() -> None:
    for name in robot_names():
        assert "shapes" not in to_dict(load_robot(name))


BOX, SLAB = 'link = 0, kind = "box", size = [1, 1, 1]', 'link = 0, kind = "slab", from = [0, 0, 0], to = [9, 0, 0]'
WRONG = {
    'link = 3, kind = "box", size = [1, 1, 1]': "link: 3 is none of this robot (give 0 for the base, or 1 to 2 ",
    "link = 0, size = [1, 1, 1]": 'kind: is missing (give "box", "cylinder", ',
    'link = 0, kind = "bax", size = [1, 1, 1]': "kind: 'bax' is none (give \"box\"",
    'link = 0, kind = "box"': "has no size",
    'link = 0, kind = "box", sise = [1, 1, 1]': "has an unknown key 'sise' (did you mean size?)",
    'link = 0, kind = "box", size = [1, 0, 1]': "size: 0 is not above zero (give a number above 0 in mm)",
    'link = 0, kind = "box", size = [1, 1]': "size: is not a list of 3 numbers (give [x, y, z] in mm)",
    f"{BOX}, at = [0, 0]": "at: is not a list of 6 numbers",
    f"{BOX}, opens = [1, 2]": "opens: is not a list of 3 numbers",
    f"{BOX}, opens = [{{ turn = 3 }}]": "opens 1: turn: is not a list of 3 numbers",
    f"{BOX}, opens = {{ turns = 3 }}": "opens 1: has an unknown key 'turns' (did you mean turn?)",
    f'{BOX}, colour = "creme"': "colour: 'creme' is none (give one of cream",
    'link = 0, kind = "cylinder", from = [1, 0, 0], to = [1, 0, 0], radius = 5': "from and to are one place",
    'link = 0, kind = "capsule", from = [1, 0, 0], radius = [1, 2, 3]': "radius: is a list of 3",
    f"{SLAB}, across = [2, 0, 0], radius = 5, thickness = 5": "across: does not lead across",
    f"{SLAB}, across = [0, 0, 1], radius = [5, 20], thickness = 5": "one of its two discs holds the other",
    'link = 0, kind = "mesh", file = 3': "file: 3 is not a text",
    'link = 0, kind = "mesh", file = "a.stl", scale = [1, 1, nan]': "scale: nan is not a number (give a number)",
}


@pytest.mark.parametrize("table", WRONG)
def test_what_is_said_of_a_wrong_table(tmp_path: Path, table: str) -> None:
    with pytest.raises(FileDamaged) as refused:
        load_robot(with_shapes(tmp_path, f"shapes = [{{ {table} }}]\n"))
    assert f"arm.toml: shape 1: {WRONG[table]}" in f"{refused.value}"


def test_shapes_that_are_no_list(tmp_path: Path) -> None:
    for text in ("shapes = 3\n", 'shapes = "box"\n', "shapes = { a = 1 }\n", "shapes = [3]\n"):
        with pytest.raises(FileDamaged, match=r"arm\.toml: shape"):
            load_robot(with_shapes(tmp_path, text))


@pytest.mark.parametrize("path", sorted(SHAPES.glob("*.toml")), ids=lambda path: path.stem)
def test_shapes_of_a_built_in_robot_are_those_of_its_file(path: Path) -> None:
    model = load_robot(path.stem)
    shapes = shapes_of(model)
    assert {shape.link for shape in shapes} == set(range(model.joint_count + 1)), "each link has some"
    careful = structs.replace(model, name="careful", linear_speed=0.01)
    assert shapes_of(careful) == shapes, "a robot with the same links looks the same"
    longer = structs.replace(model, links=(structs.replace(model.links[0], d=0.7), *model.links[1:]))
    assert shapes_of(longer) != shapes


def test_any_robot_has_shapes(tmp_path: Path) -> None:
    (tmp_path / "arm.toml").write_text(PLANAR.replace("a = 300.0", "a = 310.0"), encoding="utf-8")
    model = load_robot(tmp_path / "arm.toml")
    assert {shape.link for shape in shapes_of(model)} >= {0, 1, 2}
    own = load_robot(with_shapes(tmp_path, ALL_KINDS))
    assert shapes_of(own) == own.shapes


def test_colours() -> None:
    assert rgb("#0080ff") == (0, 128, 255)
    assert all(0 <= part <= 255 for name in COLOURS for part in rgb(name))


def test_a_rod_reaches_its_sleeve_however_far_it_slides(tmp_path: Path) -> None:
    text = Path(ROBOTS, "cobra600.toml").read_text(encoding="utf-8").replace("a = 325", "a = 330")
    path = tmp_path / "arm.toml"
    path.write_text(text.replace("lower = 0.0", "lower = -90.0"), encoding="utf-8")
    (rod,) = [shape.body for shape in shapes_of(load_robot(path)) if shape.link == 3 and shape.colour == "steel"]
    assert isinstance(rod, Cylinder)
    assert rod.start[2] < -0.21, "behind the joint, when the quill is far out"
    assert rod.end[2] > 0.09, "below it, when the quill is drawn in"


def test_an_arm_that_reaches_below_its_foot_stands_on_a_pedestal(tmp_path: Path) -> None:
    text = Path(ROBOTS, "puma560.toml").read_text(encoding="utf-8").replace("a = 431.8", "a = 440")
    (tmp_path / "arm.toml").write_text(text, encoding="utf-8")
    foot = [shape.body for shape in shapes_of(load_robot(tmp_path / "arm.toml")) if shape.link == 0]
    assert min(body.start[2] for body in foot if isinstance(body, Cylinder)) < -0.5


def test_the_colours_of_arms_in_pictures_stay() -> None:
    shown = {name: "#" + "".join(f"{part:02x}" for part in rgb(name)) for name in COLOURS}
    assert shown == {
        "cream": "#f0e8d4",
        "white": "#f0f1f3",
        "grey": "#b0b5bc",
        "dark": "#3e434a",
        "steel": "#9298a0",
        "orange": "#e27a2a",
        "blue": "#5486be",
        "red": "#be3e36",
        "yellow": "#ecbe3c",
        "green": "#5c9660",
    }


HUMAN = MassReader("arm.toml", human=True)


def test_tables_become_masses() -> None:
    table = {"mass": 2, "centre": [10, 0, -20], "inertia": [0.1, 0.2, 0.25], "rotor": 1e-4, "gear": 100}
    (found,) = HUMAN.masses([table], 1)
    assert found == LinkMasses(2.0, (0.01, 0.0, -0.02), (0.1, 0.2, 0.25, 0.0, 0.0, 0.0), 1e-4, 100.0)
    (found,) = HUMAN.masses([{"mass": 1.0, "inertia": [1, 2, 3, 0.1, 0.2, 0.3]}], 1)
    assert found.inertia == (1.0, 2.0, 3.0, 0.1, 0.2, 0.3)


def test_masses_go_with_the_plain_data_of_a_robot() -> None:
    masses = (LinkMasses(2.0, (0.1, 0.0, 0.0), max_torque=5.0), LinkMasses())
    model = structs.replace(load_robot("planar2"), masses=masses)
    assert from_dict(to_dict(model)).masses == masses
    assert "masses" not in to_dict(load_robot("planar2"))


@pytest.mark.parametrize(
    ("data", "told"),
    [
        (3, "[[masses]] table for each of the 1 links"),
        ([], "there are 0"),
        ([{"mas": 2}], "unknown key 'mas'"),
        ([{"mass": -1.0}], "below zero"),
        ([{"mass": float("nan")}], "not a number"),
        ([{"mass": 1, "centre": [1, 2]}], "in mm"),
        ([{"mass": 1, "inertia": [1, 2]}], "about the centre of mass"),
        ([{"mass": 1, "inertia": [1, -2, 1]}], "below zero"),
        ([{"gear": 0}], "not above zero"),
        ([{"max_torque": 0}], "not above zero"),
    ],
)
def test_mistakes_name_the_link_and_what_is_right(data: object, told: str) -> None:
    with pytest.raises(FileDamaged) as found:
        HUMAN.masses(data, 1)
    assert told in str(found.value)
    assert "arm.toml: masses" in str(found.value)
