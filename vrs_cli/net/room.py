"""A served robot with its users and viewers, and the hub of all robots of a server.

Requests go into the robot's inbox. Messages of the robot return in one queue, in the order of sending, which wakes the
thread of the connections once for all its entries. That thread sends the answers to users first, then the messages for
all clients.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Mapping
from contextlib import ExitStack
from functools import cached_property, partial
from math import inf
from pathlib import Path
from secrets import token_hex, token_urlsafe
from threading import Lock
from types import MappingProxyType
from typing import Any

from msgspec import Struct
from msgspec.structs import replace

from vrs_cli.engine.clock import WallClock
from vrs_cli.engine.feed import MissedEvents
from vrs_cli.errors import RequestRefused
from vrs_cli.interfaces.dialogue import Ticket, internal_error, quietly
from vrs_cli.interfaces.session.session import Session
from vrs_cli.interfaces.station.body import BodyNews
from vrs_cli.interfaces.tasks.driver import AskedInVain
from vrs_cli.interfaces.tasks.tasks import ROBOT_PROGRAM
from vrs_cli.interfaces.users import Notice, RobotLease
from vrs_cli.kinematics.model import RobotModel
from vrs_cli.kinematics.model_data import to_dict
from vrs_cli.language.run.signals import Cell
from vrs_cli.net import messages
from vrs_cli.net.client_session import ClientSession, ClientSocket
from vrs_cli.net.delivery_log import FRAME_OVERHEAD_BYTES, DeliveryLog
from vrs_cli.net.durable_log import Audit
from vrs_cli.net.limits import HIGH_WATER_BYTES, Meter
from vrs_cli.net.page_data import ServedShapes
from vrs_cli.net.served_robot import Plan, ServedRobot, WhenGone
from vrs_cli.net.tokens import BODY, TEACHER, Grant
from vrs_cli.trajectory.timeline import TimelineDelta
from vrs_cli.values import replies, results
from vrs_cli.values.commands import MotionKind
from vrs_cli.values.measured import DivergenceAlarm, alarm_text
from vrs_cli.version import __version__

PUMP_CPU_S = 0.005  # [s] maximum CPU time spent on the robot's messages before the sockets are flushed
MAX_CUT_CLIENTS = 200  # maximum number of users with a cut connection, which they may resume
PULLED_PERIOD_S = 0.1  # [s] time between messages with the distance of a dragged tool from its target
NO_CELLS: Mapping[str, Cell] = MappingProxyType({})
DRIVER_SILENCE_S = 3.0  # [s] silence after which a driver is pinged


class Room(ServedRobot):
    """A served robot with its users. `wake`: called, in any thread, to request a call of `pump` in the thread of the
    connections. `life`: the id of this run of the robot. `first_line`: a line that the next page to connect executes as
    if its user had typed it.
    """

    def __init__(
        self,
        name: str,
        plan: Plan,
        wake: Callable[[], None],
        audit: Audit,
        tell: Callable[[str], None],
        robots: Callable[[Grant], tuple[str, ...]],
        wall: Callable[[], float] = time.monotonic,
    ) -> None:
        self.life = token_hex(8)
        self.clients: dict[str, ClientSession] = {}
        self._delivery_logs: dict[str, ClientSession] = {}
        self._user_states: dict[object, ClientSession] = {}
        self._typed_to: ClientSession | None = None  # the last user who got output of TYPE
        self._typed_bytes = self._given_bytes = 0  # output of TYPE: bytes from the robot, and bytes given to clients
        self._at_prompt: dict[ClientSession, None] = {}
        self._away: dict[ClientSession, None] = {}  # clients that have lost their connection, the earliest loss first
        super().__init__(name, plan, wake, audit, tell, robots, wall, self._tell_lease, self._journal_lost)
        self.console.outlets.append(self._take_message)
        self._meter = Meter(plan.allowance, wall())
        self._ran = False
        self._watched_at = wall()  # when the robot last had a user or a viewer
        self.first_line = ""
        self._paused_at: float | None = None  # time since which the robot is paused for lack of users and viewers
        self._watch: Ticket[None] | None = None
        self._looked: object = None  # the robot's state at the last update of the prompts
        self._clock: messages.Clock | None = None
        self._activity: messages.Activity | None = None
        self._sent_now = 0.0  # the robot's clock that was last sent to clients [s]
        self.session.body.listeners.append(self._tell_body_news)
        self.session.driver.lags, self.session.actor.spent = self._lags, self._charge
        self._pulled = messages.Pulled(self.session.pulled)
        self._pulled_at, self._stops = wall(), 0
        self.session.actor.serve()

    @cached_property
    def shapes(self) -> ServedShapes:
        """The shapes of the robot. Their files are read when the first client is welcomed."""
        return ServedShapes(self.name, self.plan.model, shows_paths=self.plan.one_user)

    # --- users ---

    def enter(self, grant: Grant, hello: messages.Hello, link: ClientSocket) -> ClientSession:
        """Add a user, or resume a user whose connection was cut; send the welcome. Return the client session."""
        client = None if hello.resume is None else self._delivery_logs.get(hello.resume.connection)
        came = client is None or client.grant != grant  # only a client with the same token may resume
        if client is None or came:
            client = self._new(grant, hello)
        self._away.pop(client, None)
        connection, now = link.connection, self.wall()
        if (before := client.link) is not None:
            before.connection.close("this holder has another connection now")
            client.detach()
            before.flush()
        title = BODY if grant.body else grant.role.title
        role = (TEACHER if grant.teacher else title) if grant.name else grant.role.title
        is_page = hello.attended and hello.rendered is not None
        first, self.first_line = (self.first_line, "") if is_page else ("", self.first_line)
        said = replace(self.greeting(), role=role, name=client.name, robots=self.robots(grant), first_line=first)
        connection.welcome(said, client.delivery_log, now)
        link.flush()  # must be sent before the first broadcast
        client.attach(link, hello)
        if came and (alarm := self.session.divergence.alarm) is not None:
            self._tell_alarm(alarm, (client,))
        self._pause_if_idle(now)
        return client

    def _new(self, grant: Grant, hello: messages.Hello) -> ClientSession:
        """Add a client with a unique name; return it."""
        wanted = grant.name or hello.name or "guest"
        name = wanted = "".join(character if character.isprintable() else "?" for character in wanted)[:40]
        number = 1
        while name in self.clients:
            number += 1
            name = f"{wanted}-{number}"
        client = ClientSession(self, self.clients, name, grant, DeliveryLog(token_urlsafe()), hello)
        self.clients[client.name] = self._delivery_logs[client.delivery_log.key] = client
        self._user_states[client.user_state] = client
        if hello.attended:
            self._at_prompt[client] = None
        return client

    def greeting(self) -> messages.Welcome:
        """Return the part of the welcome that is the same for all clients; viewers over NATS get only this."""
        description = to_dict(self.plan.model)
        if not self.plan.one_user:
            description.pop("collision", None)  # contains paths of this machine
        return messages.Welcome(
            messages.VERSION,
            "",
            self.name,
            self.life,
            "observer",
            "",
            self.clock(),
            {**description, "shapes": self.shapes.tables},
            server=__version__,
            one_user=self.plan.one_user,
            cell=self.cell,
        )

    def clock(self) -> messages.Clock:
        clock = self.session.engine.clock
        if isinstance(clock, WallClock):
            face = clock.read()
            return messages.Clock(face.now, face.rate, face.paused, True, face.wall)
        return messages.Clock(clock.reached, wall=self.wall())

    def cut(self, client: ClientSession, link: ClientSocket) -> None:
        """Record that a socket is closed."""
        link.connection.cut(self.wall())
        if client.link is link:
            client.detach()
            self._away[client] = None
            if len(self._away) > MAX_CUT_CLIENTS:
                self.leave(next(iter(self._away)))

    def leave(self, client: ClientSession) -> None:
        """Remove a user who will not reconnect."""
        self._away.pop(client, None)
        self._at_prompt.pop(client, None)
        if self.clients.pop(client.name, None) is None:
            return
        del self._delivery_logs[client.delivery_log.key], self._user_states[client.user_state]
        self.asked_at.pop(client, None)
        drove = self.driving.lease.drives(client.name)
        client.user_state.left = self.plan.when_gone is not WhenGone.ABORT
        client.leave()
        self.driving.change(lambda lease, now: lease.leave(client.name, now))
        self.session.body.leave(client.name)
        if drove:
            self._driver_gone(client.name)

    # --- messages of the robot: in its own thread ---

    def _take_message(self, message: messages.ServerMessage) -> None:
        """Queue a message that answers no request, for the user who started the running program."""
        tasks = self.session.tasks
        track = tasks.get(tasks.current) or tasks.get(ROBOT_PROGRAM)
        by = track.driven_by if track is not None else self.session.user_state
        if isinstance(message, messages.Typed):
            self._typed_to = self._user_states.get(by)
            self._typed_bytes += len(message.text) + FRAME_OVERHEAD_BYTES
        self._say(message, by)

    def _journal_lost(self, text: str) -> None:
        """Inform all users that the journal was lost."""
        self._tell(text)
        self._say(messages.Told(results.Message(text, results.Tone.ERROR)), None)

    def _say(self, message: messages.ServerMessage, by: object) -> None:
        ticket = self.session.actor.at_work
        self.session.actor.tell(lambda: self.put(lambda: self._spread(message, by, ticket)))

    def _lags(self) -> bool:
        """Return whether the robot has to wait until the output of TYPE is sent; in virtual time, also until its user
        has received it.
        """
        return self._typed_bytes - self._given_bytes > HIGH_WATER_BYTES or (
            self._typed_to is not None and not self.session.engine.realtime and self._typed_to.pace.lags(self.wall())
        )

    def _charge(self, user_state: object, ticket: Ticket[Any], seconds: float) -> None:
        """Charge a user the CPU time of a request [s]. Any thread may call this method."""
        if (client := self._user_states.get(user_state)) is not None:
            client.spend(seconds, typing=client.types(ticket))

    def _tell_body_news(self, what: BodyNews) -> None:
        """Send orders to the body, and alarms to all clients; write alarms and resynchronisations into the audit."""

        def tell() -> None:
            note = partial(self.audit.note, self.name, self.session.body.name, "")
            match what:
                case DivergenceAlarm():
                    self._tell_alarm(what, self.clients.values())
                    note("alarm", alarm_text(what))
                case results.ResyncReport():
                    note("RESYNC", f"from {what.t:.3f} s, the body follows from {what.until:.3f} s on")
                case results.Message():
                    note("alarm", what.text)
                    self._spread(messages.Told(what), None)
                case _:
                    self.served_body.tick(changed=True)
                    before, body = self.clients.get(what.before), self.clients.get(what.name)
                    if before is not None and before is not body:
                        before.tell(messages.BodyReleased())
                    if body is not None:
                        body.tell(messages.BodyOrder(what.order, what.at))

        self.put(tell)

    def _tell_alarm(self, alarm: DivergenceAlarm, clients: Iterable[ClientSession]) -> None:
        """Inform clients that the body differs from the timeline."""
        for client in tuple(clients):
            client.tell(messages.Alarm(alarm))
            client.tell(messages.Told(results.Message(alarm_text(alarm), results.Tone.WARNING)))

    def _tell_lease(self, lease: RobotLease, notice: Notice | None) -> None:
        """Inform all users that the lease has changed."""
        self.session.lease = self.binding_lease(lease)

        def tell() -> None:
            for client in tuple(self.clients.values()):
                client.tell(messages.Lease(self.driving.lease.holder, notice))

        self.put(tell)

    # --- messages of the robot: in the thread of the connections ---

    def pump(self) -> None:
        """Send the waiting messages of the robot to their users, and announce changes."""
        self._woken = False
        until = time.thread_time() + PUMP_CPU_S
        while self.said and time.thread_time() < until:
            try:
                self.said.popleft()()
            except Exception as error:  # after an error the other messages are still sent
                self._tell(internal_error(error).text)
        touched, self.touched = self.touched, {}
        for flush in touched:
            flush()
        if self.said:
            self.wake()
        for event in self._events.take_all():
            if not isinstance(event, MissedEvents):
                applied = self._self.now
                self.broadcast.tell(event, applied)
                if isinstance(event, TimelineDelta) and event.motion.kind is not MotionKind.STEERED:
                    self._sent_now = applied  # the short form of a steered change does not contain the clock
        self._announce()

    def _spread(self, message: messages.ServerMessage, by: object, ticket: Ticket[Any] | None = None) -> None:
        """Send a message that answers no request to the user with the state `by`, or to all users if there is none.

        Output of TYPE also goes to all consoles. For the user who gave the command of the ticket, a reply gets the id
        of this command.
        """
        clients = tuple(self.clients.values())
        if isinstance(message, messages.Typed):
            self._given_bytes += len(message.text) + FRAME_OVERHEAD_BYTES
            for client in clients:
                if client.console or client.user_state is by:
                    client.tell(message)
        elif isinstance(message, messages.Told):
            for client in [client for client in clients if client.user_state is by] or clients:
                asked = None if ticket is None else client.pending.get(ticket)
                client.tell(replace(message, id=None if asked is None else asked.id or None))

    def _show_all(self, text: str) -> None:
        self.put(lambda: self._spread(messages.Told(results.Message(text, results.Tone.WARNING)), None))

    def _announce(self) -> None:
        """Announce the clock, the activity and the dragged tool if they have changed.

        Clients usually know virtual time from changes of the timeline. A new user who drags the tool is announced at
        once, the tool's distance from its target every PULLED_PERIOD_S.
        """
        now, before = self.clock(), self._clock
        same = before is not None and (now.rate, now.paused) == (before.rate, before.paused)
        if not same or (not now.realtime and now.now != self._sent_now):
            self._clock, self._sent_now = now, now.now
            self.broadcast.announce(now)
        running = (track for track in tuple(self.session.tasks) if track.running and track.in_program)
        activity = messages.Activity(self.driving.lease.holder, tuple(track.task.program for track in running))
        if activity != self._activity:
            self._activity = activity
            self.broadcast.announce(activity)
        pulled, sent, wall = self.session.pulled, self._pulled.state, self.wall()
        same = pulled.by == sent.by and pulled.held.holds == sent.held.holds
        stopped = self.session.stops != self._stops
        if stopped or (pulled != sent and (not same or wall - self._pulled_at > PULLED_PERIOD_S)):
            self._pulled, self._pulled_at, self._stops = messages.Pulled(pulled), wall, self.session.stops
            self.broadcast.announce(self._pulled)

    # --- periodic work ---

    def tick(self) -> None:
        """Do the periodic work: drop users who are gone, stop programs over their limits, write reports. Call this
        method several times a second. Raises an internal error of the robot's thread, if there was one."""
        now = self.wall()
        for client in tuple(self._away):
            if client.link is None and client.delivery_log.is_expired(now):
                self.leave(client)
        driver = self.clients.get(self.driving.lease.holder)
        if driver is not None and driver.link is not None and now - driver.heard_at > DRIVER_SILENCE_S:
            driver.link.ping()
        if gone := self.driving.take_lapsed():
            self._driver_gone(gone)
        self._pause_if_idle(now)
        session = self.session
        if session.running and not session.driver.awaited and (self._watch is None or self._watch.done()):
            self._watch = self._self.put(session.watch_over())  # keeps a program running after its user has left
        self._withdraw_questions()
        wrong = self._meter.look(session.actor.worked, now)
        if wrong is not None and not session.driver.end_by(wrong):
            self._call(Session.stop, urgent=True)  # stops programs that no request waits for
            self.put(partial(self._spread, messages.Told(replies.refusal(wrong, "")), None))
        self._push_status()
        if self.broadcast.course is not None:
            self.broadcast.course.tick()
        self.served_body.tick()
        if self._unwritten:
            self._call(lambda _session: self._write_reports())
        ran, self._ran = self._ran, session.running
        if ran and not self._ran:  # write down the changes of a program that has ended
            self._call(lambda _session: self.durable_log.note())
        self._announce()
        if self.session.actor.internal_errors:
            raise self.session.actor.internal_errors.pop(0)

    def _driver_gone(self, who: str) -> None:
        """Pause or stop a running program whose driver has left, unless `plan.when_gone` is GO_ON."""
        if not self.session.running or self.plan.when_gone is WhenGone.GO_ON:
            return
        aborts = self.plan.when_gone is WhenGone.ABORT
        self._call(Session.abort if aborts else Session.pause, urgent=aborts)
        self._show_all(f"{who} drove, and has gone: the program is {'stopped' if aborts else 'paused'}")

    def _call(self, act: Callable[[Session], None], *, urgent: bool = False) -> None:
        """Have the robot's thread call `act` between two requests."""
        self._self.put(quietly(lambda: act(self.session)), urgent=urgent)

    def _pause_if_idle(self, now: float) -> None:
        """Pause a working robot that has had no users or viewers for `plan.idle` seconds; resume it when one comes."""
        if self.broadcast.is_watched:
            self._watched_at = now
            if self._paused_at is not None:
                paused, self._paused_at = now - self._paused_at, None
                self.session.actor.rest(False)
                self.audit.note(self.name, "", "", "(go on)", f"after {paused:.0f} s")
                self._show_all(f"nobody was here: the robot stood still for {paused:.0f} s, and goes on now")
        elif self._paused_at is None and now - self._watched_at >= self.plan.idle and self.works:
            self._paused_at = now
            self.session.actor.rest(True)
            self.audit.note(self.name, "", "", "(pause)", "nobody holds or watches it")

    def _withdraw_questions(self) -> None:
        """Withdraw the questions of stopped programs."""
        if not (asked := tuple(one for client in self.clients.values() for one in client.asked_by_programs)):
            return

        def look(session: Session) -> None:
            if session.driver.has_withdrawn:
                for question, ticket in asked:
                    ticket.throw(AskedInVain(), question.id)

        self._call(look)

    def _push_status(self) -> None:
        """Update the status of users at a prompt: after each change, and each second."""
        engine, t = self.session.engine, self._self.now
        happened = engine.timeline.version, self.session.running, engine.settings, self.driving.lease.holder
        now = (*happened, min(t, engine.end), int(t))
        if now == self._looked:
            return
        self._looked = now
        for client in self._at_prompt:
            if client.link is not None:
                client.look()


