"""Which arm a robot model gets, and the poses of the PUMA."""

from __future__ import annotations

from math import pi
from pathlib import Path
from random import Random

import pytest
from msgspec import structs

import vrs_cli.kinematics
from vrs_cli.kinematics.forms import arm_for
from vrs_cli.kinematics.joints import ALL, NONE
from vrs_cli.kinematics.model import Link
from vrs_cli.kinematics.model_data import from_dict, to_dict
from vrs_cli.kinematics.robot_file import ROBOTS, load_robot

PUMA = load_robot("puma560")
TEXT = Path(ROBOTS, "puma560.toml").read_text(encoding="utf-8")


def test_nest_is_folded_and_keeps_the_configuration_of_ready() -> None:
    arm = arm_for(PUMA)
    assert arm.configuration(PUMA.poses["nest"]) == arm.configuration(PUMA.poses["ready"])
    T = arm.forward(PUMA.poses["nest"])
    assert T.az == pytest.approx(-1.0)
    assert T.pz < -0.4


def test_models_that_differ_have_different_arms() -> None:
    assert arm_for(PUMA) is arm_for(from_dict(to_dict(PUMA)))
    assert arm_for(structs.replace(PUMA, upper=(1.0,) * 6)) is not arm_for(PUMA)


def test_a_wrist_whose_axes_do_not_meet_is_solved_by_numbers() -> None:
    crooked = arm_for(
        structs.replace(PUMA, links=(*PUMA.links[:3], structs.replace(PUMA.links[3], a=0.1), *PUMA.links[4:]))
    )
    assert crooked.ways == (NONE,)
    q = (0.1, -1.0, 1.2, 0.3, 0.5, -0.2)
    assert crooked.select(crooked.forward(q), (0.0, -1.1, 1.3, 0.2, 0.6, 0.0)) == pytest.approx(q, abs=1e-8)


def test_a_flange_beside_the_last_axis_is_still_a_spherical_wrist() -> None:
    beside = arm_for(structs.replace(PUMA, links=(*PUMA.links[:5], Link(0.1, 0.05625, 0.0))))
    assert beside.ways == ALL
    q = (0.1, -1.0, 1.2, 0.3, 0.5, -0.2)
    assert beside.inverse_branch(beside.forward(q), beside.configuration(q), q) == pytest.approx(q, abs=1e-12)


def test_links_without_a_closed_form_are_an_arm_all_the_same(tmp_path: Path) -> None:
    path = tmp_path / "bent.toml"
    path.write_text(TEXT.replace("alpha = 90.0", "alpha = 80.0"))
    assert arm_for(load_robot(path)).method == "damped least squares within the limits"


@pytest.mark.parametrize("name", sorted(path.stem for path in Path(ROBOTS).glob("*.toml")))
def test_how_far_from_singular_is_a_part_of_the_most(name: str) -> None:
    arm, random = arm_for(load_robot(name)), Random(4)
    for _ in range(20):
        q = tuple(random.uniform(low, high) for low, high in zip(arm.model.lower, arm.model.upper, strict=True))
        assert all(0.0 <= part <= 1.0 for part in arm.singularity(q))
    bent = arm_for(structs.replace(PUMA, links=(*PUMA.links[:4], Link(0.1, 0.0, pi / 2), PUMA.links[5])))
    assert all(0.0 <= part <= 1.0 for part in bent.singularity(PUMA.poses["ready"]))


@pytest.mark.parametrize("robot", ["puma560", "cobra600", "so100", "planar3"])
def test_another_configuration_is_spoken_of_where_there_is_one(robot: str) -> None:
    arm = arm_for(load_robot(robot))
    outside = tuple(high + 0.1 for high in arm.model.upper)
    words = str(arm._joint_refusal(outside, ""))
    assert ("no other configuration" in words) == (len(arm.ways) > 1)
    assert "say LEFTY first" in str(arm._joint_refusal(outside, "say LEFTY first"))
    assert "no other configuration" not in str(arm._joint_refusal(outside, "say LEFTY first"))


FOLDER = Path(vrs_cli.kinematics.__file__).parent
FORMS = sorted(path.parent.name for path in FOLDER.glob("*/arm.py"))
# the words of one, the lines of the other
MADE_OF = {"wrist_circle": ("numeric", "spherical_wrist"), "spherical_shoulder": ("numeric",)}


@pytest.mark.parametrize("form", FORMS)
def test_a_closed_form_knows_no_other(form: str) -> None:
    assert len(FORMS) == 6
    others = set(FORMS) - {form, *MADE_OF.get(form, ())}
    for path in (FOLDER / form).glob("*.py"):
        text = path.read_text(encoding="utf-8")
        assert not [other for other in others if f"kinematics.{other}" in text], path
        assert "kinematics.forms" not in text
