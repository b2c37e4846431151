"""The masses of a robot's file: read, kept in its plain data, and refused where they are wrong."""

from __future__ import annotations

from dataclasses import replace

import pytest

from vrs_cli.errors import FileDamaged
from vrs_cli.kinematics.link_data import LinkMasses, MassReader
from vrs_cli.kinematics.model_data import from_dict, to_dict
from vrs_cli.kinematics.robot_file import load_robot

HUMAN = MassReader("arm.toml", human=True)


def test_tables_become_masses() -> None:
    table = {"mass": 2, "centre": [10, 0, -20], "inertia": [0.1, 0.2, 0.25], "rotor": 1e-4, "gear": 100}
    (found,) = HUMAN.masses([table], 1)
    assert found == LinkMasses(2.0, (0.01, 0.0, -0.02), (0.1, 0.2, 0.25, 0.0, 0.0, 0.0), 1e-4, 100.0)
    (found,) = HUMAN.masses([{"mass": 1.0, "inertia": [1, 2, 3, 0.1, 0.2, 0.3]}], 1)
    assert found.inertia == (1.0, 2.0, 3.0, 0.1, 0.2, 0.3)


def test_masses_go_with_the_plain_data_of_a_robot() -> None:
    masses = (LinkMasses(2.0, (0.1, 0.0, 0.0), max_torque=5.0), LinkMasses())
    model = replace(load_robot("planar2"), masses=masses)
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
