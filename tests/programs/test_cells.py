"""Samples with a cell do with its parts what they say; with a part 50 mm beside its place they do not."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from math import atan2, cos, hypot, sin
from pathlib import Path

import pytest
from msgspec import structs

from tests.interfaces.terminals import RecordingTerminal
from vrs_cli.errors import NonexistentFile
from vrs_cli.files.cell_file import read_cell
from vrs_cli.interfaces.session.session import Session
from vrs_cli.kinematics.transform import position
from vrs_cli.language.run.signals import Cell
from vrs_cli.world.course import World, WorldCourse

PROGRAMS = Path(__file__).parents[2] / "programs"
Places = Mapping[str, tuple[tuple[float, float, float], str]]  # of parts: X, Y, Z [mm], and what they stand on

ANGLE = atan2(50, 150)  # of the pallet
PALLET = {
    f"part.{4 * row + column + 1}": (
        (
            -200 + 60 * column * cos(ANGLE) - 60 * row * sin(ANGLE),
            430 + 60 * column * sin(ANGLE) + 60 * row * cos(ANGLE),
            -250.0,
        ),
        "pallet",
    )
    for row in range(3)
    for column in range(4)
}
ENDS: Mapping[str, Places] = {
    "pick_and_place": {"box": ((300.0, 450.0, -200.0), "stand")},
    "palletize": PALLET,
    "hanoi": {
        f"disc.{disc}": ((150.0, 480.0, -250.0 + 20 * (4 - disc)), f"disc.{disc + 1}" if disc < 4 else "place.3")
        for disc in (1, 2, 3, 4)
    },
    "sorting": {
        "nut.1": ((-200.0, 500.0, -220.0), "bin.1"),
        "bolt": ((-80.0, 500.0, -220.0), "bin.2"),
        "nut.2": ((-200.0, 500.0, -180.0), "nut.1"),
        "scrap": ((40.0, 500.0, -220.0), "bin.3"),
    },
}


@cache
def ran(name: str) -> Session:
    session = Session(RecordingTerminal())
    session.load_text((PROGRAMS / f"{name}.v2").read_text(encoding="utf-8"))
    result = session.execute(next(iter(session.environment.programs.values())).name)
    assert result.fault is None
    return session


def course(name: str, cell: Cell) -> WorldCourse:
    engine = ran(name).engine
    return World(engine.arm, cell).course(engine.timeline)


def faults(course: WorldCourse, ends: Places) -> list[str]:
    """The parts that are not where they should be."""
    states = {name: course.state(name, course.timeline.end) for name in ends}
    return [
        name
        for name, (place, on) in ends.items()
        if states[name].on != on
        or any(abs(1000 * a - b) > 0.1 for a, b in zip(position(states[name].pose), place, strict=True))
    ]


def moved(cell: Cell, part: str, x: float, y: float) -> Cell:
    """The same cell with one part elsewhere [m], where its feeder has no place for it."""
    parts = [
        structs.replace(
            one,
            T_world_part=one.T_world_part._replace(px=one.T_world_part.px + x, py=one.T_world_part.py + y),
        )
        if one.name == part
        else one
        for one in cell.scene.parts
    ]
    return structs.replace(cell, scene=structs.replace(cell.scene, parts=tuple(parts)))


def test_a_sample_is_found_by_its_name_and_a_file_of_that_name_comes_first(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    name = next(iter(ENDS))
    assert read_cell(name) == read_cell(f"{name}.toml") == read_cell(str(PROGRAMS / f"{name}.toml"))
    (tmp_path / name).write_text("[signals]\npart = 1001\n")
    assert read_cell(name).scene is None or not read_cell(name).scene.parts
    with pytest.raises(NonexistentFile):
        read_cell("no_such_cell")


@pytest.mark.parametrize("name", ENDS)
def test_at_the_end_each_part_is_in_its_place(name: str) -> None:
    found = course(name, read_cell(str(PROGRAMS / f"{name}.toml")))
    assert faults(found, ENDS[name]) == []
    assert found.notes == (), "nothing falls, and no hand closes on nothing"
    assert found.parts() == tuple(part.name for part in read_cell(str(PROGRAMS / f"{name}.toml")).scene.parts)
    assert hypot(*position(found.state(next(iter(ENDS[name])), 0.0).pose)) > 0.1


@pytest.mark.parametrize("name", ENDS)
def test_with_a_part_50_mm_beside_its_place_it_is_not(name: str) -> None:
    cell = read_cell(str(PROGRAMS / f"{name}.toml"))
    for part in list(ENDS[name])[:3]:
        for x, y in ((0.05, 0.0), (0.0, -0.05)):
            found = course(name, moved(cell, part, x, y))
            assert part in faults(found, ENDS[name])
