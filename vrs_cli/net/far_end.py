"""The client's side of a served robot, without sockets: a mirror (a local copy) of the robot, its clock, and the open
requests. Each command is sent at most once, and never without the user's request. If the connection is cut while a
command is on its way, the user learns later whether the robot executed or never received it. Only the user may send it
again. The clock is passed in as an argument."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from contextlib import suppress
from enum import Enum
from math import inf
from typing import TYPE_CHECKING, Any

from msgspec import structs

from vrs_cli.engine.feed import Snapshot
from vrs_cli.errors import FileDamaged, RequestRefused, VrsError
from vrs_cli.interfaces.port.port import Expected, Previewed
from vrs_cli.interfaces.streams import DRAGGING
from vrs_cli.interfaces.users import HolderTimes, move_of
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.forms import arm_for
from vrs_cli.kinematics.model_data import from_dict
from vrs_cli.net import messages
from vrs_cli.net.mirror import WINDOW, ClockReading, LastStatus, Mirror, first_difference
from vrs_cli.net.preview import DragTargets, Flags, Preview, changing_line
from vrs_cli.net.protocol import ClientConnection, ConnectionState
from vrs_cli.net.timesync import Estimate, TimeSync
from vrs_cli.trajectory.reports import ReportColumns
from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.values.acts import Define, Go
from vrs_cli.values.dragging import DragState as PulledState
from vrs_cli.wire.cells import cell_of
from vrs_cli.wire.codec import Frame
from vrs_cli.wire.messages import Refusal, snapshot_of
from vrs_cli.wire.records import Form, Motions, RecordError, delta_of
from vrs_cli.wire.reports import ReportRows, reports_of

if TYPE_CHECKING:
    from vrs_cli.world.course import World

CATCHING_UP = 2.0  # [s] maximum time that the answer to a command is held back until the command's change arrives
COMMAND_TIMEOUT_S = 60.0  # [s] time after a lost connection for which a server remembers the outcome of a command
REMEMBERED = 600.0  # [s] time for which records of wrongly shown motion are kept
HELD_UP = 3.0  # [s] a command that arrives later than a round trip plus this time is refused
QUIET = 4.0  # [s] silence after which the connection may be cut, because the robot answers a ping every two seconds
NEAR = 0.05  # [s] if the round trip D_f + D_b is below this, the user sees the effect of a command almost immediately
FIRST_PINGS, QUICKLY, USUALLY = 8, 0.05, 2.0  # number of frequent pings at the start; interval of these, and later [s]

SAME_VRS = "install the same vrs on both"
Outlet = Callable[[messages.ServerMessage], None]


class Ahead(Enum):
    """How far ahead of the last known state a viewer sees the robot. This depends on the measured delays of messages to
    the robot (D_f) and back (D_b). If the view is ahead by D_b, it shows the robot's present state; if it is ahead by
    D_f + D_b, the state in which a command issued now will find the robot."""

    PRESENT = "present"
    AUTO = "auto"


class FarEnd:
    """The client's side of a robot: its connection, mirror and preview. Pure; `wall` returns the local clock [s].

    `mirror` and `preview` (with the commands on their way) are None until the client follows the timeline and the first
    snapshot has arrived. `ahead`: how far ahead of the last known state viewers see the robot [s]. `flags`: times for
    which a wrong motion was shown. `refusal`: the reason why the robot cannot be used. `news`: receivers of messages
    that answer no request. `window`: length of the past that is kept [s]. `world`: computes the state of the cell
    around the robot; None without a cell.
    """

    def __init__(
        self, hello: messages.Hello, wall: Callable[[], float], connection: ClientConnection | None = None
    ) -> None:
        self.connection = connection or ClientConnection(hello)
        self.welcome: messages.Welcome | None = None
        self.mirror: Mirror | None = None
        self.preview: Preview | None = None
        self.ahead: float | Ahead = Ahead.PRESENT
        self.flags = Flags()
        self.refusal: VrsError | None = None
        self.news: list[Outlet] = []
        self.window = WINDOW
        self.sync, self.status = TimeSync(), LastStatus(wall)
        self.unmeasured = inf  # [s] start of the time for which reports of the body are missing
        self._next_report = 0  # the number of the next report
        self.cuts = self.stalls = 0  # number of cuts, and of silences longer than QUIET
        self._estimate: Estimate | None = None  # the estimate of the server's clock
        self._round_trip = 0.0
        self._wall, self._times = wall, HolderTimes(hello.offset)
        self._arm: RobotArm | None = None
        self.world: World | None = None
        self._cell: dict[str, Any] | None = None  # the cell's data as the server sent them
        self._drag_targets, self._pulled = DragTargets(), PulledState()  # targets and state of a dragged tool
        self._outlets: dict[int, Outlet] = {}
        # answers to commands whose change has not arrived yet, and the time until which they are held back [s]
        self._ended: dict[int, tuple[messages.Done, float]] = {}
        self._clock = messages.Clock(0.0)
        self._resyncs = False  # whether the mirror is lost and a snapshot was requested
        self._cut_at = self._silent_since = inf
        self._heard_at = wall()
        self._pings, self._next_ping = 0, 0.0

    # --- sockets ---

    def receive(self, frame: Frame) -> None:
        """Process a frame from the socket."""
        now = self._wall()
        self.stalls += self.open and now - self._heard_at > QUIET
        self._heard_at = now
        for message in self.connection.receive(frame):
            self._take(message)

    def cut(self) -> None:
        """Record that the socket is closed."""
        self.cuts += self.connection.state in (ConnectionState.OPEN, ConnectionState.CLOSING)
        self.connection.cut()
        now = self._wall()
        self._cut_at, self._silent_since = min(self._cut_at, now), min(self._silent_since, now)

    @property
    def open(self) -> bool:
        return self.connection.state is ConnectionState.OPEN

    @property
    def due(self) -> float:
        """Return the time of the next call of `look`, by the local clock [s]."""
        next_ping = self._next_ping if self.open else inf
        return min([next_ping, self._cut_at + COMMAND_TIMEOUT_S, *(until for _, until in self._ended.values())])

    def look(self) -> None:
        """End requests that waited too long, and send a ping to measure the delays when one is due."""
        now = self._wall()
        self._release(lambda _done, until: now >= until)
        if now >= self._cut_at + COMMAND_TIMEOUT_S:
            self.give_up()
        if self.open and now >= self._next_ping:
            self._ping(now)

    def _ping(self, now: float) -> None:
        self._pings += 1
        self._next_ping = now + (QUICKLY if self._pings < FIRST_PINGS else USUALLY)
        self.connection.send(messages.Ping(now))

    def give_up(self, why: VrsError | None = None) -> None:
        """End all requests with an error, because the connection will not be restored; `why`: the error."""
        self._cut_at = inf
        self._release(lambda _done, _until: True)
        lost = RequestRefused("the connection is lost: nobody knows whether it was done", "connect again, and look")
        for id in tuple(self._outlets):
            self._end(id, messages.Done(id, ok=False, refusal=Refusal.of(why or lost)))

    # --- requests ---

    def ask(self, make: Callable[[int], messages.Request], outlet: Outlet) -> int:
        """Send the request that `make` returns for an id; return the id. The outlet receives all answers to the
        request; the last one ends the request. Raises RequestRefused if there is no connection."""
        request = self.with_issue_time(make(self.connection.next_id()))
        self.send(request)
        self._outlets[request.id] = outlet
        self.expect(request)
        return request.id

    def with_issue_time(self, request: messages.Request) -> messages.Request:
        """Return the request; a motion without an issue time gets the current time."""
        if (
            isinstance(request, messages.At)
            and isinstance(request.act, Go)
            and request.issued is None
            and self._is_live
        ):
            return structs.replace(request, issued=self.now)
        return request

    def expect(self, request: messages.Request) -> None:
        """Add a sent request to the preview."""
        if not self._is_live or self.preview is None:
            return
        self.preview.forward = self.round_trip / 2.0  # [s] the estimated delay D_f of a command to the robot
        match request:
            case messages.At(act=Go() as go, issued=issued):
                with suppress(VrsError):  # if the location is impossible, the robot will report the error
                    move = move_of(go, self._times)
                    self.preview.send(request.id, move, self.now if issued is None else issued, go.text)
            case _ if (text := changing_line(request)) is not None:
                self.preview.send(request.id, None, self.now, text)

    def send(self, message: messages.ClientMessage) -> None:
        """Send a message. Raises RequestRefused if there is no connection; the message is then not sent later
        either."""
        match message:
            case messages.Put() | messages.At(act=Define()):
                pass  # a long file may take any time to arrive
            case messages.Command() | messages.Answer() if self._estimate is not None:
                until = self._estimate.there(self._wall()) + self._round_trip + HELD_UP
                message = structs.replace(message, until=until)
        if not self.open:
            raise self.no_connection
        if isinstance(message, messages.Drag) and self._is_live:
            message = structs.replace(message, issued=self.now)
            self.expect_drag(message)
        self.connection.send(message)

    def expect_drag(self, drag: messages.Drag) -> None:
        """Record the target of a dragged tool, if its message has an issue time."""
        if self._is_live and drag.issued is not None:
            self._drag_targets.add(drag.pose, drag.issued)

    @property
    def no_connection(self) -> RequestRefused:
        """Return the error for a message that cannot be sent; its message says for how long the connection has been
        cut."""
        since = f" (cut {self._wall() - self._silent_since:.1f} s ago)" if self._silent_since < inf else ""
        return RequestRefused(f"there is no connection{since}: this was not sent", "give it again when it is back")

    def extend(self, part: messages.Shown) -> bool:
        """Add an older part of the timeline. Return False if it does not fit because of a newer change; the caller then
        asks again."""
        if self.mirror is None or part.number < self.mirror.seq:
            return False
        try:
            return self.mirror.extend(snapshot_of(part.snapshot, Form.of(self.mirror.arm)))
        except RecordError:
            return False

    # --- messages of the robot ---

    def _take(self, message: messages.ServerMessage) -> None:
        match message:
            case messages.Done(
                id
            ):  # the change arrives after the answer, so a command ends only when its change is in the mirror
                if message.status is not None:
                    self.status.see(message.status)
                    self._set_virtual_time(message.status.clock)
                if not message.seq or self._is_seen(message, None):  # `seq` 0: this side made the message
                    self._end(id, message)
                else:
                    self._ended[id] = message, self._wall() + CATCHING_UP
            case messages.Refused(id=int(id)) | messages.Result(id=id):
                self._end(id, message)
            case messages.Told(id=int(id)) | messages.Asked(id=int(id)):
                if self.preview is not None:
                    self.preview.begin(id)
                self._outlets.get(id, self._spread)(message)
            case _:
                self.learn(message)
                self._spread(message)

    def _spread(self, message: messages.ServerMessage) -> None:
        for outlet in self.news:
            outlet(message)

    def learn(self, message: messages.ServerMessage) -> None:
        """Update the mirror, the clocks and the status from a message."""
        match message:
            case messages.Welcome():
                self._take_welcome(message)
            case messages.Change():
                self._take_change(message)
            case messages.Clock(wall=wall) if wall >= self._clock.wall:  # ignore an outdated broadcast
                self._set_clock(message)
            case messages.Pong():
                self.sync.hear(message.sent, message.came, message.left, self._wall())
                self._estimate = self.sync.estimate
                self._set_clock(self._clock)
                self._round_trip = self.sync.round_trip(0.5)
            case messages.Measurements():
                if (mirror := self.mirror) is not None:
                    if message.first > self._next_report:  # earlier reports are missing
                        end = mirror.record.view.end
                        self.unmeasured = min(self.unmeasured, -1.0 if end is None else end)
                    self._next_report = message.first + len(message.times)
                    self._add_reports([message])
            case messages.Pulled(state):
                self._pulled = state
                if state.issued is not None:
                    self._drag_targets.drop_until(state.issued)
            case messages.Status(around):
                self.status.see(around)
            case messages.Closing(refusal=Refusal() as refusal):
                self.refusal = refusal.error()

    def _take_welcome(self, welcome: messages.Welcome) -> None:
        now = self._wall()
        if not welcome.resumed:
            self.status.forget_pace()
        if self.welcome is not None and self.welcome.life != welcome.life:  # the server may run on another machine now
            self.sync, self._estimate = TimeSync(), None
            if self.mirror is not None:
                self.mirror.clock = ClockReading()
        self.welcome, self._pings, self._resyncs = welcome, 0, False
        self._drag_targets, self._pulled = DragTargets(), PulledState()
        self._cut_at = self._silent_since = inf
        if self.open:
            self._ping(now)  # sent before any request, so that the delays are known with the first answer
        self._resync_if_lost(full=False)
        if self._arm is None:
            try:
                self._arm = arm_for(from_dict(welcome.model))
            except FileDamaged as damaged:
                self.refusal = damaged
        if self._arm is not None and welcome.cell != self._cell:
            from vrs_cli.world.course import World

            self._cell = welcome.cell
            try:
                self.world = None if welcome.cell is None else World(self._arm, cell_of(welcome.cell))
            except (RecordError, ValueError, LookupError, ArithmeticError) as wrong:
                why = f"the robot tells a cell that cannot be: {wrong}"
                self.world, self.refusal = None, FileDamaged(why, SAME_VRS)
            if self.mirror is not None:
                self.mirror.world = self.world
        self._set_clock(welcome.clock)

    # --- the timeline and the clock ---

    def _take_change(self, change: messages.Change) -> None:
        assert self._arm is not None, "welcome comes first"
        form = Form.of(self._arm)
        try:
            match change:
                case messages.Replaced(snapshot=record):
                    self._replace(snapshot_of(record, form), change.number, self._arm)
                case messages.Delta(delta=delta, applied=applied) if self.mirror is not None:
                    self._set_virtual_time(applied)
                    self.mirror.change(delta_of(delta, Motions(), form), change.number)
                    self._flag(delta.cut)
                case messages.Steered(target=target) if self.mirror is not None:
                    self.mirror.steer(target, change.number)
                    self._flag(target.executed)
        except RecordError as wrong:
            self.refusal = FileDamaged(f"the robot tells what cannot be: {wrong}", SAME_VRS)
            return
        self._resync_if_lost(full=isinstance(change, messages.Steered))
        self._release(lambda done, _until: self._is_seen(done, change))

    def _replace(self, snapshot: Snapshot, number: int, arm: RobotArm) -> None:
        """Take the first timeline, or a timeline that replaces the current one."""
        if self.mirror is None:
            self.mirror = Mirror(arm, snapshot, number, self._wall, self.window, self.world)
            self.preview = Preview(self.mirror, 0.0)
            self._set_clock(self._clock)
            return
        before = self.mirror.timeline
        self.mirror.replace(snapshot, number)
        if self._is_live:
            self._flag(first_difference(before, self.mirror.timeline))

    def _flag(self, cut: float) -> None:
        """Flag the times that were shown wrongly before a change arrived; `cut`: the time from which the change
        replaces the timeline [s]. In real time a change never replaces the past."""
        if self._is_live and not self.near:
            self.flags.forget(self.now - REMEMBERED)
            self.flags.ahead = self.shown_time - self.now
            self.flags.add_change(cut, cut, self.now)

    def recall_reports(self, part: messages.ShownMeasured) -> None:
        """Take the answer to a request for reports of the body."""
        self._next_report = max(self._next_report, part.told)
        self._add_reports(part.parts)

    def _add_reports(self, parts: Iterable[ReportRows]) -> None:
        assert self.mirror is not None, "it is followed"
        record = self.mirror.record
        try:
            for rows in parts:
                reports = reports_of(rows, record.joint_count)
                columns = ReportColumns(record.joint_count, len(reports))
                for report in reports:
                    columns.put(report)
                record.add_columns(columns)
        except RecordError as wrong:
            self.refusal = FileDamaged(f"the robot tells reports that cannot be: {wrong}", SAME_VRS)
        record.forget_before(self.now - self.mirror.window)

    def _resync_if_lost(self, *, full: bool) -> None:
        """If the mirror is lost (a change is missing), ask for a snapshot, but only once."""
        lost = self.mirror is not None and self.mirror.lost
        if lost and not self._resyncs and self.open:
            self.connection.send(messages.Resync(full=full))
        self._resyncs = lost

    def _set_clock(self, clock: messages.Clock) -> None:
        """Set the local estimate of the robot's clock from a received reading, plus the time since it was sent."""
        self._clock = clock
        if self.mirror is None:
            return
        wall = self._wall()
        since = wall if self._estimate is None else self._estimate.here(clock.wall)
        self.mirror.clock = self.mirror.clock.then(ClockReading(clock.now, self.rate, since), wall)

    def _set_virtual_time(self, now: float) -> None:
        """Set the clock to `now` [s] if time is virtual: only commands advance virtual time."""
        if not self._clock.realtime:
            self._set_clock(structs.replace(self._clock, now=now))

    # --- delays ---

    @property
    def _is_live(self) -> bool:
        """Return whether the timeline is followed and the robot runs in real time."""
        return self._clock.realtime and self.mirror is not None

    @property
    def rate(self) -> float | None:
        """Return the seconds of the robot's clock per real second; None if the clock is paused or virtual."""
        return self._clock.rate if self._clock.realtime and not self._clock.paused else None

    @property
    def now(self) -> float:
        """Return the estimated robot's clock [s]. The error of this estimate is half the difference of the delays D_f
        and D_b."""
        return 0.0 if self.mirror is None else self.mirror.now

    @property
    def round_trip(self) -> float:
        """Return the median of the measured round trips D_f + D_b, in seconds of the robot's clock."""
        return (self.rate or 0.0) * self._round_trip

    @property
    def near(self) -> bool:
        """Return whether the delays are too short to matter; always True for a robot with one user."""
        own = self.welcome is not None and self.welcome.one_user
        return own or max(self.round_trip, self.shown_time - self.heard_time) < NEAR

    @property
    def heard_time(self) -> float:
        """Return the time up to which the timeline is certain [s]: the robot's clock when it sent the messages that
        arrive now, that is, D_b ago. While the connection is cut, this time stands still."""
        if self.mirror is None:
            return 0.0
        return self.mirror.clock.at(min(self._wall(), self._silent_since)) - self.round_trip / 2.0

    @property
    def shown_time(self) -> float:
        """Return the time of the robot's clock that viewers see [s]. AUTO is correct even if D_f and D_b differ: `now`
        is (D_f + D_b) / 2 later than the time up to which the timeline is certain, and the returned time is later than
        `now` by the same amount."""
        match self.ahead:
            case Ahead.PRESENT:
                return self.now
            case Ahead.AUTO:
                return self.now + self.round_trip / 2.0
            case float(ahead):
                return self.now - self.round_trip / 2.0 + (ahead if self._is_live else 0.0)

    @property
    def _drag_effect(self) -> Expected | None:
        """Return the expected effect of a dragged tool. While the arm moves, it follows the newest target in each tick,
        so all later motion is uncertain. At rest, a target changes the timeline when it arrives."""
        if self.mirror is None or not self._is_live or self.near:
            return None
        oldest, heard = self._drag_targets.oldest(self.now, self.round_trip), self.heard_time
        if self._pulled.by and self.mirror.timeline.end > heard:
            return Expected(0, DRAGGING.text, heard, heard, planned=False)
        if oldest is None:
            return None
        return Expected(0, DRAGGING.text, oldest, max(oldest + self.round_trip / 2.0, heard), planned=False)

    def preview_now(self) -> Previewed:
        """Return the robot's future motion, as far as it is known now. Any thread may call this method."""
        assert self.preview is not None, "there is a mirror"
        plan = self.preview.plan
        expected = plan.expected if (dragged := self._drag_effect) is None else (*plan.expected, dragged)
        begins = [it.begin for it in expected if it.begin is not None]
        return Previewed(
            plan.timeline,
            self.now,
            self.heard_time,
            self.now + self.round_trip / 2.0,
            self.shown_time,
            self.ahead is not Ahead.PRESENT and self._is_live,
            min(begins if self.open else [*begins, self.heard_time], default=inf),
            expected,
            not self.open,
            self.round_trip,
            self.flags.windows,
        )

    # --- ends of requests ---

    def _is_seen(self, done: messages.Done, change: messages.Change | None) -> bool:
        """Return whether the mirror contains the change made by a command; `change`: the newest change that arrived
        after `done`, if any."""
        if self.mirror is None or isinstance(change, messages.Replaced):
            return True
        timeline = self.mirror.timeline
        if change is not None:
            return timeline.version >= done.version
        return timeline.version == done.version and (done.status is None or done.status.end == timeline.end)

    def _release(self, is_due: Callable[[messages.Done, float], bool]) -> None:
        """End the commands for which `is_due` returns True."""
        for id, (done, until) in tuple(self._ended.items()):
            if is_due(done, until):
                del self._ended[id]
                self._end(id, done)

    def _end(self, id: int, message: messages.ServerMessage) -> None:
        if self.preview is not None and isinstance(message, messages.Done) and message.ok:
            self.preview.finish(id, message.version)
        elif self.preview is not None:
            self.preview.refuse(id)
        self._outlets.pop(id, self._spread)(message)


class Predicted:
    """The predicted robot for viewers: its timeline includes the commands on their way, and `now` is `shown_time`."""

    def __init__(self, far: FarEnd) -> None:
        self._far = far

    @property
    def arm(self) -> RobotArm:
        assert self._far.mirror is not None, "it is followed"
        return self._far.mirror.arm

    @property
    def timeline(self) -> Timeline:
        assert self._far.preview is not None, "it comes with the mirror"
        return self._far.preview.timeline

    @property
    def now(self) -> float:
        return self._far.shown_time
