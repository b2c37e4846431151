"""The course of a world: where each part is at any time, and which signals sensors and rules give.

It follows from a timeline and a scene alone: what the hand holds, what falls, what sensors see. It is computed forward
from cause to cause, as far as somebody asks.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterable, Mapping
from enum import Enum
from math import inf, sqrt
from threading import RLock
from typing import NamedTuple

from msgspec import Struct

from vrs_cli.engine.position import joints_at, world_pose
from vrs_cli.kinematics.transform import Transform, compose, dot, inverse, moved_point, position, subtracted
from vrs_cli.trajectory.instant import up_to_grid
from vrs_cli.trajectory.segment import Phase
from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.values.events import HAND, Event
from vrs_cli.values.motion import Frames
from vrs_cli.values.scene import ScenePart
from vrs_cli.world.history import WorldHistory
from vrs_cli.world.sensing import GRAVITY, Passage, SeenBody
from vrs_cli.world.settings import WorldSettings
from vrs_cli.world.solids import Bounds, Solids, bounds, overlap, point_apart, spread
from vrs_cli.world.support import FLOOR, Below, balanced, below, cells

FALLS = 1e-3  # [m] a fall of less is not worth a word
STANDS = 1e-7  # [m] what would fall less stands
SLACK = 1e-6  # [m] of comparisons of widths
MOST_AT_ONCE = 1000  # of one instant: rules that drive each other for ever end there


class SpanKind(Enum):
    """The ways of a part: not there, at rest, in the hand, or falling."""

    ABSENT = "absent"
    RESTS = "rests"
    HELD = "held"
    FALLS = "falls"


class PartSpan(NamedTuple):
    """The state of a part from `begin` to `end` [s]. `T`: T_world_part; of a part that is held, T_flange_part; of one
    that falls, where it begins to. `on`: what it stands on, or falls onto.
    """

    begin: float
    kind: SpanKind
    T: Transform
    end: float = inf
    on: tuple[str, ...] = ()


class PartState(Struct, frozen=True):
    """A part at one time: T_world_part, whether the hand holds it, what it stands on, whether it is there at all."""

    pose: Transform
    held: bool
    on: str
    exists: bool


class WorldCourse:
    """The course of one timeline. Any thread may ask."""

    def __init__(self, settings: WorldSettings, timeline: Timeline) -> None:
        self._settings, self.timeline = settings, timeline
        self._lock = RLock()
        self._history = WorldHistory()
        self._standing: tuple[int, dict[str, Transform]] = (0, {})
        self._begin()
        self._first = self._history.copy()
        self._stood_on: dict[str, tuple[str, ...]] = {}

    def edited(self, timeline: Timeline, since: float) -> WorldCourse:
        """The course of another timeline that is the same until `since` [s]."""
        made = WorldCourse.__new__(WorldCourse)
        made._settings, made.timeline, made._lock = self._settings, timeline, RLock()
        made._standing, made._first, made._stood_on = (0, {}), self._first, self._stood_on
        with self._lock:
            made._history = self._history.copy()
        made._history.back_to(since)
        made._arm_moves_otherwise()
        return made

    # --- reading ---

    def parts(self) -> tuple[str, ...]:
        return tuple(self._settings.parts)

    def spans(self, name: str, until: float | None = None) -> tuple[PartSpan, ...]:
        """All that a part does, up to the end of the timeline or another time [s]. Raises KeyError."""
        self._advance(self.timeline.end if until is None else until)
        return self._spans(name)

    def pose(self, name: str, t: float) -> Transform:
        """T_world_part at t [s]. Raises KeyError."""
        return self.state(name, t).pose

    def state(self, name: str, t: float) -> PartState:
        """A part at t [s]. Raises KeyError."""
        t = max(t, self.timeline.start)
        self._advance(t)
        span = self._span(name, t)
        kind, pose = span.kind, span.T
        if kind is SpanKind.HELD:
            pose = compose(self._flange(t), pose)
        elif kind is SpanKind.FALLS:
            pose = _fallen(pose, min(t, span.end) - span.begin)
        on = ""
        if kind is SpanKind.RESTS:
            on = (span.on or self._stands_first_on(name))[0]
        return PartState(pose, kind is SpanKind.HELD, on, kind is not SpanKind.ABSENT)

    def held(self, t: float) -> str | None:
        """The part in the hand at t [s]."""
        self._advance(t)
        grips = self._history.grips
        place = bisect_right(grips, t, key=lambda grip: grip[0])
        return grips[place - 1][1] if place else None

    def T_tool_part(self, t: float) -> Transform | None:
        """The pose of the part in the hand, as the tool sees it; None where the hand holds none."""
        name = self.held(t)
        if name is None:
            return None
        tool = self.timeline.locate(t)[0].motion.frames.tool
        return compose(inverse(tool), self._span(name, t).T)

    def graspable(self, t: float) -> str | None:
        """The part that the open hand would take if it closed at t [s]."""
        self._advance(t)
        return self._between(self.standing(t).items(), self.tool(t), (self._settings.opening, 0.0))

    def standing(self, t: float) -> Mapping[str, Transform]:
        """The parts that stand at t [s], each with T_world_part."""
        self._advance(t)
        with self._lock:
            done, found = self._standing
            moves = self._history.moves
            count = bisect_right(moves, t, key=lambda move: move[0])
            if count < done:
                done, found = 0, {}
            changed = dict.fromkeys(name for _, name in moves[done:count]) if found else self.parts()
            if changed:
                found = dict(found)
            for name in changed:
                span = self._span(name, t)
                found.pop(name, None)
                if span.kind is SpanKind.RESTS:
                    found[name] = span.T
            self._standing = (count, found)
            return found

    def moves(self, begin: float, end: float) -> list[tuple[float, str]]:
        """Return when parts begin to do something else, after `begin` and up to `end` [s], and which."""
        self._advance(end)
        moves = self._history.moves
        first, last = (bisect_right(moves, t, key=lambda move: move[0]) for t in (begin, end))
        return moves[first:last]

    def signal(self, number: int, t: float) -> bool | None:
        """An input at t [s]; None where nothing computes it."""
        if number not in self._settings.computed:
            return None
        self._advance(max(t, self.timeline.start))
        found: tuple[tuple[float, bool], ...] = self._history.get(("changes", number), ())
        place = bisect_right(found, t, key=lambda change: change[0])
        return bool(found[place - 1][1]) if place else False

    def next_change(self, after: float, until: float = inf) -> tuple[float, int, bool] | None:
        """The first change of an input after one time, and not after another [s]: when, which signal, its state. Others
        may change at the same instant.
        """
        while True:
            changes = self._history.changes
            place = bisect_right(changes, after, key=lambda change: change[0])
            if place < len(changes):
                return changes[place] if changes[place][0] <= until else None
            coming = self._next()
            if coming > until or coming == inf:
                return None
            self._advance(coming)

    @property
    def notes(self) -> tuple[tuple[float, str, str], ...]:
        """Return what there is to tell up to the end of the timeline: time [s], kind, text. Kinds: EMPTY (the hand
        closed on nothing), FALL, EDGE, FEEDER, ENDLESS.
        """
        self._advance(self.timeline.end)
        return tuple(self._history.notes)

    def _spans(self, name: str) -> tuple[PartSpan, ...]:
        found: tuple[PartSpan, ...] = self._history.get(("spans", name))
        if found is None:
            raise KeyError(name)
        return found

    def _span(self, name: str, t: float) -> PartSpan:
        spans = self._spans(name)
        return spans[max(bisect_right(spans, t, key=lambda span: span.begin) - 1, 0)]

    def _flange(self, t: float) -> Transform:
        """T_world_flange."""
        frames = self.timeline.locate(t)[0].motion.frames
        return world_pose(self._settings.arm, Frames(frames.base), joints_at(self._settings.arm, self.timeline, t))

    def tool(self, t: float) -> Transform:
        """T_world_tool."""
        return compose(self._flange(t), self.timeline.locate(t)[0].motion.frames.tool)

    # --- forward in time ---

    def _next(self) -> float:
        """Return when the next thing happens [s]."""
        history = self._history
        index = history.get("events")
        event = self.timeline.event(index).time if index < self.timeline.event_count else inf
        return min(event, history.due[0].time if history.due else inf)

    def _advance(self, until: float) -> None:
        """Let all happen that is due up to a time."""
        history = self._history
        if history.now >= until and self._next() > until:
            return
        with self._lock:
            instant, count = -inf, 0
            while (coming := self._next()) <= until:
                count = count + 1 if coming == instant else 0
                instant = coming
                if count > MOST_AT_ONCE:
                    self._note("ENDLESS", "rules of the cell drive each other without end")
                    history.set("due", tuple(one for one in history.due if one.time > coming))
                    continue
                history.now = max(history.now, coming)
                index = history.get("events")
                if index < self.timeline.event_count and self.timeline.event(index).time <= coming:
                    history.set("events", index + 1)
                    self._happen(self.timeline.event(index))
                    continue
                one = history.take()
                getattr(self, f"_{one.what}")(*one.data)
            history.now = max(history.now, until) if until < inf else history.now

    def _begin(self) -> None:
        """All as the scene says, at the start of the timeline."""
        settings, start = self._settings, self.timeline.start
        history = self._history
        history.now = start
        history.set("events", 0)
        history.set("names", tuple(settings.solids))
        history.set("hand", 0.0)
        for name, (solids, T) in settings.fixed.items():
            self._put(name, solids, T)
        fed = {name for feeder in settings.scene.feeders for name in feeder.parts}
        for name, part in settings.parts.items():
            kind = SpanKind.ABSENT if name in fed else SpanKind.RESTS
            history.set(("spans", name), (PartSpan(start, kind, part.T_world_part),))
            if kind is SpanKind.RESTS:
                self._put(name, settings.solids[name], part.T_world_part)
                self._stand(name, part.T_world_part)
        for region, sensor in enumerate(settings.scene.sensors):
            if not history.get(("region", region)):
                self._show(sensor.signal, False)
        if settings.sensing.regions:
            history.plan(start, "segment", self.timeline.index_at(start), start, carried=True)

    def _arm_moves_otherwise(self) -> None:
        """Plan again what follows from the motion of the arm from now on."""
        history = self._history
        history.drop(carried=True)
        if self._settings.sensing.regions:
            history.plan(history.now, "segment", self.timeline.index_at(history.now), history.now, carried=True)
        if history.get("stack"):
            self._plan_unstack()

    def _note(self, kind: str, text: str) -> None:
        self._history.notes.append((self._history.now, kind, text))

    # --- events ---

    def _happen(self, event: Event) -> None:
        if event.observed:
            return
        if event.channel != HAND:
            if event.channel not in self._settings.sensed:
                self._switch(event.channel, event.value > 0.5)
            return
        history = self._history
        before = history.get("hand")
        history.set("hand", event.value)
        history.drop(what="arrive")
        opening = self._settings.opening
        if event.value < before:
            history.plan(event.time + event.duration, "arrive", before * opening, event.value * opening)
        elif (name := history.get("held")) is not None and event.value * opening > history.get("width") + SLACK:
            self._release(name)

    def _switch(self, signal: int, on: bool) -> None:
        """A signal takes a state: what follows of it is planned."""
        history, settings = self._history, self._settings
        if history.get(("signal", signal), False) is on:
            return
        history.set(("signal", signal), on)
        now = history.now
        if signal in settings.computed:
            history.set(("changes", signal), (*history.get(("changes", signal), ()), (now, on)))
            history.changes.append((now, signal, on))
        number = signal if on else -signal
        for place, rule in settings.rules.get(number, ()):
            used = history.get(("used", place), 0)
            if rule.rows and used == len(rule.rows) and not rule.again:
                continue
            history.set(("used", place), 1 if used == len(rule.rows) else used + 1)
            assert rule.sets is not None
            history.plan(now + rule.after, "switch", abs(rule.sets), rule.sets > 0)
            if rule.lasting is not None:
                history.plan(now + rule.after + rule.lasting, "switch", abs(rule.sets), rule.sets < 0)
        for place, feeder in enumerate(settings.scene.feeders):
            if feeder.when == number:
                history.plan(now + feeder.after, "feed", place)
        for place, sink in enumerate(settings.scene.sinks):
            if sink.when == number:
                history.plan(now + sink.after, "clear", place)

    # --- the hand ---

    def _arrive(self, before: float, after: float) -> None:
        """The fingers have arrived: their gap has gone from one width to another [m]."""
        history = self._history
        if history.get("held") is not None:
            return
        t = history.now
        tool = self.tool(t)
        (x, y, z), far = position(tool), self._settings.scene.gripper.tolerance
        near = _near((x - far, x + far, y - far, y + far, z - far, z + far), history)
        parts = ((name, self._span(name, t)) for name in near if name in self._settings.parts)
        found = self._between(
            ((name, span.T) for name, span in parts if span.kind is SpanKind.RESTS), tool, (before, after), tell=True
        )
        if found is not None:
            self._hold(found, tool)

    def _between(
        self,
        parts: Iterable[tuple[str, Transform]],
        tool: Transform,
        gap: tuple[float, float],
        *,
        tell: bool = False,
    ) -> str | None:
        """The part between fingers whose gap goes from one width to another [m]; of several, the nearest to the tip."""
        tip, axis = position(tool), (tool.nx, tool.ny, tool.nz)
        tolerance, found, wide = self._settings.scene.gripper.tolerance, list[tuple[float, str, float]](), ""
        for name, T in parts:
            solids, part = self._settings.solids[name], self._settings.parts[name]
            reach = max(one.reach for one in solids) + max(abs(x) for one in solids for x in one.middle)
            if max(map(abs, subtracted(position(T), tip))) > reach + tolerance:
                continue
            away, low, high = _hold_of(part, solids, T, tip, axis)
            if away > tolerance:
                continue
            if high - low > gap[0] + SLACK or max(-low, high) > 0.5 * gap[0] + tolerance:
                wide = f"{name} is {1000.0 * (high - low):.1f} mm wide, the fingers {1000.0 * gap[0]:.1f} mm apart"
            elif high - low >= gap[1] - SLACK:
                found.append((away, name, high - low))
        if found:
            _, name, across = min(found)
            if tell:
                self._history.set("width", across)
            return name
        if tell:
            x, y, z = (round(1000.0 * edge, 1) + 0.0 for edge in tip)
            why = f": {wide}" if wide else f" at {x:.1f}, {y:.1f}, {z:.1f} mm"
            self._note("EMPTY", f"the hand closes on nothing{why}")
        return None

    def _hold(self, name: str, tool: Transform) -> None:
        history, t = self._history, self._history.now
        span = self._span(name, t)
        flange = compose(tool, inverse(self.timeline.locate(t)[0].motion.frames.tool))
        T_flange_part = compose(inverse(flange), span.T)
        self._span_begins(name, SpanKind.HELD, T_flange_part)
        self._lift(name)
        history.set("held", name)
        history.grips.append((t, name))
        self._show(self._settings.scene.gripper.signal, True)
        carried = self._standing_on(name, span.T)
        if carried:
            history.set("stack", (name, carried))
            self._plan_unstack()
        if self._settings.sensing.regions:
            self._watch(SeenBody(name, T_flange_part), self.timeline.index_at(t), t)

    def _release(self, name: str) -> None:
        history, t = self._history, self._history.now
        T = compose(self._flange(t), self._span(name, t).T)
        history.set("held", None)
        history.set("stack", None)
        history.grips.append((t, None))
        history.drop(what="unstack")
        history.drop(what="cross", body=name)
        self._show(self._settings.scene.gripper.signal, False)
        self._let_go(name, T)

    # --- what stands and falls ---

    def _span_begins(self, name: str, kind: SpanKind, T: Transform, on: tuple[str, ...] = ()) -> None:
        history, t = self._history, self._history.now
        *before, last = self._spans(name)
        history.set(("spans", name), (*before, last._replace(end=t), PartSpan(t, kind, T, inf, on)))
        history.moves.append((t, name))

    def _let_go(self, name: str, T: Transform) -> None:
        """A part is at T and nothing holds it: it stands, or falls straight down."""
        found = self._below(name, T, self._history)
        if found.drop <= STANDS:
            self._come_to_rest(name, T, found.on)
            return
        if found.drop > FALLS:
            self._note("FALL", f"{name} falls {1000.0 * found.drop:.1f} mm onto {found.on[0]}")
        lasting = up_to_grid(sqrt(2.0 * found.drop / GRAVITY))
        self._span_begins(name, SpanKind.FALLS, T, found.on)
        low = T._replace(pz=T.pz - found.drop)
        self._put(name, self._settings.solids[name], low)  # what falls after it falls onto it
        self._history.plan(self._history.now + lasting, "land", name, low, found.on)
        if self._settings.sensing.regions:
            self._pass(name, self._settings.sensing.in_fall(name, T, lasting), 0.0, inf, carried=False)

    def _land(self, name: str, T: Transform, on: tuple[str, ...]) -> None:
        self._history.drop(what="cross", body=name)
        self._come_to_rest(name, T, on)

    def _come_to_rest(self, name: str, T: Transform, on: tuple[str, ...]) -> None:
        self._span_begins(name, SpanKind.RESTS, T, on)
        solids = self._settings.solids[name]
        self._put(name, solids, T)
        self._stand(name, T)
        if on[0] != FLOOR and not balanced(
            solids, T, (_placed(other, self._history) for other in on if other != FLOOR)
        ):
            self._note("EDGE", f"{name} rests on an edge of {on[0]}")

    def _plan_unstack(self) -> None:
        """Plan the fall of what stood on the part in the hand, for when the arm moves next."""
        history = self._history
        history.drop(what="unstack")
        t = history.now
        for index in range(self.timeline.index_at(t), len(self.timeline)):
            segment = self.timeline[index]
            if segment.phase is not Phase.REST and segment.finish > t:
                history.plan(max(segment.start, t), "unstack", carried=True)
                return

    def _unstack(self) -> None:
        history = self._history
        stack = history.get("stack")
        history.set("stack", None)
        if stack:
            self._fall_from(stack[1])

    def _fall_from(self, names: Iterable[str]) -> None:
        """Let parts fall whose support has gone, and those that stand on them."""
        waiting = sorted(names, key=lambda name: (self._span(name, self._history.now).T.pz, name))
        for name in waiting:
            span = self._span(name, self._history.now)
            if span.kind is not SpanKind.RESTS:
                continue
            found = self._below(name, span.T, self._history)
            if found.drop <= STANDS:
                continue
            above = self._standing_on(name, span.T)
            self._let_go(name, span.T)
            self._fall_from(above)

    def _below(self, name: str, T: Transform, history: WorldHistory) -> Below:
        solids = self._settings.solids[name]
        x, X, y, Y, _, top = bounds(solids, T)
        near = _near((x, X, y, Y, -inf, top), history)
        others = ((other, *_placed(other, history)) for other in near if other != name)
        return below(solids, T, others, self._settings.floor)

    def _stands_first_on(self, name: str) -> tuple[str, ...]:
        """Return what a part stands on that has stood there since the start; "" where nothing is just below it."""
        known = self._stood_on.get(name)
        if known is None:
            found = self._below(name, self._settings.parts[name].T_world_part, self._first)
            known = self._stood_on[name] = found.on if found.drop <= FALLS else ("",)
        return known

    def _standing_on(self, name: str, T: Transform) -> tuple[str, ...]:
        """The parts that stand on a body at T."""
        x, X, y, Y, low, top = bounds(self._settings.solids[name], T)
        found = []
        for other in _near((x, X, y, Y, low, top + FALLS), self._history):
            if other == name or other not in self._settings.parts:
                continue
            span = self._span(other, self._history.now)
            if span.kind is SpanKind.RESTS and span.T.pz > T.pz:
                one = (name, self._settings.solids[name], T, (x, X, y, Y, low, top))
                if below(self._settings.solids[other], span.T, [one], -inf).drop <= FALLS:
                    found.append(other)
        return tuple(found)

    # --- the grid of all that stands ---

    def _put(self, name: str, solids: Solids, T: Transform) -> None:
        self._lift(name)
        area = bounds(solids, T)
        covered = cells(area)
        keys = [("cell", *cell) for cell in covered] if covered is not None else [("cell",)]
        for key in keys:
            self._history.set(key, self._history.get(key, frozenset()) | {name})
        self._history.set(("place", name), (solids, T, area, tuple(keys)))

    def _lift(self, name: str) -> None:
        """Take a body out of the grid."""
        placed = self._history.get(("place", name))
        if placed is None:
            return
        for key in placed[3]:
            self._history.set(key, self._history.get(key) - {name})
        self._history.set(("place", name), None)

    # --- what brings and takes parts ---

    def _feed(self, place: int) -> None:
        history, feeder = self._history, self._settings.scene.feeders[place]
        used = history.get(("fed", place), 0)
        if used >= len(feeder.parts) and not feeder.again:
            return
        name = feeder.parts[used % len(feeder.parts)]
        if self._span(name, history.now).kind is not SpanKind.ABSENT:
            self._note("FEEDER", f"{name} does not come: it is there already")
            return
        history.set(("fed", place), used + 1)
        self._let_go(name, feeder.T_world_part or self._settings.parts[name].T_world_part)

    def _clear(self, place: int) -> None:
        """Take away the parts whose middle is in the zone of a sink."""
        zone, region = self._settings.sinks[place]
        gone, above = [], list[str]()
        for name in _near(bounds((region.solid,), zone), self._history):
            if name in self._settings.parts and self._span(name, self._history.now).kind is SpanKind.RESTS:
                solids, T, _ = _placed(name, self._history)
                if point_apart((region.solid,), zone, moved_point(T, solids[0].middle)) == 0.0:
                    gone.append(name)
                    above += self._standing_on(name, T)
        for name in gone:
            T = self._span(name, self._history.now).T
            self._span_begins(name, SpanKind.ABSENT, T)
            self._lift(name)
            self._see(name, frozenset())
        self._fall_from(name for name in dict.fromkeys(above) if name not in gone)

    # --- sensors ---

    def _segment(self, index: int, since: float) -> None:
        """Plan what the hand and the part that it holds cross in a segment, from a time on [s]."""
        self._watch(self._settings.hand, index, since)
        held = self._history.get("held")
        if held is not None:
            self._watch(SeenBody(held, self._span(held, since).T), index, since)
        if index + 1 < len(self.timeline):
            start = self.timeline[index + 1].start
            self._history.plan(start, "segment", index + 1, start, carried=True)

    def _watch(self, sight: SeenBody, index: int, since: float) -> None:
        segment = self.timeline[index]
        passage = self._settings.sensing.on_segment(sight, segment)
        self._pass(sight.body, passage, segment.start - since, segment.finish - since, carried=True)

    def _pass(self, body: str, passage: Passage, offset: float, until: float, *, carried: bool) -> None:
        """Plan crossings that come `offset` seconds later than they say, seen from now, and the state until then."""
        history = self._history
        inside = set(passage.begins_in)
        for crossing in passage.crossings:
            s = crossing.time + offset
            if s > 0.0:
                if s <= until:
                    history.plan(history.now + s, "cross", body, crossing.region, crossing.inside, carried=carried)
            elif crossing.inside:
                inside.add(crossing.region)
            else:
                inside.discard(crossing.region)
        self._see(body, frozenset(inside))

    def _cross(self, body: str, region: int, inside: bool) -> None:
        before: frozenset[int] = self._history.get(("in", body), frozenset())
        self._see(body, before | {region} if inside else before - {region})

    def _stand(self, name: str, T: Transform) -> None:
        if self._settings.sensing.regions:
            self._see(name, self._settings.sensing.standing(name, T))

    def _see(self, body: str, inside: frozenset[int]) -> None:
        """A body is in these regions from now on."""
        history = self._history
        before: frozenset[int] = history.get(("in", body), frozenset())
        if inside == before:
            return
        history.set(("in", body), inside)
        for region in sorted(before ^ inside):
            bodies: frozenset[str] = history.get(("region", region), frozenset()) ^ {body}
            history.set(("region", region), bodies)
            self._show(self._settings.scene.sensors[region].signal, bool(bodies))

    def _show(self, signal: int, on: bool) -> None:
        """The state of a sensor goes to its signal; a negative one shows the opposite. 0: to none."""
        if signal:
            self._switch(abs(signal), on is (signal > 0))


def _placed(name: str, history: WorldHistory) -> tuple[Solids, Transform, Bounds]:
    """A body in the grid."""
    solids, T, area, _ = history.get(("place", name))
    return solids, T, area


def _near(area: Bounds, history: WorldHistory) -> list[str]:
    """The bodies in the grid whose bounds overlap an area, by name."""
    found = set(history.get(("cell",), ()))
    covered = cells(area)
    if covered is None:
        found.update(name for name in history.get("names") if history.get(("place", name)))
    for cell in covered or ():
        found |= history.get(("cell", *cell), frozenset())
    return sorted(name for name in found if overlap(area, history.get(("place", name))[2]))


def _fallen(T: Transform, seconds: float) -> Transform:
    """Return where a body is that has fallen from rest for so long."""
    return T._replace(pz=T.pz - 0.5 * GRAVITY * seconds * seconds)


def _hold_of(
    part: ScenePart, solids: Solids, T: Transform, tip: tuple[float, float, float], axis: tuple[float, float, float]
) -> tuple[float, float, float]:
    """Return how far the tool's tip is from where a part can be taken, and from where to where it reaches there along
    the closing axis, seen from the tip [m].
    """
    if not part.grasp:
        low, high = spread(solids, T, axis)
        at = dot(tip, axis)
        return point_apart(solids, T, tip), low - at, high - at
    found = []
    for place in part.grasp:
        away = subtracted(moved_point(T, place.point), tip)
        found.append((sqrt(dot(away, away)), dot(away, axis), place.width))
    away_from, offset, wide = min(found)
    return away_from, offset - 0.5 * wide, offset + 0.5 * wide
