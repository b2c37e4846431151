"""What becomes of parts: taken, carried, let go, fallen, brought and taken away; and after edits."""

from __future__ import annotations

import random
from math import inf, sqrt

import pytest

from tests.world.cells import BOX, TABLE, Arm, course_of, with_events, world_of
from vrs_cli.kinematics.transform import angle_between, compose, distance, inverse, position
from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.values.world import SpanKind
from vrs_cli.world.course import PartState, WorldCourse

STAND = """
[[fixture]]
name = "stand"
shape = "box"
size = [100, 100, 50]
at = [300, 450, -255]
"""


def picked(*after: str, extra: str = "") -> tuple[Arm, WorldCourse]:
    """The box is taken from the table, and carried by these motions."""
    arm = Arm("MOVE part").hand(1, 0.0).hand(0).do("DELAY 0.1", *after)
    return arm, course_of(arm, TABLE, BOX, extra)


def kinds(course: WorldCourse, name: str) -> list[str]:
    return [span.kind.value for span in course.spans(name)]


def test_a_part_between_the_fingers_is_carried_from_the_moment_they_arrive() -> None:
    arm, course = picked("APPRO place, 100", "MOVES place")
    rests, held = course.spans("box")
    closed = arm.events[1].time
    assert (rests.kind, held.kind, held.begin) == (SpanKind.RESTS, SpanKind.HELD, closed + 0.05)
    assert course.state("box", closed) == PartState(rests.T, False, "table", True)
    assert course.held_part(closed + 0.04) is None
    assert course.held_part(closed + 0.05) == "box"
    tip = arm.engine.timeline.end
    assert distance(course.state("box", tip).pose, course.tool(tip)) < 1e-12


def test_a_hand_that_is_told_again_to_close_takes_the_part() -> None:
    arm = Arm("MOVE part").hand(1, 0.0).hand(0)
    closing = arm.events[-1].time
    arm.hand(0, closing + 0.02).do("DELAY 0.1")
    course = course_of(arm, TABLE, BOX)
    assert course.held_part(closing + 0.06) is None
    assert course.held_part(closing + 0.071) == "box"
    assert course.notes == ()


def test_what_is_held_is_fixed_to_the_hand() -> None:
    arm, course = picked("APPRO place, 100", "MOVES place", "DRIVE 4, 30", "DRIVE 6, -50")
    R, held = random.Random(5), course.spans("box")[1]
    first = course.T_tool_part(held.begin)
    assert first is not None
    for _ in range(1000):
        t = R.uniform(held.begin, arm.engine.timeline.end)
        now = compose(inverse(course.tool(t)), course.state("box", t).pose)
        assert distance(now, first) < 1e-12
        assert angle_between(now, first) < 1e-12
        assert course.T_tool_part(t) == first


def test_a_part_that_is_let_go_falls_as_long_as_falling_takes() -> None:
    arm, _ = picked("APPRO place, 100")
    arm.hand(1)
    course = course_of(arm, TABLE, BOX, STAND)
    t = arm.events[-1].time
    before, falls, rests = course.spans("box", 100.0)[-3:]
    assert falls.begin == t
    assert rests.begin - t == pytest.approx(sqrt(2 * 0.1 / 9.81), abs=1e-6)
    pose, on = course.state("box", rests.begin).pose, course.state("box", rests.begin).on
    assert on == "stand"
    assert position(pose) == pytest.approx((0.3, 0.45, -0.2), abs=1e-9)
    assert angle_between(pose, course.state("box", t).pose) < 1e-12
    middle = course.state("box", t + 0.1).pose
    assert position(pose)[2] + 0.1 - 0.5 * 9.81 * 0.01 == pytest.approx(middle.pz, abs=1e-9)
    assert course.notes == ((t, "FALL", "box falls 100.0 mm onto stand"),)
    assert before.kind is SpanKind.HELD


