"""Serve one robot, apart from its users: its session, lease, body, durable log, and the broadcast of its changes."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Iterable, Sequence
from enum import Enum
from itertools import islice
from math import inf
from pathlib import Path
from threading import Lock
from typing import Any

from msgspec import Struct

from vrs_cli.engine.book import WindowSize
from vrs_cli.engine.clock import WallClock
from vrs_cli.engine.feed import TimelineReplaced
from vrs_cli.errors import IllegalValue, LimitReached, VrsError
from vrs_cli.files.journal import Journal, keep_journal, take_up
from vrs_cli.files.opening import Folder
from vrs_cli.interfaces.dialogue import Dialogue, internal_error
from vrs_cli.interfaces.port.port import Console
from vrs_cli.interfaces.port.user_session import UserSession
from vrs_cli.interfaces.session.session import Session
from vrs_cli.interfaces.station.body import ClockSeen, RobotBody
from vrs_cli.interfaces.users import Notice, RobotLease, UserState, check_may, may_all, must_drive, need_of
from vrs_cli.kinematics.model import RobotModel
from vrs_cli.language.run.signals import Cell
from vrs_cli.language.text.ast import Instruction, ProgramHeader
from vrs_cli.language.text.parser import parse_prompt
from vrs_cli.language.words.word import Role
from vrs_cli.net import messages
from vrs_cli.net.broadcast import Broadcast
from vrs_cli.net.course_teller import CourseTeller, CourseThread
from vrs_cli.net.delivery_log import prefixes_of
from vrs_cli.net.durable_log import Audit, DurableLog, MemoryFile, RobotFiles
from vrs_cli.net.limits import USUAL, Allowance, Bucket, advice, check_growth
from vrs_cli.net.timesync import OneWay
from vrs_cli.net.tokens import Grant
from vrs_cli.values.commands import SetParameter
from vrs_cli.values.measured import Report
from vrs_cli.values.replies import Reply, StyledLine
from vrs_cli.wire.cells import cell_record
from vrs_cli.wire.records import RecordError
from vrs_cli.wire.reports import MAX_MESSAGE_REPORTS, ReportRows, reports_of, row_fields, row_parts

MAX_RATE, MAX_AT_ONCE = 2000.0, 100_000.0  # maximum reports of a body per second, and in one burst after a reconnection
REFUSED_EVERY = 1.0  # [s] minimum time between two refusals of reports
STATUS_EVERY = 1.0  # [s] time between two messages with the body's counts and clock
DELAY_SHARE = 1.0 / 16.0  # weight of the newest delay in the moving average of the delays


class ServedBody:
    """The body (the real or simulated arm) of a served robot: passes messages of clients to `body`, and its state to
    all clients. Call all methods in the thread of the connections.
    """

    def __init__(self, body: RobotBody, broadcast: Broadcast, wall: Callable[[], float]) -> None:
        self.body, self._broadcast, self._wall = body, broadcast, wall
        self._clock, self._budget = OneWay(), Bucket(MAX_RATE, MAX_AT_ONCE, wall())
        self._refused_at = self._told_at = -inf
        self._told = messages.BodyStatus()

    # --- messages of clients ---

    def embody(self, name: str, message: messages.Embody) -> messages.Embodied:
        """Make the client `name` the body, or release it from this role. Raises RequestRefused if another client is the
        body."""
        body = self.body
        if not message.held:
            body.leave(name)
            return messages.Embodied(message.id, message.first)
        if body.name != name:
            self._clock = OneWay()
        return messages.Embodied(message.id, body.embody(name, message.first), body.order, body.ordered_at)

    def take(self, name: str, message: messages.Measured) -> None:
        """Take reports of the client `name`. Raises VrsError for wrong reports, at most once a second."""
        try:
            came = self.body.now()
            self.body.check_is(name)
            if not self._budget.remaining(self._wall()) >= 0.0:
                raise LimitReached(f"more than {MAX_RATE:g} reports a second", "send fewer, or wait")
            self._budget.spend(len(message.times), self._wall())
            try:
                reports = reports_of(message, self.body.record.joint_count)
            except RecordError as wrong:
                raise IllegalValue(f"reports: {wrong}") from None
            self.body.take(reports, message.first, name)
            self._clock.hear(message.sent, came, message.round_trip)
            age, known, before = came - reports[-1].t, self._clock.estimate, self.body.clock
            assert known is not None, "a message was heard"
            delay = age if before == ClockSeen() else before.delay + (age - before.delay) * DELAY_SHARE
            self.body.clock = ClockSeen(known.offset, known.drift, delay)
        except VrsError:
            wall = self._wall()
            if wall >= self._refused_at + REFUSED_EVERY:
                self._refused_at = wall
                raise

    def window(self, message: messages.MeasuredWindow) -> messages.ShownMeasured:
        """Return the reports of a time interval, as many as fit into one message."""
        count = self._broadcast.measured.count
        end = inf if message.end is None else message.end
        found = list(islice(self.body.record.view.between(message.begin, end), MAX_MESSAGE_REPORTS + 1))
        parts = tuple(ReportRows(**row_fields(part)) for part in row_parts(found[:MAX_MESSAGE_REPORTS]))
        return messages.ShownMeasured(message.id, parts, count, goes_on=len(found) > MAX_MESSAGE_REPORTS)

    # --- the state for all clients ---

    def tick(self, *, changed: bool = False) -> None:
        """Announce the state of the body: immediately if it has `changed`, otherwise once a second."""
        wall, body = self._wall(), self.body
        unknown = body.unknown_since
        changed = changed or (unknown is None) != (self._told.unknown is None)
        if not changed and wall < self._told_at + STATUS_EVERY:
            return
        self._told_at = wall
        status = messages.BodyStatus(body.view, unknown)
        if status != self._told:
            self._told = status
            self._broadcast.announce(status)


MEASURED_SECONDS = 3600.0  # [s] time for which reports stay in memory; the journal keeps all reports
SIZE_CHECK_S = 0.1  # [s] minimum time between checks of how much memory a robot uses; a check of a large robot is slow
LATELY = 1.0  # [s] time after a request during which a user counts as active
# commands that are allowed even if the robot has reached a limit
FREEING = frozenset(("ABORT", "KILL", "ZERO", "UNDO", "FDELETE", "DELETEB", "EXIT"))


LeaseStep = tuple[RobotLease, tuple[Notice, ...]]  # the new lease, and the notices for users


class WhenGone(Enum):
    """The action on a running program when its driver disconnects."""

    GO_ON = "go-on"
    PAUSE = "pause"
    ABORT = "abort"


class Driving:
    """The lease of one robot. Any thread may call any method; `notify` is called in the same thread with each change.
    `by_asking`: a user gets the lease only by requesting it, not by giving a command."""

    def __init__(
        self, wall: Callable[[], float], notify: Callable[[RobotLease, Notice | None], None], *, by_asking: bool = False
    ) -> None:
        self._wall, self._notify, self._by_asking = wall, notify, by_asking
        self._lock = Lock()
        self.lease = RobotLease()

    def may(self, who: str) -> None:
        """Check that a user may give commands. If nobody has the lease, the user gets it, unless users must request it.
        Raises LeaseHeld."""
        with self._lock:
            now = self._wall()
            if self.lease.drives(who):
                self.lease = self.lease.beat(who, now)
                return
            if not self.lease.is_free(now):
                self.lease.check(who)
            if self._by_asking and not self.lease.holder:
                return
            self._take(self.lease.acquire(who, now))

    def change(self, step: Callable[[RobotLease, float], LeaseStep]) -> None:
        """Change the lease by a step such as `acquire`, at the current time. Raises LeaseHeld."""
        with self._lock:
            self._take(step(self.lease, self._wall()))

    def beat(self, who: str) -> None:
        """Record that a message of a user has arrived. If the user is the driver, this extends the lease."""
        with self._lock:
            if self.lease.drives(who):
                self.lease = self.lease.beat(who, self._wall())

    def take_lapsed(self) -> str:
        """End the lease of a driver who was silent for too long; return the driver's name, "" if there is none."""
        with self._lock:
            lease, now = self.lease, self._wall()
            if not lease.holder or not lease.is_free(now):
                return ""
            self._take(lease.leave(lease.holder, now))
            return lease.holder

    def _take(self, step: LeaseStep) -> None:
        before, (self.lease, notices) = self.lease, step
        for notice in notices:
            self._notify(self.lease, notice)
        if not notices and self.lease.holder != before.holder:
            self._notify(self.lease, None)


