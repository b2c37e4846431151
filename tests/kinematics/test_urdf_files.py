"""URDF files as they come: what other readers take is taken, what cannot be gets a clear word."""

from __future__ import annotations

from math import degrees, pi
from pathlib import Path

import pytest

from tests.kinematics.test_urdf import ARM, XACRO, written
from vrs_cli.errors import FileDamaged
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.kinematics.urdf import tree

PLAIN = '<robot name="little">'


def test_prefixes_that_nobody_declares(tmp_path: Path) -> None:
    strange = ARM.replace("<limit", "<drake:acceleration value='3'/><limit").replace(
        "</robot>", "<sensor:camera/></robot>"
    )
    strange = strange.replace('effort="7"', 'effort="7" drake:effort="8"')
    assert strange.count("drake:") == 3
    assert load_robot(written(tmp_path, strange)) == load_robot(written(tmp_path, ARM, "plain.urdf"))


WRIST = '<robot name="wrist">{}</robot>'.format(
    "".join(
        f'<joint name="{i}" type="continuous"><parent link="{i}"/><child link="{i + 1}"/><axis xyz="{axis}"/></joint>'
        for i, axis in enumerate(("0 0 1", "0 1 0", "1 0 0"))
    )
)


@pytest.mark.parametrize("before", ["\n\n", "\ufeff", "<!-- made by hand -->\n"])
def test_a_declaration_that_is_not_at_the_start(tmp_path: Path, before: str) -> None:
    assert load_robot(written(tmp_path, before + ARM)) == load_robot(written(tmp_path, ARM, "plain.urdf"))


def test_names_with_line_ends(tmp_path: Path) -> None:
    text = (
        ARM.replace('name="lean"', 'name="le\nan"')
        .replace('link="two"', 'link="two&#10;"')
        .replace("little", "lit\ntle")
    )
    model = load_robot(written(tmp_path, text))
    assert model.name == "lit tle"
    assert model.origin is not None
    assert model.origin.joints == ("turn", "le an", "slide")


def test_two_joints_of_one_name(tmp_path: Path) -> None:
    with pytest.raises(FileDamaged, match=r"two joints that move are called 'turn' \(give each its own name"):
        load_robot(written(tmp_path, ARM.replace('"lean"', '"turn"')))
    assert load_robot(written(tmp_path, ARM.replace('"camera"', '"grip"'))).joint_count == 3  # these do not move


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (
            'xyz="0 0 0.1"',
            'xyz="0 0 ${height}"',
            r"joint turn: origin xyz is '0 0 \$\{height\}' \(expand it first: xacro",
        ),
        ('lower="-1"', 'lower="${-pi/2}"', r"joint lean: limit lower is '\$\{-pi/2\}' \(expand it first: xacro"),
        ('name="lean"', 'name="${prefix}lean"', r"a joint is called '\$\{prefix\}lean' \(expand it first: xacro"),
        ('link="two"', 'link="${prefix}two"', r"its child link is '\$\{prefix\}two' \(expand it first: xacro"),
    ],
)
def test_expressions_that_nobody_expanded(tmp_path: Path, old: str, new: str, message: str) -> None:
    with pytest.raises(FileDamaged, match=message):
        load_robot(written(tmp_path, ARM.replace(old, new)))


# --- limits ------------------------------------------------------------------------------------------------------

MINE = 'urdf = "little.urdf"\n[[joints]]\nname = "lean"\nlower = -60\nupper = 100\n'


@pytest.mark.parametrize(
    "limit",
    [
        "",
        '<limit velocity="3"/>',
        '<limit lower="-inf" upper="inf" velocity="inf"/>',
        '<limit lower="-1e16" upper="1e16" velocity="1e16"/>',
        '<limit lower="2" upper="-1" velocity="3"/>',
        '<limit lower="0" upper="0"/>',
    ],
)
def test_limits_are_given_in_a_toml_file_where_a_file_has_none_to_use(tmp_path: Path, limit: str) -> None:
    written(tmp_path, ARM.replace('<limit lower="-1" upper="2" velocity="3" effort="7"/>', limit))
    (tmp_path / "mine.toml").write_text(MINE, encoding="utf-8")
    model = load_robot(tmp_path / "mine.toml")
    assert (degrees(model.lower[1]), degrees(model.upper[1])) == pytest.approx((-60.0, 100.0))
    assert model.max_velocity[1] in (3.0, pytest.approx(pi / 2))


def test_one_limit_of_two_is_enough(tmp_path: Path) -> None:
    written(tmp_path, ARM.replace('lower="-1" ', ""))
    (tmp_path / "mine.toml").write_text(MINE.replace("upper = 100\n", ""), encoding="utf-8")
    model = load_robot(tmp_path / "mine.toml")
    assert (degrees(model.lower[1]), model.upper[1]) == (pytest.approx(-60.0), 2.0)
    with pytest.raises(
        FileDamaged, match=r"lean: limit has no lower \(give <limit .*, or lower in a TOML file beside it"
    ):
        load_robot(tmp_path / "little.urdf")


@pytest.mark.parametrize(
    ("limit", "ends"), [('lower="-inf" upper="2"', (-2.0 * pi, 2.0)), ('lower="-1" upper="1e16"', (-1.0, 2.0 * pi))]
)
def test_an_end_that_a_joint_has_is_kept_where_it_has_no_other(
    tmp_path: Path, limit: str, ends: tuple[float, float]
) -> None:
    model = load_robot(written(tmp_path, ARM.replace('lower="-1" upper="2"', limit)))
    assert (model.lower[1], model.upper[1]) == pytest.approx(ends)


