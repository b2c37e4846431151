"""The strip of a timeline: each stretch where it is, each command where it begins, however many there are."""

from __future__ import annotations

import re
from xml.etree import ElementTree

import pytest
from msgspec import structs

from vrs_cli.api.robot import Robot
from vrs_cli.errors import TooLate
from vrs_cli.interfaces.port.preview import Expected, Previewed
from vrs_cli.trajectory.segment import Phase
from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.view3d.bar import FLAGGED, MARK, PHASE_COLOURS, UNCONFIRMED, Doubts, TimeSpan, segments_in, strip

LINES = "MOVE #PPOINT(10, -90, 90, 0, 0, 0)\nDELAY 1\nMOVE #PPOINT(20, -90, 90, 0, 0, 0)\nTYPE 1 < 2"


@pytest.fixture(scope="module")
def timeline() -> Timeline:
    robot = Robot()
    robot.prompt(LINES)
    return robot.timeline


def boxes(picture: str) -> list[tuple[float, float, str]]:
    """Begin and end [%], and what they are filled with."""
    found = re.findall(r'<rect x="([\d.]+)%" width="([\d.]+)%" height="14" fill="([^"]+)"', picture)
    return [(float(x), float(x) + float(width), fill) for x, width, fill in found]


def test_it_is_a_picture(timeline: Timeline) -> None:
    root = ElementTree.fromstring(strip(timeline, TimeSpan.over(0.0, timeline.end), 800.0))
    assert root.tag.endswith("svg")


def test_every_stretch_is_where_it_is(timeline: Timeline) -> None:
    span = TimeSpan.over(0.0, timeline.end)
    _, *stretches = boxes(strip(timeline, span, 800.0))
    expected = [(span.percent(s.start), span.percent(s.finish), PHASE_COLOURS[s.phase]) for s in timeline if s.duration]
    assert [fill for _, _, fill in stretches] == [fill for _, _, fill in expected]
    for (a, b, _), (c, d, _) in zip(stretches, expected, strict=True):
        assert (a, b) == pytest.approx((c, d), abs=0.002)
    assert PHASE_COLOURS[Phase.REST] in {fill for *_, fill in stretches}


def test_every_command_has_a_mark_and_its_text(timeline: Timeline) -> None:
    picture = strip(timeline, TimeSpan.over(0.0, timeline.end), 4000.0)
    assert picture.count('width="1"') == 3
    assert "MOVE #PPOINT(10, -90, 90, 0, 0, 0)" in picture
    assert "DELAY 1" in picture


def test_a_text_without_room_is_cut_or_left_out(timeline: Timeline) -> None:
    small = strip(timeline, TimeSpan.over(0.0, timeline.end), 300.0)
    assert "MOVE #PPOINT(10, -90, 90, 0, 0, 0)" not in small
    assert "…" in small
    assert small.count('width="1"') == 3


def test_what_is_not_confirmed_is_hatched_in_amber_as_in_the_scene(timeline: Timeline) -> None:
    span = TimeSpan(0.0, 10.0)
    picture = strip(timeline, span, 800.0, Doubts(5.0))
    assert (50.0, 100.0, "url(#unconfirmed)") in boxes(picture)
    assert f'stroke="rgb{UNCONFIRMED}"' in picture
    assert "url(#unconfirmed)" not in strip(timeline, span, 800.0)


def test_what_was_shown_wrongly_is_hatched_in_red_however_short(timeline: Timeline) -> None:
    flagged = ((1.0, 1.2), (3.0, 3.0001), (20.0, 21.0))
    picture = strip(timeline, TimeSpan(0.0, 10.0), 800.0, Doubts(flagged=flagged))
    red = [(begin, end) for begin, end, fill in boxes(picture) if fill == "url(#flagged)"]
    assert red == [(10.0, 12.0), (30.0, pytest.approx(30.0 + 300.0 / 800.0))]
    assert f'stroke="rgb{FLAGGED}"' in picture


def test_a_command_that_will_be_refused_has_a_red_mark_with_its_text(timeline: Timeline) -> None:
    refused = Expected(1, "MOVE p < q AT 1", 2.5, refused=TooLate("it is 2.500 s"))
    seen = Previewed(timeline, 2.5, 2.4, 2.6, 2.5, expected=(refused, Expected(2, "HERE", 2.6, 2.7)))
    picture = strip(timeline, TimeSpan(0.0, 10.0), 800.0, Doubts.of(seen))
    assert picture.count(f'fill="rgb{FLAGGED}"') == 1
    assert 'x="25.000%"' in picture
    assert "MOVE p &lt; q AT 1" in picture
    ElementTree.fromstring(picture)


def test_a_page_has_what_is_in_it(timeline: Timeline) -> None:
    middle = timeline.end / 2
    page = TimeSpan(middle, timeline.end)
    segments = tuple(segments_in(timeline, page))
    assert segments[0].start <= middle < segments[0].finish
    assert segments[-1] == timeline[-1]
    assert all(0.0 <= begin <= end <= 100.001 for begin, end, _ in boxes(strip(timeline, page, 800.0)))


def test_a_thousand_commands_are_no_larger_than_the_picture() -> None:
    robot = Robot()
    robot.prompt("\n".join(f"DRIVE 1, {(-1) ** k}, 100" for k in range(1000)))
    picture = strip(robot.timeline, TimeSpan.over(0.0, robot.timeline.end), 800.0)
    assert len(picture) < 400_000
    ElementTree.fromstring(picture)


def test_texts_of_commands_do_no_harm_in_a_page(timeline: Timeline) -> None:
    evil = Timeline(structs.replace(s, motion=s.motion._replace(text="<script>alert(1)</script>")) for s in timeline)
    picture = strip(evil, TimeSpan(0.0, 1.0), 4000.0)
    assert "<script" not in picture
    assert "&lt;script&gt;" in picture


@pytest.mark.parametrize(
    ("low", "high", "span"),
    [(0.0, 0.0, (0.0, 1.0)), (0.0, 28.2, (0.0, 30.0)), (14.19, 41.2, (14.0, 42.0)), (3.0, 100.0, (0.0, 100.0))],
)
def test_a_span_has_round_ends(low: float, high: float, span: tuple[float, float]) -> None:
    assert TimeSpan.over(low, high) == pytest.approx(span)


def test_a_timeline_that_grows_is_seldom_drawn_anew() -> None:
    spans = {TimeSpan.over(0.0, 0.02 * k) for k in range(1, 30_000)}
    assert len(spans) < 120


def test_colours_tell_phases_apart() -> None:
    assert set(PHASE_COLOURS) == set(Phase)
    assert len({*PHASE_COLOURS.values(), MARK}) == len(Phase) + 1
