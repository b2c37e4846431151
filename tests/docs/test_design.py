"""docs/design.md is true: the floors are those that the imports keep, and what it names is there."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from docs.make_files import with_files
from docs.make_rooms import IMAGE, ROOMS, picture
from tests.test_architecture import FLOORS, INNER_FLOORS

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "design.md").read_text(encoding="utf-8")
UNTOLD = {"version", "extras", "hatch_build", "__main__"}  # floors of one small file
PATHS = sorted(set(re.findall(r"`((?:vrs_cli|tests|benchmarks|[a-z]+)/[\w/.]*)`", PAGE)))
ROWS = re.findall(r"^\| ([^|]+) \| ([^|]+) \| `([^|]+)` \|$", PAGE, re.MULTILINE)


def test_the_picture_has_all_floors_in_their_order() -> None:
    picture = PAGE.split("```text\n")[1].split("```")[0]
    told = [line.split()[0].removesuffix("/").removesuffix(".py") for line in picture.splitlines()]
    assert told == [floor for floor in reversed(FLOORS) if floor not in UNTOLD]


def test_the_drawing_has_all_floors_and_is_of_now() -> None:
    assert {folder for room in ROOMS for folder in room.folders} == set(FLOORS) - UNTOLD - {"errors", "page"}
    assert IMAGE.read_text(encoding="utf-8") == picture(), "draw it again: python -m docs.make_rooms"


def test_the_list_of_files_is_of_now() -> None:
    assert with_files(PAGE) == PAGE, "make it again: python -m docs.make_files"


@pytest.mark.parametrize("folder", INNER_FLOORS)
def test_inner_floors_are_named_in_their_order(folder: str) -> None:
    places = [PAGE.index(f"`{floor}/`") for floor in INNER_FLOORS[folder]]
    assert places == sorted(places)


def test_every_place_is_there() -> None:
    floors = ("", "vrs_cli/", *(f"vrs_cli/{folder}/" for folder in INNER_FLOORS))
    assert not [path for path in PATHS if not any((ROOT / f"{floor}{path}").exists() for floor in floors)]


def test_every_example_is_where_the_table_says() -> None:
    in_ticks = r"`([\w/.]+/[\w/.]*)`"
    for what, place, example in [(row[0], place, row[2]) for row in ROWS for place in re.findall(in_ticks, row[1])]:
        here = ROOT / place
        files = sorted(here.rglob("*.*")) if here.is_dir() else [here]
        texts = [
            file.name + file.read_text(encoding="utf-8") for file in files if file.suffix in {".py", ".toml", ".ts"}
        ]
        assert any(example in text or Path(example).stem in text for text in texts), f"{what}: no {example} in {place}"


def test_the_table_is_read() -> None:
    assert len(ROWS) >= 12
