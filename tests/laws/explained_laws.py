"""The laws of EXPLAIN: what it tells of a motion is what the motion then does, and asking changes nothing."""

from __future__ import annotations

from itertools import pairwise
from math import dist

from vrs_cli.engine.engine import Engine
from vrs_cli.engine.explaining import motion_plan, splice
from vrs_cli.engine.position import position_at
from vrs_cli.errors import VrsError
from vrs_cli.trajectory.timeline import Timeline, TimelineDelta
from vrs_cli.values.commands import Request
from vrs_cli.values.replies import SegmentFate

WITHIN = 1e-3  # of a peak that dense samples may miss, or find beyond those of the plan
ROOM = 1e-5  # [rad, m] of a joint that turns back between the samples of a line
SAMPLES = 200  # of a motion


def foretold(engine: Engine, request: Request) -> Engine | VrsError:
    """Do what is asked aside; this engine stays as it was."""
    before = engine.timeline, engine.settings, engine.now, len(engine.book.deltas), engine.book.number
    aside = engine.aside()
    outcome: Engine | VrsError = aside
    try:
        aside.perform(request)
    except VrsError as error:
        outcome = error
    after = engine.timeline, engine.settings, engine.now, len(engine.book.deltas), engine.book.number
    assert all(a is b or a == b for a, b in zip(before, after, strict=True))
    assert engine.timeline is before[0]
    return outcome


def check_foretold(aside: Engine, engine: Engine) -> None:
    """What was done is what was told, to the bit."""
    assert engine.timeline == aside.timeline
    assert (engine.now, engine.settings, engine.book.number) == (aside.now, aside.settings, aside.book.number)


def check_refusal(told: Engine | VrsError | None, error: VrsError) -> None:
    """A refusal is told before it comes. `told`: None where nobody asked."""
    assert told is None or str(told) == str(error)


def check_plan(engine: Engine, before: Timeline, delta: TimelineDelta) -> None:
    """The peaks of a plan, beside g at many times."""
    plan = motion_plan(engine.arm, before, delta)
    own = [segment for segment in delta.segments if segment.motion.number == delta.motion.number]
    assert (plan.begin, plan.end) == (own[0].start, own[-1].finish)
    assert [(one.start, one.finish) for one in plan.stretches] == [(one.start, one.finish) for one in own]
    after = before.apply(delta)
    times = [plan.begin + (plan.end - plan.begin) * k / SAMPLES for k in range(SAMPLES)]  # the end is the next one's
    seen = [position_at(engine.arm, after, t) for t in times]
    model = engine.model
    for load, low, high in zip(plan.loads, model.lower, model.upper, strict=True):
        i = load.joint - 1
        for peak, rates in ((load.velocity, "velocity"), (load.acceleration, "acceleration")):
            greatest = max(abs(getattr(one, rates)[i]) for one in seen)
            assert greatest <= peak.value + WITHIN * peak.limit
            assert plan.begin <= peak.time <= plan.end
        nearest = min(min(one.joints[i] - low, high - one.joints[i]) for one in seen)
        assert load.room <= nearest + ROOM
    chords = sum(dist(a.T_world_tool[3::4], b.T_world_tool[3::4]) for a, b in pairwise(seen))
    assert plan.length >= chords - 1e-6 - WITHIN * chords


def check_splice(engine: Engine, before: Timeline, delta: TimelineDelta) -> None:
    """The rows of a change, beside both timelines."""
    report, after = splice(engine.book), engine.timeline
    old = {(one.start, one.finish) for one in before}
    new = {(one.start, one.finish) for one in after}
    assert all(row.before is None or row.before in old for row in report.rows)
    assert all(row.after is None or row.after in new for row in report.rows)
    fates = [row.fate for row in report.rows]
    assert fates.count(SegmentFate.DROPPED) == delta.drop
    assert fates.count(SegmentFate.PLANNED) + fates.count(SegmentFate.AGAIN) == len(delta.segments)
    for row in report.rows:
        if row.fate is SegmentFate.CUT:
            assert row.after is not None
            assert row.after[1] == delta.cut
        if row.fate is SegmentFate.SHIFTED:
            assert row.before is not None
            assert row.after is not None
            assert row.after[0] - row.before[0] == delta.shift