# --- all robots of a server -------------------------------------------------------------------------------------------


class RobotFolders(Struct, frozen=True):
    """The folders of journals (None: no journals) and of files. Each robot has its own subfolder of `folder`; if
    `only`, the server has one robot, which uses `folder` itself.
    """

    journal: Path | None
    folder: Path
    only: bool = False

    def plan(self, name: str, model: RobotModel, usual: Plan) -> Plan:
        journal = None if self.journal is None else self.journal / f"{name}.vrst"
        return replace(usual, model=model, folder=self.folder if self.only else self.folder / name, journal=journal)


class Hub:
    """All robots of a server, and the users who may connect to each.

    `robots`: the shared robots, by name. `own`: the number of robots that each token has for itself; they are created
    at the first use, and paused after `own_idle` [s] without users and viewers. A teacher may use the robots of all
    `grants`. `cells`: the cells of some shared robots, by name; they replace the usual cell. Any thread may call
    `open`, which is slow; all other methods are for the thread of the connections.
    """

    def __init__(
        self,
        robots: Mapping[str, RobotModel],
        places: RobotFolders,
        usual: Plan,
        audit: Audit,
        wake: Callable[[str], None],
        tell: Callable[[str], None],
        own: int = 0,
        grants: Callable[[], Iterable[Grant]] = tuple,
        own_idle: float = inf,
        cells: Mapping[str, Cell] = NO_CELLS,
    ) -> None:
        self.rooms: dict[str, Room] = {}
        self.planned: Callable[[str, Plan], Plan] = lambda _name, plan: plan  # may change the plan of a robot
        self._robots, self._places, self._usual = robots, places, usual
        self._own, self._grants, self._own_idle, self._cells = own, grants, own_idle, cells
        self._audit, self._wake, self._tell = audit, wake, tell
        self._opening = Lock()

    def names(self, grant: Grant) -> tuple[str, ...]:
        """Return the robots that a token may use: its own and the shared ones. A token for a body (a client that acts
        as the arm of a robot) may also use the robots listed in the token, and a teacher's token all robots."""
        shared = (name for name in self._robots if grant.teacher or grant.robots is None or name in grant.robots)
        of_all = (name for one in self._grants() for name in self.own_names(one))
        others = (name for name in of_all if grant.teacher or (grant.body and name in (grant.robots or ())))
        return tuple(dict.fromkeys((*self.own_names(grant), *shared, *others)))

    def own_names(self, grant: Grant) -> tuple[str, ...]:
        """Return the robots that a token has for itself."""
        return grant.own_names(self._own) if grant.name else ()

    def choose(self, grant: Grant, wanted: str) -> str:
        """Return the wanted robot; without a name, the only robot or the first of the token's own. Raises
        RequestRefused, which lists only robots that the token may use.
        """
        names = self.names(grant)
        if wanted in names:
            return wanted
        if not wanted and (len(names) == 1 or self.own_names(grant)):
            return names[0]
        raise RequestRefused(
            f"there is no robot {wanted} for you" if wanted else "which robot",
            f"there is {', '.join(names) or 'none'}: ws://HOST:PORT/robots/NAME",
        )

    def open(self, name: str) -> Room:
        """Return the room of a robot; create it at the first call. Raises VrsError."""
        with self._opening:
            if (room := self.rooms.get(name)) is None:
                model = self._robots.get(name, self._usual.model)
                usual = self._usual if name in self._robots else replace(self._usual, idle=self._own_idle)
                usual = replace(usual, cell=self._cells.get(name, usual.cell))
                plan = self.planned(name, self._places.plan(name, model, usual))
                room = Room(name, plan, lambda: self._wake(name), self._audit, self._tell, self.names)
                self.rooms = {**self.rooms, name: room}
            return room

    def clients(self) -> tuple[ClientSession, ...]:
        """Return the clients of all open robots."""
        return tuple(client for room in self.rooms.values() for client in room.clients.values())

    def drop_forgotten(self) -> tuple[Room, ...]:
        """Remove the rooms of robots that no token may use any longer; return them, for the caller to close."""
        with self._opening:
            kept = {*self._robots, *(name for grant in self._grants() for name in self.own_names(grant))}
            gone = tuple(room for name, room in self.rooms.items() if name not in kept)
            self.rooms = {name: room for name, room in self.rooms.items() if name in kept}
        return gone

    def take_away(self, name: str) -> Room | None:
        """Remove the room of a robot; return it, for the caller to close. The next client opens a new room."""
        with self._opening:
            room = self.rooms.get(name)
            self.rooms = {key: one for key, one in self.rooms.items() if key != name}
        return room

    def open_all(self) -> None:
        """Open the shared robots. Raises VrsError."""
        for name in self._robots:
            self.open(name)

    def close(self) -> None:
        """Close all rooms, and write everything to the disk. Raises FileError."""
        with ExitStack() as stack:
            for room in self.rooms.values():
                stack.callback(room.close)