def test_a_course_can_be_read_without_an_end() -> None:
    _, course = picked("APPRO place, 100")
    assert [span.kind.value for span in course.spans("box", inf)] == ["rests", "held"]
    assert [name for _, name in course.moves(-inf, inf)] == ["box"]


def test_without_a_support_it_falls_to_the_floor() -> None:
    arm = Arm("MOVE part").hand(1, 0.0).hand(0).do("DELAY 0.1", "DRIVE 1, 90").hand(1)
    course = course_of(arm, "floor = -600", BOX)
    assert course.state("box", 100.0).on == "floor"
    assert course.state("box", 100.0).pose.pz == pytest.approx(-0.57, abs=1e-9)


@pytest.mark.parametrize("size", ["[110, 40, 60]"])
def test_a_part_that_is_wider_than_the_hand_is_not_taken(size: str) -> None:
    arm = Arm("MOVE part").hand(1, 0.0).hand(0).do("DELAY 0.1")
    course = course_of(arm, TABLE, BOX.replace("[40, 40, 60]", size))
    assert kinds(course, "box") == ["rests"]
    ((_, kind, text),) = course.notes
    assert (kind, text) == (
        "EMPTY",
        "the hand closes on nothing: box is 110.0 mm wide, the fingers 100.0 mm apart",
    )


@pytest.mark.parametrize(("moved", "taken"), [(0, True), (20, True), (24, True), (26, False), (50, False)])
def test_the_tip_has_to_be_in_the_part_or_near(moved: int, taken: bool) -> None:
    arm = Arm("MOVE part").hand(1, 0.0).hand(0).do("DELAY 0.1")
    course = course_of(arm, TABLE, BOX.replace("[0, 550, -250]", f"[0, {550 + moved}, -250]"))
    assert ("held" in kinds(course, "box")) is taken
    assert [note[1] for note in course.notes] == ([] if taken else ["EMPTY"])


def test_the_fingers_stop_at_the_part_that_they_take() -> None:
    arm = Arm("MOVE part").hand(1, 0.0).hand(0).do("DELAY 0.1").hand(0.3).do("DELAY 0.1").hand(1).do("DELAY 0.1")
    arm.hand(0).do("DELAY 0.1", "DRIVE 1, 40").hand(1).do("DELAY 0.1", "DRIVE 2, -20").hand(0).do("DELAY 0.1")
    course = course_of(arm, TABLE, BOX)
    _, closed, partly, opened, again, wide, empty = (event.time for event in arm.events)
    times = (
        closed - 0.01,
        closed + 0.04,
        closed + 0.05,
        partly,
        opened - 0.01,
        opened,
        again + 0.05,
        wide,
        empty + 0.05,
    )
    assert [course.held_part(t) for t in times] == [None, None, "box", "box", "box", None, "box", None, None]
    assert [course.opening(t) for t in times] == pytest.approx([1.0, 1.0, 0.4, 0.4, 0.4, 1.0, 0.4, 1.0, 0.0])


def test_fingers_on_their_way_are_so_in_the_end_of_a_timeline_too() -> None:
    arm = Arm("MOVE part").hand(1, 0.0).hand(0).do("DELAY 0.1")
    whole, t = course_of(arm, TABLE, BOX), arm.events[1].time + 0.02
    end = Timeline(list(arm.timeline), 0, arm.timeline.events, world=whole.state_at(t))
    part = world_of(arm, TABLE, BOX).course(end)
    assert [part.opening(t + s) for s in (0.0, 0.01, 0.03)] == [whole.opening(t + s) for s in (0.0, 0.01, 0.03)]
    assert part.opening(t) == 1.0


def test_places_where_a_part_can_be_taken() -> None:
    arm = Arm("MOVE part").hand(1, 0.0).hand(0).do("DELAY 0.1")
    wide = BOX.replace("[40, 40, 60]", "[140, 140, 60]")
    assert kinds(course_of(arm, TABLE, wide), "box") == ["rests"]
    knob = "grasp = [{at = [0, 0, 3], width = 30}]"
    assert kinds(course_of(arm, TABLE, wide, knob), "box") == ["rests", "held"]
    assert kinds(course_of(arm, TABLE, wide, knob.replace("[0, 0, 3]", "[0, 0, 6]")), "box") == ["rests"]


