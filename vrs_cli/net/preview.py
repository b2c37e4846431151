"""What a robot behind a line with delays will do, with the commands that are still on their way to it. Pure.

Who commands knows what is on its way, and can plan it as the robot will: f of the same timeline, at the time at which
the command is expected there. What it changes is unconfirmed until the robot's own change has come.
"""

from __future__ import annotations

from math import inf
from threading import Lock

from msgspec import Struct, structs

from vrs_cli.engine.book import Book
from vrs_cli.engine.clock import VirtualClock
from vrs_cli.engine.engine import Bookmark, Engine
from vrs_cli.engine.settings import Settings
from vrs_cli.errors import VrsError
from vrs_cli.interfaces.roles.preview import Expected
from vrs_cli.net.mirror import Mirror
from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.values.commands import Request

UNCONFIRMED = 1 << 40  # added to the numbers of motions that are previewed: no motion of a robot has such a number


class Underway(Struct, frozen=True):
    """A command that is not in the timeline that is known here, issued at that time of the robot's clock [s]. What has
    no `request` cannot be planned here, and may change all from its arrival on. `text`: as it was given; `version`: of
    the timeline with it, where the robot has said that it is done.
    """

    request: Request | None
    issued: float
    text: str = ""
    version: int | None = None


class _ArrivalClock(VirtualClock):
    """The robot's clock when a command is expected there: what is before has happened by then."""

    realtime = True


class PreviewPlan(Struct, frozen=True):
    """What all that is under way makes of the timeline that is `known`; `settings`: those after each command."""

    known: Timeline
    timeline: Timeline
    expected: tuple[Expected, ...] = ()
    settings: tuple[Settings, ...] = ()


class Preview:
    """What is known of a robot, with all that is on its way to it. `forward`: the delay D_f that is expected [s]. Any
    thread may call any method.
    """

    def __init__(self, followed: Mirror, forward: float) -> None:
        self.forward = forward
        self._followed = followed
        self._engine = Engine(followed.arm.model, clock=_ArrivalClock())
        self._underway: dict[int, Underway] = {}  # in the order of sending
        self._told = self._settings = followed.settings  # by the robot, and with what it has done since
        self._plan = self._planned_after(followed.timeline)
        self._stale = False
        self._lock = Lock()

    # --- what is sent, and what is answered ---

    def sent(self, id: int, request: Request | None, issued: float, text: str = "") -> Expected:
        """A command is on its way, issued at that time of the robot's clock [s]; what is expected of it. None: it
        cannot be planned here.
        """
        with self._lock:
            self._underway[id], self._stale = Underway(request, issued, text), True
            return self._planned().expected[-1]

    def begun(self, id: int) -> None:
        """The robot is at it. What changes by one that cannot be planned here is told as it comes."""
        with self._lock:
            if id in self._underway and self._underway[id].request is None:
                self._forget(id)

    def done(self, id: int, version: int) -> None:
        """The robot has done it. The timeline has that version since, which may still be on its way."""
        with self._lock:
            if id in self._underway:
                self._underway[id], self._stale = structs.replace(self._underway[id], version=version), True

    def refused(self, id: int) -> None:
        """The robot has not done it."""
        with self._lock:
            self._forget(id)

    def _forget(self, id: int) -> None:
        self._stale |= self._underway.pop(id, None) is not None

    # --- what is expected ---

    @property
    def plan(self) -> PreviewPlan:
        """The timeline with all that is under way, and what is expected of each command, in the order of sending."""
        with self._lock:
            return self._planned()

    @property
    def timeline(self) -> Timeline:
        return self.plan.timeline

    @property
    def expected(self) -> tuple[Expected, ...]:
        return self.plan.expected

    @property
    def unconfirmed(self) -> float:
        """From when on [s] the timeline is not what the robot has said; infinity where it is."""
        return min((it.begin for it in self.expected if it.begin is not None), default=inf)

    def _planned(self) -> PreviewPlan:
        """Plan anew where something was sent, or the robot's own change has come."""
        known = self._followed.timeline
        if self._stale or self._plan.known is not known:
            self._confirm(known.version)
            self._plan, self._stale = self._planned_after(known), False
        return self._plan

    def _confirm(self, version: int) -> None:
        """What the timeline of that version has is no longer under way."""
        if self._told is not self._followed.settings:
            self._told = self._settings = self._followed.settings
        confirmed = {id for id, it in self._underway.items() if it.version is not None and it.version <= version}
        for it, settings in zip(self._plan.expected, self._plan.settings, strict=True):
            self._settings = settings if it.id in confirmed else self._settings
        self._underway = {id: it for id, it in self._underway.items() if id not in confirmed}

    def _planned_after(self, known: Timeline) -> PreviewPlan:
        engine, expected, settings = self._engine, list[Expected](), list[Settings]()
        if not self._underway:
            return PreviewPlan(known, known)
        engine.take_up(Bookmark(Book(known, known, number=UNCONFIRMED), self._settings, known.start))
        for id, it in self._underway.items():
            engine.clock.advance(it.issued + self.forward)
            begin, refused = (engine.now, None) if it.request is None else self._begin(it.request, it.issued)
            expected.append(Expected(id, it.text, it.issued, begin, refused, it.request is not None))
            settings.append(engine.settings)
        return PreviewPlan(known, engine.timeline, tuple(expected), tuple(settings))

    def _begin(self, request: Request, issued: float) -> tuple[float | None, VrsError | None]:
        """Plan it: from when on it changes the timeline, or why the robot will not do it."""
        engine = self._engine
        count = len(engine.deltas)
        try:
            engine.begin(request, program=False, issued=issued)
        except VrsError as error:
            return None, error
        return min((delta.cut for delta in engine.deltas[count:]), default=None), None