class Plan(Struct, frozen=True):
    """The settings with which a robot is served.

    `folder`: the folder of its files. `journal`: the file for its timeline; None: no file. `realtime`: seconds of the
    robot's clock per second; None: virtual time. `one_user`: all clients belong to one user, who gets the lease only by
    requesting it, not by giving a command. `idle`: time without users and viewers after which the robot is paused [s].
    `reach`: the part of the journal that stays in memory. `cell`: the cell around the robot. `styled`: renders a reply
    as lines of a given width, for clients that request them with `rendered`.
    """

    model: RobotModel
    folder: Path
    journal: Path | None = None
    realtime: float | None = None
    causality: str = ""
    when_gone: WhenGone = WhenGone.GO_ON
    allowance: Allowance = USUAL
    one_user: bool = False
    idle: float = inf
    reach: WindowSize = WindowSize()
    cell: Cell | None = None
    styled: Callable[[Reply, int], Iterable[StyledLine]] = lambda _reply, _columns: ()


class _LeasedSession(Session):
    """A session in which only the user with the lease may give commands."""

    driving: Driving

    def check_may(self, said: str, wanted: Role) -> None:
        check_may(said, wanted, self.user_state.role)
        if must_drive(said, wanted, self.user_state.role):
            self.driving.may(self.user_state.name)