def test_fingers_that_do_not_close_far_enough_take_nothing() -> None:
    arm = Arm("MOVE part").hand(1, 0.0).hand(0.5).do("DELAY 0.1").hand(0.4).do("DELAY 0.2").hand(0.41).hand(0.3)
    course = course_of(arm, TABLE, BOX)
    spans = course.spans("box", 100.0)
    assert [span.kind.value for span in spans] == ["rests", "held", "rests", "held"]
    assert spans[1].begin == arm.events[2].time + 0.05, "the gap is 40 mm, as wide as the box"
    assert spans[2].begin == arm.events[3].time


def test_a_hand_that_opens_before_the_fingers_arrive_takes_nothing() -> None:
    arm = Arm("MOVE part").hand(1, 0.0).hand(0)
    arm.hand(1, arm.events[-1].time + 0.04)
    assert kinds(course_of(arm, TABLE, BOX), "box") == ["rests"]


TOWER = "".join(
    f'[[part]]\nname = "{name}"\nshape = "box"\nsize = [40, 40, 20]\nat = [0, 550, {height}]\n'
    for name, height in (("low", -270), ("mid", -250), ("top", -230))
)


def test_a_stack_falls_when_its_lower_part_is_taken_away() -> None:
    arm = Arm("MOVE part").hand(1, 0.0).hand(0).do("DELAY 0.3", "DEPARTS 100").hand(1)
    tower = TOWER.replace('"low"', '"x"').replace('"mid"', '"low"').replace('"x"', '"mid"')  # the tip is in `low`
    course = course_of(arm, TABLE, tower)
    moves = next(segment.start for segment in course.timeline if segment.start > arm.events[1].time + 0.1)
    assert kinds(course, "mid") == ["rests"], "it stands on the table"
    rests, falls, lies = course.spans("top", 100.0)
    assert falls.begin == moves, "when the arm goes away with what it stood on"
    assert lies.T.pz == pytest.approx(-0.25)
    assert lies.on == ("mid",)
    assert rests.end == moves


def test_parts_above_fall_onto_each_other() -> None:
    arm = Arm("MOVE part", "MOVES SHIFT(part BY 0, 0, -20)").hand(1, 0.0).hand(0).do("DELAY 0.3", "DRIVE 1, 30")
    course = course_of(arm, TABLE, TOWER)
    end = course.timeline.end
    assert [course.state(name, end).on for name in ("mid", "top")] == ["table", "mid"]
    assert [course.state(name, end).pose.pz for name in ("mid", "top")] == pytest.approx([-0.27, -0.25])


def test_parts_beside_each_other_do_not_carry_each_other() -> None:
    beside = BOX.replace('name = "box"', 'name = "beside"').replace("[0, 550, -250]", "[40, 550, -250]")
    arm = Arm("MOVE part").hand(1, 0.0).hand(0).do("DELAY 0.3", "DEPARTS 100", "DELAY 0.1", "MOVES part").hand(1)
    course = course_of(arm, TABLE, BOX, beside)
    assert course.state("box", 100.0).on == "table"
    assert course.state("box", 100.0).pose.pz == pytest.approx(-0.25, abs=1e-7)


def test_what_rests_on_an_edge_is_told() -> None:
    arm, _ = picked("APPRO SHIFT(place BY 60, 0, 0), 100")
    arm.hand(1)
    course = course_of(arm, TABLE, BOX, STAND)
    assert course.state("box", 100.0).on == "stand"
    assert course.notes[-1][1:] == ("EDGE", "box rests on an edge of stand")


