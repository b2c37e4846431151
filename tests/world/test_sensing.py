"""Sensors beside dense sampling by another method, and what an edit that only shifts searches again: nothing."""

from __future__ import annotations

import pytest

from tests.world import sensors
from tests.world.cells import BOX, TABLE, Arm, course_of, world_of
from vrs_cli.trajectory.instant import on_grid

BEAM = """
[[sensor]]
name = "gate"
signal = 1001
kind = "beam"
from = [150, 300, -150]
to = [150, 700, -150]
"""


def test_sensors_are_those_of_dense_sampling() -> None:
    changes, wrong = sensors.run(1, 4, 5e-3)
    assert not wrong
    assert changes > 5


def test_an_edit_that_only_shifts_searches_nothing_and_changes_no_bit() -> None:
    arm = Arm("DELAY 0.5", "MOVE part").hand(1, 0.0).hand(0).do("DELAY 0.1", "APPRO place, 100", "MOVES place")
    world = world_of(arm, TABLE, BOX, BEAM)
    before = world.course(arm.timeline)
    first, held = [change for change in changes_of(before) if change[0] > 0.5], before.T_tool_part(before.timeline.end)
    end, looks = arm.engine.end, world.settings.sensing.looks
    arm.do("DRIVE 6, 10 AT 0.2")
    shift = arm.engine.end - end
    assert shift
    arm.events = [event.shift_by(shift) if event.time else event for event in arm.events]
    after = world.course(arm.timeline)
    assert [(t - shift, signal, on) for t, signal, on in changes_of(after) if t - shift > 0.5] == first
    assert len(first) >= 2
    assert after.T_tool_part(after.timeline.end) == held
    assert world.settings.sensing.looks - looks < looks / 20, "only the new segments"


def changes_of(course) -> list[tuple[float, int, bool]]:  # type: ignore[no-untyped-def]
    course.spans("box", course.timeline.end)
    return list(course._history.rows("changes"))


def test_an_inverted_sensor_is_on_while_nothing_is_there() -> None:
    arm = Arm("MOVE part").hand(1, 0.0).hand(0).do("DELAY 0.1", "DEPARTS 200")
    at_part = BEAM.replace("1001", "-1001").replace("[150, 300, -150]", "[-100, 550, -270]")
    course = course_of(arm, TABLE, BOX, at_part.replace("[150, 700, -150]", "[100, 550, -270]"))
    assert course.signal(1001, 0.0) is False
    assert course.next_change(-1.0) is not None
    assert course.signal(1001, course.timeline.end) is True


def test_a_part_that_falls_through_a_beam_is_seen_and_so_is_the_hand() -> None:
    arm = Arm("MOVE part").hand(1, 0.0).hand(0).do("DELAY 0.1", "DEPARTS 200").hand(1)
    beam = BEAM.replace("[150, 300, -150]", "[-100, 550, -150]").replace("[150, 700, -150]", "[100, 550, -150]")
    course = course_of(arm, TABLE, BOX, beam)
    t, changes = -1.0, []
    while change := course.next_change(t):
        t = change[0]
        changes.append(change)
    released, rested = (span.begin for span in course.spans("box", 10.0)[-2:])
    falls = [change for change in changes if change[0] > released]
    assert [on for _, _, on in falls] == [True, False]
    assert all(released < t < rested for t, _, _ in falls)
    # its lower side is 70 mm above the beam, its upper side 130 mm, and the beam is 1 mm thick
    assert falls[0][0] - released == pytest.approx((2 * 0.0695 / 9.81) ** 0.5, abs=1e-6)
    assert falls[1][0] - released == pytest.approx((2 * 0.1305 / 9.81) ** 0.5, abs=1e-6)
    assert [on for t, _, on in changes if t < released] == [True, False], "the fingers, or the part"


def test_changes_come_at_instants_of_the_timeline() -> None:
    """Between two instants the clock would never come to a change, and a program would wait for it without end."""
    arm = Arm("MOVE part").hand(1, 0.0).hand(0).do("DELAY 0.1", "DEPARTS 200").hand(1)
    times = set[float]()
    for height in range(-230, -110, 10):
        beam = BEAM.replace("[150, 300, -150]", f"[-100, 550, {height}]")
        course = course_of(arm, TABLE, BOX, beam.replace("[150, 700, -150]", f"[100, 550, {height}]"))
        times |= {t for t, _, _ in changes_of(course)}
    assert len(times) > 20
    assert {t for t in times if t != on_grid(t)} == set()