class ServedRobot:
    """A robot that is served. `said`: the queue of calls for the thread of the connections; `wake` is called, in any
    thread, when it has entries. `tell`: takes messages for the operator of the server. `robots`: returns the names of
    the robots that a grant allows. `driven`: called when the lease changes. `lost`: called with the reason when the
    journal cannot be written. `touched`: functions that flush sockets with new messages. Raises FileError, FileDamaged,
    UsageError if the robot cannot be served.
    """

    def __init__(
        self,
        name: str,
        plan: Plan,
        wake: Callable[[], None],
        audit: Audit,
        tell: Callable[[str], None],
        robots: Callable[[Grant], tuple[str, ...]],
        wall: Callable[[], float],
        driven: Callable[[RobotLease, Notice | None], None],
        lost: Callable[[str], None],
    ) -> None:
        self.name, self.plan, self.allowance, self.robots = name, plan, plan.allowance, robots
        self.audit, self.wall, self._wake, self._tell, self._lost = audit, wall, wake, tell, lost
        self.said: deque[Callable[[], None]] = deque()
        self._woken = False
        self.touched: dict[Callable[[], None], None] = {}
        self.ended: Callable[[], None] = lambda: None  # called when a request of a user has ended
        self.asked_at: dict[UserSession, float] = {}  # [s] time of the last request of each user
        self.driving = Driving(wall, driven, by_asking=plan.one_user)
        self.folder = Folder(plan.folder, closed=True)
        self.files = RobotFiles(self.folder, plan.allowance)
        self.prefixes = prefixes_of((plan.folder, plan.journal and plan.journal.parent))
        self.console = Console()
        self.session = self._session()
        self.lookers = plan.allowance.of_looking(plan.allowance.all_looking, wall())
        self._journal: Journal | None = None
        self._memory: MemoryFile | None = None
        self._unwritten: list[Report] = []  # body reports that are not in the journal yet
        self.durable_log = self._open_durable_log()
        engine = self.session.engine
        self.cell: dict[str, Any] | None = None  # the cell's data for clients
        if plan.cell is not None:
            self.session.driver.surround(plan.cell)
            self.cell = cell_record(plan.cell)
            if self.cell is None:
                tell(f"{name}: its cell is too large for clients, which show no parts (at most 1 MB of JSON)")
        if plan.causality:
            engine.perform(SetParameter("CAUSALITY", plan.causality))
        self._self = UserSession(self.session, UserState())
        self._events = engine.events.subscribe(woken=self.wake)
        first = self._events.take(0.0)
        assert isinstance(first, TimelineReplaced)
        world = self.session.driver.world
        state = None if world is None else lambda timeline, t: world.course(timeline).state_at(t)
        self.broadcast = Broadcast(self._self, first, wall, state, self._course_teller())
        self.served_body = ServedBody(self.session.body, self.broadcast, wall)
        engine.measured.listeners.append(self._tell_measured)
        self._measured = wall() - 2 * SIZE_CHECK_S
        self._limit_reached: LimitReached | None = None  # the limit that the robot has reached, if any

    def _course_teller(self) -> CourseTeller | None:
        """Return the thread that computes the course of the world (the states of parts and sensors over time); None
        without a cell."""
        session, world = self.session, self.session.driver.world
        if world is None:
            return None
        return CourseThread(
            world,
            now=lambda: self._self.now,
            works=lambda: session.actor.has_requests or (session.running and not session.engine.realtime),
            woken=lambda: self.put(self.broadcast.begin_round),
            failed=lambda error: self.put(lambda: self._tell(internal_error(error).text)),
        )

    def _session(self) -> Session:
        plan = self.plan
        plan.folder.mkdir(parents=True, exist_ok=True)
        clock = None if plan.realtime is None else WallClock(time.monotonic, time.sleep, plan.realtime)
        limits = plan.allowance.of_run(realtime=clock is not None)
        session = _LeasedSession(
            self.console, plan.model, clock=clock, limits=limits, folder=self.folder, advice=advice
        )
        session.driving, session.lease = self.driving, self.binding_lease(self.driving.lease)
        session.check_room = self._check

        def submit(dialogue: Dialogue[None], urgent: bool) -> None:
            answered = session.divergence.report_failure(self.check_and_note(dialogue, lambda: urgent))
            session.actor.submit(answered, urgent=urgent)

        session.divergence.ask = submit
        return session

    def _open_durable_log(self) -> DurableLog:
        """Open the journal and the memory file, and continue from their contents."""
        engine, path = self.session.engine, self.plan.journal
        if path is not None:
            taken = take_up(path, changes=self.plan.reach.changes)
            if taken.has_torn_line:
                self._tell(f"{path}: its last line was not written to its end, and is left out")
            self._journal = keep_journal(taken, engine, self._lost, together=True, reach=self.plan.reach)
            # Reports arrive in another thread, but only the robot's thread may write the journal: collect them for it.
            engine.measured.listeners.remove(self._journal.add_reports)
            engine.measured.listeners.append(self._unwritten.extend)
            try:
                if (measured_until := engine.measured.view.end) is not None:
                    engine.measured.forget_before(measured_until - MEASURED_SECONDS)
                    if engine.realtime:  # the clock continues after the last report
                        engine.clock.set(max(engine.clock.reached, measured_until))
                self._memory = MemoryFile(self.session, path.with_suffix(".v2"))
                for wrong in self._memory.bring_back():
                    self._tell(f"{self._memory.path}:{wrong.span.line}: {wrong.message}")
            except BaseException:
                self._journal.close()
                raise
        durable_log = DurableLog(lambda: len(engine.timeline), self.allowance.segments, self._journal, self._memory)
        engine.book.journal = durable_log
        return durable_log

    def close(self) -> None:
        """Refuse the pending requests, and write everything to the disk. Raises FileError."""
        self.session.actor.close()
        self._events.end()
        if self.broadcast.course is not None:
            self.broadcast.course.close()
        self.session.close()
        try:
            self._write_reports()
            self.durable_log.settle()
        finally:
            if self._memory is not None:
                self._memory.close()
            if self._journal is not None:
                self._journal.close()

    def _tell_measured(self, reports: Sequence[Report]) -> None:
        self.session.engine.measured.forget_before(reports[-1].t - MEASURED_SECONDS)
        if self.broadcast.measure(reports):
            self.wake()

    def _write_reports(self) -> None:
        """Write new reports into the journal. Call this method in the robot's thread, or after the thread has ended."""
        reports = self._unwritten[:]
        if self._journal is not None and reports:
            self._journal.add_reports(reports)
        del self._unwritten[: len(reports)]  # keeps reports that another thread has added meanwhile

    def binding_lease(self, lease: RobotLease) -> RobotLease | None:
        """Return the lease that restricts commands; None for a robot of one user while nobody has requested the
        lease."""
        return None if self.plan.one_user and not lease.holder else lease

    # --- requests of users ---

    def others_ask(self, user: UserSession) -> bool:
        """Return whether another user has sent a request recently."""
        earliest = self.wall() - LATELY
        return any(at > earliest for other, at in self.asked_at.items() if other is not user)

    def check_and_note(self, dialogue: Dialogue[Any], always: Callable[[], bool]) -> Dialogue[Any]:
        """Run a dialogue in the robot's thread, and record its changes for the disk. If the disk fails or a limit is
        reached, raise FileError or LimitReached instead, unless `always` returns True."""
        try:
            self._check()
        except VrsError:
            if not always():
                raise
        try:
            found = yield from dialogue
        finally:
            self.durable_log.note()
        yield from self.durable_log.prepare()
        return found

    def _check(self) -> None:
        self.durable_log.check()
        if (now := self.wall()) - self._measured > SIZE_CHECK_S:
            self._measured, self._limit_reached = now, None
            try:
                check_growth(self.allowance, len(self.session.environment.kinds) + len(self.session.programs))
                self.files.check_room()
            except LimitReached as error:
                self._limit_reached = error
        if self._limit_reached is not None:
            raise self._limit_reached

    def may_always(self, line: str) -> bool:
        """Return whether a line is allowed even if the robot has reached a limit, because the line only reads, stops
        the robot, or frees space."""
        try:
            statement = parse_prompt(line, self.session.names())
        except VrsError:
            return False
        if isinstance(statement, Instruction) and (statement.word in FREEING or statement.word.startswith("DELETE")):
            return True
        return not isinstance(statement, ProgramHeader | None) and may_all(*need_of(statement))

    @property
    def works(self) -> bool:
        """Return whether a program runs or the robot moves."""
        return self.session.running or self._self.now < self.session.engine.end

    # --- the thread of the connections ---

    def put(self, tell: Callable[[], None]) -> None:
        """Schedule a call of `tell` in the thread of the connections. Any thread may call this method."""
        self.said.append(tell)
        self.wake()

    def wake(self) -> None:
        """Wake the thread of the connections; further calls do nothing until that thread has run."""
        if not self._woken:
            self._woken = True
            self._wake()