def test_axes_that_all_meet_in_the_tip(tmp_path: Path) -> None:
    with pytest.raises(FileDamaged, match=r"axes all meet in the flange, which they do not move \(give links a length"):
        load_robot(written(tmp_path, WRIST))


@pytest.mark.parametrize("end", ["inf", "999999"])
def test_a_slide_without_an_end_needs_one(tmp_path: Path, end: str) -> None:
    written(tmp_path, ARM.replace('upper="0.25"', f'upper="{end}"'))
    with pytest.raises(
        FileDamaged, match=rf"slide: limit upper is {end} \(give <limit .*, or upper in a TOML file beside it"
    ):
        load_robot(tmp_path / "little.urdf")
    table = 'urdf = "little.urdf"\n[[joints]]\nname = "slide"\nupper = 300\n'
    (tmp_path / "mine.toml").write_text(table, encoding="utf-8")
    assert load_robot(tmp_path / "mine.toml").upper[2] == pytest.approx(0.3)  # mm, as a joint that slides has


def test_a_kind_that_the_file_does_not_have(tmp_path: Path) -> None:
    written(tmp_path)
    (tmp_path / "mine.toml").write_text(f'{MINE}kind = "prismatic"\n', encoding="utf-8")
    with pytest.raises(FileDamaged, match=r"joint lean is revolute in the URDF file \(leave out its kind"):
        load_robot(tmp_path / "mine.toml")


# --- macros ------------------------------------------------------------------------------------------------------

MACROS = f"""\
<robot name="macros" xmlns:xacro="{XACRO}">
  <xacro:arg name="side" default="left"/>
  <xacro:property name="reach" value="0.4"/>
  <xacro:include filename="$(find parts)/urdf/more.xacro"/>
  <xacro:swing name="$(arg side)_one" parent="base" child="a"/>
  <xacro:swing name="$(arg side)_two" parent="a" child="b"/>
  <xacro:swing name="$(arg side)_three" parent="b" child="c"/>
</robot>
"""
MORE = f"""\
<robot xmlns:xacro="{XACRO}">
  <xacro:macro name="swing" params="name parent child">
    <joint name="${{name}}" type="revolute">
      <parent link="${{parent}}"/><child link="${{child}}"/><origin xyz="${{reach}} 0 0"/><axis xyz="0 0 1"/>
      <limit lower="${{-pi/2}}" upper="${{pi/2}}" velocity="1"/>
    </joint>
  </xacro:macro>
</robot>
"""


def packaged(folder: Path) -> Path:
    for package, name, text in (("arms", "arm.urdf.xacro", MACROS), ("parts", "more.xacro", MORE)):
        (folder / package / "urdf").mkdir(parents=True)
        (folder / package / "urdf" / name).write_text(text, encoding="utf-8")
    return folder / "arms" / "urdf" / "arm.urdf.xacro"


def test_macros_are_expanded(tmp_path: Path) -> None:
    pytest.importorskip("xacro")
    model = load_robot(packaged(tmp_path))
    assert model.origin is not None
    assert model.origin.joints == ("left_one", "left_two", "left_three")
    assert model.upper == pytest.approx((pi / 2,) * 3)
    (tmp_path / "mine.toml").write_text(
        'urdf = "arms/urdf/arm.urdf.xacro"\nxacro = { side = "right" }\n', encoding="utf-8"
    )
    other = load_robot(tmp_path / "mine.toml")
    assert other.origin is not None
    assert other.origin.joints == ("right_one", "right_two", "right_three")


def test_macros_that_go_wrong(tmp_path: Path) -> None:
    pytest.importorskip("xacro")
    path = packaged(tmp_path)
    path.write_text(MACROS.replace("$(find parts)", "$(find nowhere)"), encoding="utf-8")
    with pytest.raises(FileDamaged, match=r"arm\.urdf\.xacro: xacro: .*nowhere|No such file"):
        load_robot(path)
    path.unlink()
    alone = tmp_path / "arm.urdf.xacro"
    alone.write_text(MACROS.replace("$(find parts)", "$(find nowhere)"), encoding="utf-8")
    with pytest.raises(
        FileDamaged, match=r"xacro: no folder above it, or beside .* is the package 'nowhere' \(put its"
    ):
        load_robot(alone)
    path.write_text(MACROS.replace('"0.4"', '"${len([1] * 10**9)}"'), encoding="utf-8")
    with pytest.raises(FileDamaged, match=r"arm\.urdf\.xacro: xacro: its macros take more than 1024 MB \(expand it"):
        load_robot(path)
    path.write_text(MACROS.replace("xacro:swing name", "xacro:swings name"), encoding="utf-8")
    with pytest.raises(FileDamaged, match=r"arm\.urdf\.xacro: xacro: .*swings"):
        load_robot(path)


def test_a_file_of_macros_alone(tmp_path: Path) -> None:
    pytest.importorskip("xacro")
    packaged(tmp_path)
    with pytest.raises(
        FileDamaged, match=r"it defines macros, and makes no joint of them \(give the file that includes"
    ):
        load_robot(tmp_path / "parts" / "urdf" / "more.xacro")


def test_the_command_is_told_where_macros_cannot_be_expanded(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tree, "find_spec", lambda _: None)
    with pytest.raises(
        FileDamaged, match=r"xacro is not installed \(.* install xacro, or expand it first: xacro .* > arm"
    ):
        load_robot(packaged(tmp_path))


def test_packages_are_looked_for_beside_the_file(tmp_path: Path) -> None:
    path = packaged(tmp_path)
    assert tree.package_folder(path, "arms") == tmp_path / "arms"
    assert tree.package_folder(path, "parts") == tmp_path / "parts"
    assert tree.package_folder(path, "arms_support") == tmp_path / "arms"  # the file's own, under another name
