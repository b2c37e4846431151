"""Simulate a world forward in time, event by event: the hand takes and releases parts, parts fall, feeders bring parts,
sinks remove parts, sensors detect bodies, and rules set signals."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from math import inf, sqrt

from vrs_cli.engine.position import joints_at, world_pose
from vrs_cli.kinematics.transform import Transform, compose, inverse, moved_point, position
from vrs_cli.trajectory.instant import on_grid, up_to_grid
from vrs_cli.trajectory.segment import Phase
from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.values import world
from vrs_cli.values.commands import HAND, Event, Frames
from vrs_cli.world.history import (
    CHANGES,
    FALLS,
    FLOOR,
    MOVES,
    NOTES,
    SEES,
    WorldHistory,
    below,
    below_in,
    is_balanced,
    lift,
    near,
    put,
    standing_body,
)
from vrs_cli.world.sensing import GRAVITY, Passage, SeenBody
from vrs_cli.world.settings import SLACK, WorldSettings, add_grip, part_between, restore
from vrs_cli.world.solids import bounds, point_apart

STANDS = 1e-7  # [m] tolerance for support: a part this close above a surface rests on it
MAX_AT_ONE_INSTANT = 1000  # maximum number of events at one instant; stops rules that trigger each other


class ArmEnters(world.Happening, frozen=True):
    """A planned event: the arm begins to move along the segment with this index. Crossings are searched only after
    `since` [s]."""

    segment: int
    since: float

    @property
    def rank(self) -> int:
        return 2


class StackFalls(world.Happening, frozen=True):
    """A planned event: the bodies lying on the held part fall, because the arm begins to move this part away."""

    @property
    def rank(self) -> int:
        return 3


class Simulation:
    """The simulation of one timeline. `history` contains everything computed so far. Only one thread may use it at a
    time."""

    def __init__(self, settings: WorldSettings, timeline: Timeline, history: WorldHistory) -> None:
        self._settings, self._timeline, self.history = settings, timeline, history

    # --- forward in time ---

    @property
    def next_time(self) -> float:
        """Return the time of the next event [s]; infinity if there is none."""
        history, timeline = self.history, self._timeline
        index = history.get("events")
        event = timeline.event(index).time if index < timeline.event_count else inf
        return min(event, history.due[0].time if history.due else inf)

    def advance(self, until: float) -> None:
        """Simulate all events up to a time [s]."""
        history, timeline = self.history, self._timeline
        instant, count = -inf, 0
        while (coming := self.next_time) <= until and coming < inf:
            history.now = max(history.now, coming)
            index = history.get("events")
            if index < timeline.event_count and timeline.event(index).time <= coming:
                history.set("events", index + 1)
                self._set_channel(timeline.event(index))
                continue
            count = count + 1 if coming == instant else 0  # number of planned events so far at this instant
            instant = coming
            if count > MAX_AT_ONE_INSTANT:
                self._note("ENDLESS", "rules of the cell drive each other without end")
                history.set("due", tuple(one for one in history.due if one.time > coming))
            else:
                self._happen(history.take().what)
        history.now = max(history.now, until) if until < inf else history.now

    def begin(self) -> None:
        """Start the simulation at the start of the timeline, in the initial state of the scene."""
        settings, history = self._settings, self.history
        start = history.now = self._timeline.start
        history.set("events", 0)
        for key, value in (("hand", 0.0), ("held", None), ("width", 0.0), ("stack", ())):
            history.set(key, value)
        for name, part in settings.parts.items():
            kind = world.SpanKind.ABSENT if name in settings.fed else world.SpanKind.RESTS
            history.add(("spans", name), world.PartBegin(start, kind, part.T_world_part))
            if kind is world.SpanKind.RESTS:
                self._stand(name, part.T_world_part)
        for region, sensor in enumerate(settings.scene.sensors):
            if not history.get(("region", region)):
                self._show(sensor.signal, False)
        self.follow_arm()

    def resume(self, state: world.WorldState) -> None:
        """Start the simulation at the start of the timeline, in a saved state."""
        restore(self.history, self._settings, state)
        self.history.set("events", self._timeline.events_by(state.time, before=True))
        self.follow_arm()

    def follow_arm(self) -> None:
        """Plan the future events that the arm's motion causes. They replace all such events planned before."""
        history = self.history
        history.drop(lambda what: what.follows_arm)
        if self._settings.sensing.regions:
            history.plan(history.now, ArmEnters(self._timeline.index_at(history.now), history.now))
        if history.get("stack"):
            self._plan_unstack()

    def _happen(self, what: world.Happening) -> None:
        match what:
            case world.FingersArrive(before, after):
                if self.history.get("held") is None:
                    self._take(before, after)
                add_grip(self.history, self._settings)
            case world.SignalSwitches(signal, on):
                self._switch(signal, on)
            case world.PartComes(feeder):
                self._feed(feeder)
            case world.PartsGo(sink):
                self._clear(sink)
            case world.PartLands(part, T, on):
                self.history.drop(_crossing(part))
                self._come_to_rest(part, T, on)
            case world.BodyCrosses(body, region, inside):
                before = self.history.get(("in", body), frozenset[int]())
                self._see(body, before | {region} if inside else before - {region})
            case ArmEnters(segment, since):
                self._enter(segment, since)
            case StackFalls():
                stack = self.history.get("stack")
                self.history.set("stack", ())
                self._fall_from(stack)

    def _note(self, kind: str, text: str) -> None:
        self.history.add(NOTES, (self.history.now, kind, text))

    # --- poses and spans ---

    def span(self, name: str, t: float) -> world.PartBegin:
        """Return the state of a part at a time [s], or its first known state. Raises KeyError."""
        spans: Sequence[world.PartBegin] = self.history.rows(("spans", name))
        if not spans:
            raise KeyError(name)
        return spans[max(self.history.count(("spans", name), t) - 1, 0)]

    def flange(self, t: float) -> Transform:
        """Return T_world_flange at a time [s]."""
        arm, frames = self._settings.arm, self._timeline.locate(t)[0].motion.frames
        return world_pose(arm, Frames(frames.base), joints_at(arm, self._timeline, t))

    def tool(self, t: float) -> Transform:
        """Return T_world_tool at a time [s]."""
        return compose(self.flange(t), self._timeline.locate(t)[0].motion.frames.tool)

    # --- signals ---

    def _set_channel(self, event: Event) -> None:
        """Apply an event of the timeline: set a signal, or open or close the hand."""
        if event.observed:
            return
        if event.channel != HAND:
            if event.channel not in self._settings.sensed:
                self._switch(event.channel, event.value > 0.5)
            return
        history, opening = self.history, self._settings.opening
        gap = history.get("hand") * opening
        for due in history.due:
            # the fingers are still moving: use the gap at which they started
            if isinstance(due.what, world.FingersArrive):
                gap = due.what.before
        history.set("hand", event.value)
        history.drop(lambda what: isinstance(what, world.FingersArrive))
        if event.value * opening < gap:
            history.plan(event.time + event.duration, world.FingersArrive(gap, event.value * opening))
            return
        if (name := history.get("held")) is not None and event.value * opening > history.get("width") + SLACK:
            self._release(name)
        add_grip(history, self._settings)

    def _switch(self, signal: int, on: bool) -> None:
        """Set the state of a signal, and plan the events that this change triggers."""
        history, settings = self.history, self._settings
        if history.get(("signal", signal), False) is on:
            return
        history.set(("signal", signal), on)
        now = history.now
        if signal in settings.computed:
            history.add((CHANGES, signal), (now, on))
            history.add(CHANGES, (now, signal, on))
        number = signal if on else -signal
        for place, rule in settings.rules.get(number, ()):
            used = history.get(("used", place), 0)
            if rule.rows and used == len(rule.rows) and not rule.again:
                continue
            history.set(("used", place), 1 if used == len(rule.rows) else used + 1)
            assert rule.sets is not None
            then = now + on_grid(rule.after)
            history.plan(then, world.SignalSwitches(abs(rule.sets), rule.sets > 0))
            if rule.lasting is not None:
                history.plan(then + on_grid(rule.lasting), world.SignalSwitches(abs(rule.sets), rule.sets < 0))
        for place, feeder in enumerate(settings.scene.feeders):
            if feeder.when == number:
                history.plan(now + on_grid(feeder.after), world.PartComes(place))
        for place, sink in enumerate(settings.scene.sinks):
            if sink.when == number:
                history.plan(now + on_grid(sink.after), world.PartsGo(place))

    def _show(self, signal: int, on: bool) -> None:
        """Set the signal of a sensor to the sensor's state. A negative signal number means the opposite state, 0 means
        no signal."""
        if signal:
            self._switch(abs(signal), on is (signal > 0))

    # --- the hand ---

    def _take(self, before: float, after: float) -> None:
        """Take the part between the fingers, if there is one. Their gap has closed from `before` to `after` [m]."""
        history, t = self.history, self.history.now
        tool = self.tool(t)
        (x, y, z), far = position(tool), self._settings.scene.gripper.tolerance
        bodies = near(history, (x - far, x + far, y - far, y + far, z - far, z + far))
        parts = ((name, self.span(name, t)) for name in bodies if name in self._settings.parts)
        standing = ((name, span.T) for name, span in parts if span.kind is world.SpanKind.RESTS)
        if (found := part_between(self._settings, standing, tool, (before, after), self._note)) is not None:
            history.set("width", found[1])
            self._hold(found[0], tool)

    def _hold(self, name: str, tool: Transform) -> None:
        history, t = self.history, self.history.now
        T = self.span(name, t).T
        flange = compose(tool, inverse(self._timeline.locate(t)[0].motion.frames.tool))
        T_flange_part = compose(inverse(flange), T)
        self._span_begins(name, world.SpanKind.HELD, T_flange_part)
        lift(history, name)
        history.set("held", name)
        self._show(self._settings.scene.gripper.signal, True)
        if carried := self._standing_on(name, T):
            history.set("stack", carried)
            self._plan_unstack()
        if self._settings.sensing.regions:
            self._watch(SeenBody(name, T_flange_part), self._timeline.index_at(t), t)

    def _release(self, name: str) -> None:
        history, t = self.history, self.history.now
        T = compose(self.flange(t), self.span(name, t).T)
        history.set("held", None)
        history.set("stack", ())
        history.drop(lambda what: isinstance(what, StackFalls))
        history.drop(_crossing(name))
        self._show(self._settings.scene.gripper.signal, False)
        self._let_go(name, T)

    # --- parts at rest and falling parts ---

    def _span_begins(self, name: str, kind: world.SpanKind, T: Transform, on: tuple[str, ...] = ()) -> None:
        t = self.history.now
        self.history.add(("spans", name), world.PartBegin(t, kind, T, on))
        self.history.add(MOVES, (t, name))

    def _let_go(self, name: str, T: Transform) -> None:
        """Let a part at T come to rest if something supports it; otherwise let it fall straight down."""
        history, settings = self.history, self._settings
        found = below_in(history, name, settings.solids[name], T, settings.floor)
        if found.drop <= STANDS:
            self._come_to_rest(name, T, found.on)
            return
        if found.drop > FALLS:
            self._note("FALL", f"{name} falls {1000.0 * found.drop:.1f} mm onto {found.on[0]}")
        lasting = up_to_grid(sqrt(2.0 * found.drop / GRAVITY))
        self._span_begins(name, world.SpanKind.FALLS, T, found.on)
        low = T._replace(pz=T.pz - found.drop)
        # record where the part will rest, so that parts that fall later can land on it
        put(history, name, settings.solids[name], low)
        history.plan(history.now + lasting, world.PartLands(name, low, found.on))
        if settings.sensing.regions:
            self._pass(name, settings.sensing.in_fall(name, T, lasting), 0.0, inf, moved=False)

    def _come_to_rest(self, name: str, T: Transform, on: tuple[str, ...]) -> None:
        history, solids = self.history, self._settings.solids[name]
        self._span_begins(name, world.SpanKind.RESTS, T, on)
        put(history, name, solids, T)
        self._stand(name, T)
        if on[0] != FLOOR and not is_balanced(
            solids, T, (standing_body(history, other) for other in on if other != FLOOR)
        ):
            self._note("EDGE", f"{name} rests on an edge of {on[0]}")

    def _plan_unstack(self) -> None:
        """Plan that the bodies lying on the held part fall when the arm next moves."""
        history, timeline = self.history, self._timeline
        history.drop(lambda what: isinstance(what, StackFalls))
        t = history.now
        for index in range(timeline.index_at(t), len(timeline)):
            segment = timeline[index]
            if segment.phase is not Phase.REST and segment.finish > t:
                history.plan(max(segment.start, t), StackFalls())
                return

    def _fall_from(self, names: Iterable[str]) -> None:
        """Let each named part fall if it has lost its support, and then the parts that rested on it."""
        history, settings = self.history, self._settings
        for name in sorted(names, key=lambda name: (self.span(name, history.now).T.pz, name)):
            span = self.span(name, history.now)
            if span.kind is not world.SpanKind.RESTS:
                continue
            if below_in(history, name, settings.solids[name], span.T, settings.floor).drop > STANDS:
                above = self._standing_on(name, span.T)
                self._let_go(name, span.T)
                self._fall_from(above)

    def _standing_on(self, name: str, T: Transform) -> tuple[str, ...]:
        """Return the parts that rest on a body at T."""
        settings, history = self._settings, self.history
        x, X, y, Y, low, top = bounds(settings.solids[name], T)
        found = []
        for other in near(history, (x, X, y, Y, low, top + FALLS)):
            if other == name or other not in settings.parts:
                continue
            span = self.span(other, history.now)
            if span.kind is world.SpanKind.RESTS and span.T.pz > T.pz:
                one = (name, settings.solids[name], T, (x, X, y, Y, low, top))
                if below(settings.solids[other], span.T, [one], -inf).drop <= FALLS:
                    found.append(other)
        return tuple(found)

    # --- feeders and sinks ---

    def _feed(self, place: int) -> None:
        history, feeder = self.history, self._settings.scene.feeders[place]
        used = history.get(("fed", place), 0)
        if used >= len(feeder.parts) and not feeder.again:
            return
        name = feeder.parts[used % len(feeder.parts)]
        if self.span(name, history.now).kind is not world.SpanKind.ABSENT:
            self._note("FEEDER", f"{name} does not come: it is there already")
            return
        history.set(("fed", place), used + 1)
        self._let_go(name, feeder.T_world_part or self._settings.parts[name].T_world_part)

    def _clear(self, place: int) -> None:
        """Remove the parts at rest whose centre is in the zone of a sink."""
        history, (zone, region) = self.history, self._settings.sinks[place]
        gone, above = [], list[str]()
        for name in near(history, bounds((region.solid,), zone)):
            if name in self._settings.parts and self.span(name, history.now).kind is world.SpanKind.RESTS:
                solids, T, _ = standing_body(history, name)
                if point_apart((region.solid,), zone, moved_point(T, solids[0].middle)) == 0.0:
                    gone.append(name)
                    above += self._standing_on(name, T)
        for name in gone:
            self._span_begins(name, world.SpanKind.ABSENT, self.span(name, history.now).T)
            lift(history, name)
            self._see(name, frozenset())
        self._fall_from(name for name in dict.fromkeys(above) if name not in gone)

    # --- sensors ---

    def _enter(self, index: int, since: float) -> None:
        """Plan when the hand and the held part enter and leave sensor regions during a segment, after `since` [s]."""
        self._watch(self._settings.hand, index, since)
        if (held := self.history.get("held")) is not None:
            self._watch(SeenBody(held, self.span(held, since).T), index, since)
        if index + 1 < len(self._timeline):
            start = self._timeline[index + 1].start
            self.history.plan(start, ArmEnters(index + 1, start))

    def _watch(self, sight: SeenBody, index: int, since: float) -> None:
        segment = self._timeline[index]
        passage = self._settings.sensing.on_segment(sight, segment)
        self._pass(sight.body, passage, segment.start - since, segment.finish - since, moved=True)

    def _pass(self, body: str, passage: Passage, offset: float, until: float, *, moved: bool) -> None:
        """Plan the region crossings that a passage lists, with `offset` [s] added to their times, and record the
        regions that contain the body now."""
        history = self.history
        inside = set(passage.begins_in)
        for crossing in passage.crossings:
            s = up_to_grid(crossing.time) + offset
            if s > 0.0:
                if s <= until:
                    history.plan(history.now + s, world.BodyCrosses(body, crossing.region, crossing.inside, moved))
            elif crossing.inside:
                inside.add(crossing.region)
            else:
                inside.discard(crossing.region)
        self._see(body, frozenset(inside))

    def _stand(self, name: str, T: Transform) -> None:
        if self._settings.sensing.regions:
            self._see(name, self._settings.sensing.regions_of(name, T))

    def _see(self, body: str, inside: frozenset[int]) -> None:
        """Record the sensor regions that now contain a body, and set the signals of the sensors."""
        history = self.history
        before = history.get(("in", body), frozenset[int]())
        if inside == before:
            return
        history.set(("in", body), inside)
        for region in sorted(before ^ inside):
            bodies = history.get(("region", region), frozenset[str]()) ^ {body}
            history.set(("region", region), bodies)
            if bodies <= {body}:  # the sensor changes: the first body enters, or the last one leaves
                history.add((SEES, region), (history.now, bool(bodies)))
            self._show(self._settings.scene.sensors[region].signal, bool(bodies))


def _crossing(body: str) -> Callable[[world.Happening], bool]:
    return lambda what: isinstance(what, world.BodyCrosses) and what.body == body