def test_the_grip_sensor_shows_what_the_hand_holds() -> None:
    arm, _ = picked("DELAY 0.5")
    arm.hand(1)
    course = course_of(arm, TABLE, BOX, "[hand]\nsignal = 1010")
    closed, opened = (event.time for event in arm.events[1:])
    assert [course.signal(1010, t) for t in (0.0, closed, closed + 0.05, opened)] == [False, False, True, False]
    assert course.next_change(-1.0) == (closed + 0.05, 1010, True)
    assert course.next_change(closed + 0.05) == (opened, 1010, False)
    assert course.next_change(closed + 0.05, opened - 0.01) is None
    assert course.signal(1011, 0.0) is None


FEED = """
[[feeder]]
when = 3
after = 0.5
parts = ["box", "ring"]
[[part]]
name = "ring"
shape = "cylinder"
radius = 20
height = 20
at = [200, 550, -200]
[[sink]]
when = 4
at = [0, 550, -250]
size = [100, 100, 100]
"""


def test_feeders_bring_parts_and_sinks_take_them() -> None:
    arm = Arm("DELAY 10").switch(3, True, 1.0).switch(3, False, 2.0).switch(3, True, 3.0).switch(4, True, 5.0)
    arm.switch(3, False, 6.0).switch(3, True, 7.0)
    course = course_of(arm, TABLE, BOX, FEED)
    assert [(span.begin, span.kind.value) for span in course.spans("box")] == [
        (0.0, "absent"),
        (1.5, "rests"),
        (5.0, "absent"),
    ]
    assert [span.kind.value for span in course.spans("ring")] == ["absent", "falls", "rests"]
    assert course.state("ring", 9.0).on == "table"
    assert [course.state("box", t).exists for t in (1.0, 2.0, 6.0)] == [False, True, False]
    again = course_of(arm, TABLE, BOX, FEED.replace('"ring"]', '"ring"]\nagain = true'))
    assert [span.kind.value for span in again.spans("box")] == ["absent", "rests", "absent", "rests"]


def test_a_feeder_whose_part_is_still_there_says_so() -> None:
    arm = Arm("DELAY 10").switch(3, True, 1.0).switch(3, False, 2.0).switch(3, True, 3.0)
    course = course_of(arm, TABLE, BOX, '[[feeder]]\nwhen = 3\nparts = ["box"]\nagain = true')
    assert course.notes == ((3.0, "FEEDER", "box does not come: it is there already"),)


def test_rules_that_drive_each_other_at_one_instant_end() -> None:
    rules = "".join(f"[[follow]]\nwhen = {a}\nset = {b}\n" for a, b in ((3, 1001), (1001, -1001), (-1001, 1001)))
    course = course_of(Arm("DELAY 5").switch(3, True, 1.0), rules)
    assert [kind for _, kind, _ in course.notes] == ["ENDLESS"]


def test_many_changes_at_one_instant_end() -> None:
    arm = picked()[0]
    for number in range(1500):
        arm.switch(5, number % 2 == 0, at=1.0)
    assert "ENDLESS" not in [kind for _, kind, _ in course_of(arm, TABLE + BOX).notes]


def test_rules_apply_to_outputs_and_inputs() -> None:
    rules = "[[follow]]\nwhen = 3\nset = 1001\nafter = 0.5\nlasting = 0.25\n[[follow]]\nwhen = -1001\nset = 1002"
    course = course_of(Arm("DELAY 5").switch(3, True, 1.0).switch(1002, False, 3.0), rules)
    changes, t = [], -1.0
    while change := course.next_change(t):
        changes.append(change)
        t = change[0]
    assert changes == [(1.5, 1001, True), (1.75, 1001, False), (3.0, 1002, False)], "of one instant the first"
    assert [course.signal(1002, t) for t in (1.7, 1.75, 3.0)] == [False, True, False]


# --- after edits -----------------------------------------------------------------------------------------------------


def all_of(course: WorldCourse) -> object:
    end = course.timeline.end + 2.0
    return [course.spans(name, end) for name in course.parts()], course.notes, course._history.rows("changes")


