"""Test the arm in the terminal."""

from __future__ import annotations

from functools import cache

import pytest
from msgspec.structs import replace

from tests.interfaces.monitor.test_pictures import session, shown
from vrs_cli.kinematics.robot_file import robot_names
from vrs_cli.render.arm_picture import BODIES, LOOKS, DrawnPart, arm_picture
from vrs_cli.render.blocks import PIPE, Page
from vrs_cli.render.colours import Ink
from vrs_cli.render.text import plain_text
from vrs_cli.values.replies import ArmPicture, PicturedBody

FINE = Page(80, colours=True, unicode=True, height=16)
OF_THE_ARM = [part for part in DrawnPart if part not in BODIES.values()]
SIZES = ((30, 10), (80, 16), (80, 24), (120, 40), (160, 50), (400, 100))


@cache
def moving(robot: str = "puma560") -> ArmPicture:
    return shown(session("OPENI", "DRIVE 2, 50 AT 0.2", "DRIVE 1, 60 AT 1.4", robot=robot), "SHOW AT 1.6")


def rows(picture: ArmPicture, page: Page = PIPE) -> list[str]:
    return [line.text for line in arm_picture(picture, page)]


def inks(picture: ArmPicture, page: Page = FINE) -> set[Ink]:
    drawn = list(arm_picture(picture, page))[2:-1]
    return {ink for line in drawn for text, ink in line.pieces if text.strip()}


@pytest.mark.parametrize(("width", "height"), SIZES)
@pytest.mark.parametrize("robot", robot_names())
def test_it_fits_and_uses_the_page(robot: str, width: int, height: int) -> None:
    drawn = rows(moving(robot), Page(width, height=height, unicode=True, colours=True))
    assert len(drawn) <= height
    assert max(len(row.rstrip()) for row in drawn) <= width
    columns = [column for row in drawn[2:-1] for column, mark in enumerate(row) if mark != " "]
    across = (max(columns) - min(columns) + 1) / width
    assert across > 0.85 or len(drawn) >= height - 2, "either the width or the height is filled"


def test_on_a_pipe_it_is_plain_and_the_same_each_time() -> None:
    text = plain_text(moving())
    assert text == plain_text(moving())
    assert text.isascii()
    assert all(len(row) <= 80 for row in text.split("\n"))
    letters = {LOOKS[part].letter for part in OF_THE_ARM}
    assert letters <= set(text)


def test_all_parts_have_their_colours() -> None:
    assert inks(moving()) == {LOOKS[part].ink for part in OF_THE_ARM}


def test_bodies_of_the_cell_are_drawn_and_named() -> None:
    cube = tuple((0.3 + x, -0.4 + y, 0.2 + z) for x in (0.0, 0.2) for y in (0.0, 0.2) for z in (0.0, 0.2))
    for kind, part in BODIES.items():
        drawn = rows(replace(moving(), bodies=(PicturedBody(kind, cube),)))
        assert LOOKS[part].letter in "".join(drawn[2:-1])
        assert f"{LOOKS[part].letter} {LOOKS[part].name}" in drawn[-1] or len(drawn[-1]) == 80
    assert rows(replace(moving(), bodies=())) == rows(moving())


def test_at_rest_there_is_neither_a_plan_nor_a_target() -> None:
    still = shown(session("DRIVE 1, 60"), "SHOW")
    assert not {LOOKS[DrawnPart.PLANNED].ink, LOOKS[DrawnPart.TARGET].ink} & inks(still)
    legend = rows(still)[-1]
    assert "past" in legend
    assert "planned" not in legend


def test_braille_without_colours_where_there_are_none() -> None:
    drawn = "".join(rows(moving(), Page(80, unicode=True, height=16))[2:-1])
    assert {mark for mark in drawn if mark != " "} <= {chr(code) for code in range(0x2801, 0x2900)}


def test_it_says_when_what_and_where() -> None:
    first = rows(moving())[0]
    assert first.startswith("At 1.600 s  X ")
    assert first.endswith(" mm  DRIVE 1, 60 AT 1.4")


def test_an_arm_that_only_moves_in_a_plane_is_seen_from_above_alone() -> None:
    assert rows(moving("planar2"))[1].strip() == "from above (X, Y)"
    assert rows(moving("cobra600"))[1].split() == ["from", "the", "side", "(X,", "Z)", "from", "above", "(X,", "Y)"]


@pytest.mark.parametrize("robot", robot_names())
def test_the_scale_is_true(robot: str) -> None:
    """Compare the scale bar with the reach, to the precision of cells."""
    picture = moving(robot)
    drawn = rows(picture, Page(160, height=60, unicode=True))
    bar = drawn[-1][: drawn[-1].index("┤") + 1]
    metres = float(drawn[-1][len(bar) :].split()[0]) / 1000.0
    above = drawn[1].index("from above")
    columns = [k for row in drawn[2:-1] for k, mark in enumerate(row) if mark != " " and k >= above]
    across = max(p[0] for p in picture.reach) - min(p[0] for p in picture.reach)
    assert (max(columns) - min(columns) + 1) * metres / len(bar) == pytest.approx(across, rel=0.15)


def test_the_picture_stands_while_the_arm_moves() -> None:
    """The reach is drawn in the same cells at each time."""
    of = session("DRIVE 1, 60 AT 1", "DRIVE 3, 40 AT 2")
    seen = []
    for t in (0.0, 1.3, 2.2, 9.0):
        drawn = list(arm_picture(shown(of, f"SHOW AT {t}"), FINE))
        top = next(line for line in drawn[2:] if line.text.strip())
        seen.append((len(drawn), drawn[1].text, top.text, drawn[-1].text.split("mm")[0]))
    assert len({one[0] for one in seen}) == 1
    assert len({one[3] for one in seen}) == 1
