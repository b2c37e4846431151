"""Judges changes of outputs: their order, their times, and where the tip is then."""

from __future__ import annotations

from collections.abc import Sequence
from math import dist
from typing import NamedTuple

from vrs_cli.engine.position import position_at
from vrs_cli.kinematics.transform import position
from vrs_cli.language.words.values import OUTPUTS
from vrs_cli.teach.checks import SignalChange, SignalsCheck
from vrs_cli.teach.judging.basis import HALF, JudgedRun
from vrs_cli.teach.verdict import Verdict, exceeds, falls_short, written
from vrs_cli.values.numbers import count


class OutputChange(NamedTuple):
    """An output came on, or (negative) went off, so many seconds after the run began."""

    t: float
    signal: int


def output_changes(run: JudgedRun) -> list[OutputChange]:
    """Return the changes of all outputs in a run, in order of time."""
    it = run.evidence
    found = [
        OutputChange(t - it.started, channel if value > 0.0 else -channel)
        for channel in it.timeline.channels
        if channel in OUTPUTS
        for t, value in it.timeline.changes(channel)
        if it.started <= t <= it.end
    ]
    return sorted(found, key=lambda change: change.t)


def came_on(signal: int, run: JudgedRun) -> float | None:
    """Return when an input came on for the first time [s since the run began]; None where it did not."""
    it = run.evidence
    found = [t for t, value in it.timeline.changes(signal) if value > 0.0 and it.started <= t <= it.end]
    t = it.started
    while it.course is not None and (change := it.course.next_change(t, it.end)) is not None:
        t, number, on = change
        if number == signal and on:
            found.append(t)
            break
    return min(found) - it.started if found else None


def judge_signals(check: SignalsCheck, run: JudgedRun) -> Verdict:
    """Judge whether outputs changed in order and in time."""
    seen, total, used = output_changes(run), len(check.changes), set[int]()
    first, last = 0, 0.0
    for found, wanted in enumerate(check.changes):
        place = next((k for k in range(first, len(seen)) if _wrong(wanted, seen[k], run) is None), None)
        if place is None:
            return Verdict(found / total, _missing(wanted, seen[first:], found, total, run), run.evidence.end)
        used.add(place)
        first, last = place + 1, seen[place].t
    if check.only:
        named = {abs(one.signal) for one in check.changes}
        more = [one for k, one in enumerate(seen) if k not in used and abs(one.signal) in named]
        if more:
            what = f"signal {abs(more[0].signal)} {_way(more[0].signal)} at {written(more[0].t, run.s)} s as well"
            return Verdict(HALF, f"{what}, which is not wanted", run.evidence.started + more[0].t)
    return Verdict(1.0, f"{count(total, 'signal')} changed as wanted", run.evidence.started + last)


def _wrong(wanted: SignalChange, seen: OutputChange, run: JudgedRun) -> str | None:
    """Return what is wrong with a change, None where it is the one that is wanted; "" where it is another signal."""
    if seen.signal != wanted.signal:
        return ""
    when, step = written(seen.t, run.s), run.s
    since, later = 0.0, ""
    if wanted.since is not None:
        came = came_on(wanted.since, run)
        if came is None:
            return f"at {when} s, and signal {wanted.since} never came on"
        since, later = came, f" after signal {wanted.since} came on at {written(came, step)} s"
    if falls_short(seen.t - since, wanted.after, step):
        return f"at {when} s, it is wanted at {written(wanted.after, step)} s{later} or later"
    if exceeds(seen.t - since, wanted.before, step):
        return f"at {when} s, it is wanted by {written(wanted.before, step)} s{later}"
    if wanted.near is not None:
        it = run.evidence
        place = run.basis.point(wanted.near)
        tip = position(position_at(it.arm, it.timeline, it.started + seen.t).T_world_tool)
        far = 1000.0 * dist(tip, place)
        if exceeds(far, wanted.mm, run.mm):
            away = f"{written(far, run.mm)} mm from {run.said(place)}, {written(wanted.mm, run.mm)} mm allowed"
            return f"at {when} s with the tool at {run.said(tip)}, {away}"
    return None


def _missing(wanted: SignalChange, rest: Sequence[OutputChange], found: int, total: int, run: JudgedRun) -> str:
    """Return the reason for a change that was not found."""
    name, done = f"signal {abs(wanted.signal)}", f"{found} of {count(total, 'change')} right"
    for seen in rest:
        if wrong := _wrong(wanted, seen, run):
            return f"{name} {_way(seen.signal)} {wrong} ({done})"
    did = "come on" if wanted.signal > 0 else "go off"
    after = "" if not found else " after that"
    return f"{name} did not {did}{after} ({done})"


def _way(signal: int) -> str:
    return "came on" if signal > 0 else "went off"