def test_after_an_edit_a_course_is_that_of_a_new_world() -> None:
    R, cell = random.Random(3), (TABLE, BOX, STAND, FEED, "[[sensor]]", 'name = "b"\nsignal = 1001\nkind = "beam"')
    cell += ("from = [300, 350, -180]\nto = [300, 550, -180]",)
    arm = Arm("MOVE part")
    world = world_of(arm, *cell)
    for _ in range(12):
        line = R.choice(("UNDO", "DRIVE 6, 20, 100 AT 0.3", "MOVES place", "APPRO place, 60", "DELAY 0.2", "MOVE part"))
        arm.do(line)
        end = arm.engine.timeline.end
        arm.events = [event for event in arm.events if event.time < end]
        last = max((event.time for event in arm.events), default=0.0)
        choice = R.randrange(3)
        if choice:
            arm.hand(choice - 1, R.uniform(last, end) // 2.0**-30 * 2.0**-30)
        else:
            arm.switch(R.choice((3, 4)), R.random() < 0.5, end)
        course = world.course(arm.timeline)
        if R.random() < 0.7:
            assert all_of(course) == all_of(world_of(arm, *cell).course(arm.timeline))


def test_the_course_of_a_timeline_is_kept() -> None:
    arm = Arm("MOVE part")
    world, timeline = world_of(arm, TABLE, BOX), arm.timeline
    course = world.course(timeline)
    assert world.course(timeline) is course
    for count in range(8):
        world.course(with_events(timeline, [*arm.events, *arm.hand(0, float(count)).events]))
    assert world.course(timeline) is not course


def test_undo_takes_parts_back_to_the_bit() -> None:
    """With the commands of the hand themselves: their events are on the timeline."""
    arm = Arm("OPENI", "MOVE part", "CLOSEI", "APPRO place, 60")
    world = world_of(arm, TABLE, BOX, STAND)
    before = world.course(arm.engine.timeline)
    carried = all_of(before)
    arm.do("MOVES place", "OPENI", "DEPARTS 60", "READY")
    placed = all_of(world.course(arm.engine.timeline))
    assert world.course(arm.engine.timeline).state("box", arm.engine.end).on == "stand"
    arm.do("UNDO", "UNDO", "UNDO", "UNDO")
    course = world.course(arm.engine.timeline)
    assert all_of(course) == carried
    R, held = random.Random(6), course.spans("box")[1]
    for _ in range(200):
        t = R.uniform(held.begin, arm.engine.end)
        now = compose(inverse(course.tool(t)), course.state("box", t).pose)
        assert distance(now, before.T_tool_part(t)) < 1e-12  # type: ignore[arg-type]
    arm.do("REDO", "REDO", "REDO", "REDO")
    assert all_of(world.course(arm.engine.timeline)) == placed


def test_a_course_goes_on_from_its_state_at_any_time() -> None:
    """While the part lies, is held, falls, and at the very start."""
    arm = Arm("OPENI", "MOVE part", "CLOSEI", "APPRO place, 60", "OPENI", "DELAY 1")
    world, timeline = world_of(arm, TABLE, BOX, STAND), arm.engine.timeline
    whole = world.course(timeline)
    assert whole.state_at(timeline.start) is None, "as the scene says"
    for begins in (0.01, *(span.begin + 0.02 for span in whole.spans("box"))):
        first = timeline.index_at(begins)
        start = timeline[first].start
        part = world.course(Timeline(list(timeline)[first:], timeline.version, timeline.events, whole.state_at(begins)))
        assert part.begins == begins > start
        assert part.spans("box", inf) == whole.spans("box", inf)[-len(part.spans("box", inf)) :]
        assert part.state("box", begins) == whole.state("box", begins)
    with_another = world_of(arm, TABLE, BOX.replace('name = "box"', 'name = "can"'))
    course = with_another.course(Timeline(list(timeline), 0, (), whole.state_at(1.0)))
    assert course.begins == timeline.start, "that is a state of another cell"
