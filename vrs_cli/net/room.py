"""One served robot: its session in a thread of its own, its users, and those who watch it.

Requests go into the robot's inbox. What the robot says comes back in one queue, in the order in which it was said; the
thread of the connections is woken once for all that is there, and gives it to those whom it concerns: answers first,
then what all hear.
"""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable
from math import inf
from pathlib import Path
from secrets import token_hex, token_urlsafe
from typing import Any

from msgspec import Struct
from msgspec.structs import replace

from vrs_cli.engine.book import WindowSize
from vrs_cli.engine.clock import WallClock
from vrs_cli.engine.feed import MissedEvents
from vrs_cli.engine.snapshot import TimelineReplaced
from vrs_cli.errors import LimitReached, VrsError
from vrs_cli.files.bounds import Folder
from vrs_cli.files.journal import Journal, keep_journal, take_up
from vrs_cli.interfaces.actor.ticket import Ticket
from vrs_cli.interfaces.conversation.internal_error import internal_error
from vrs_cli.interfaces.dialogue import Dialogue, Reading, Running, quietly
from vrs_cli.interfaces.port.user_session import Pending, UserSession
from vrs_cli.interfaces.rights import check_may, may_all, must_drive, needed
from vrs_cli.interfaces.session.drag_control import DragControl
from vrs_cli.interfaces.session.session import Session
from vrs_cli.interfaces.station.lease import Notice, RobotLease
from vrs_cli.interfaces.station.user_state import UserState
from vrs_cli.interfaces.tasks.driver import AskedInVain
from vrs_cli.interfaces.tasks.tasks import ROBOT_PROGRAM
from vrs_cli.kinematics.model import RobotModel
from vrs_cli.kinematics.model_data import to_dict
from vrs_cli.language.text.ast import Instruction, ProgramHeader
from vrs_cli.language.text.parser import parse_prompt
from vrs_cli.language.words.word import Role
from vrs_cli.net import messages
from vrs_cli.net.audit import Audit
from vrs_cli.net.broadcast import Broadcast
from vrs_cli.net.client_session import ClientSession, ClientSocket
from vrs_cli.net.delivery_log import BESIDE, DeliveryLog
from vrs_cli.net.driving import Driving, WhenGone
from vrs_cli.net.durable_log import DurableLog, MemoryFile
from vrs_cli.net.limits import MUCH, USUAL, Allowance, Meter, advice, check_growth
from vrs_cli.net.parts import is_long
from vrs_cli.net.places import prefixes_of
from vrs_cli.net.robot_folder import check_room
from vrs_cli.net.tokens import TEACHER, Grant
from vrs_cli.trajectory.timeline import TimelineDelta
from vrs_cli.values.commands import SetParameter
from vrs_cli.values.motion import MotionKind
from vrs_cli.values.questions import Answer, Question
from vrs_cli.values.replies import Message, Reply, Tone, refusal
from vrs_cli.version import __version__

TOGETHER = 0.005  # [s] of CPU time for which things that are said are given on at once
MEASURED = 0.1  # [s] between two looks at what a robot has, which take a while where that is much
LATELY = 1.0  # [s] in which somebody has asked for something
MOST_AWAY = 200  # holders whose connection is cut, and who may come again
PULLED_EVERY = 0.1  # [s] that is told how far a tool that is dragged is from its wish
ALIVE = 3.0  # [s] after which who drives and says nothing is asked whether it is there
FREEING = frozenset(("ABORT", "KILL", "ZERO", "UNDO", "FDELETE", "DELETEB", "EXIT"))  # good where there is no room


class Plan(Struct, frozen=True):
    """How a robot is served. `journal`, `folder`: where what it does, and its files, are; None: nowhere, and in a
    folder of its own that goes with the server. `one_user`: all who hold it are the same one, so that the lease is
    taken by who asks for it alone. `idle`: a robot that nobody has held or watched for so long [s] is paused.
    `reach`: how much of what is in the journal stays in memory, too.
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


class _Console:
    """The terminal of a served session: what it says goes to the users of the robot."""

    attended = False

    def __init__(self, show: Callable[[object, Reply], None], type: Callable[[object, str, bool], None]) -> None:
        self._show, self._type = show, type
        self.session: Session | None = None

    def show(self, reply: Reply) -> None:
        self._show(self._concerned(), reply)

    def type(self, text: str, newline: bool) -> None:
        self._type(self._concerned(), text, newline)

    def _concerned(self) -> object:
        """The user who began what speaks now."""
        assert self.session is not None
        tasks = self.session.tasks
        track = tasks.get(tasks.current) or tasks.get(ROBOT_PROGRAM)
        return track.driven_by if track is not None else self.session.user_state

    def progress(self, doing: Running | Reading) -> None:
        """Nobody watches."""

    def ask(self, _question: Question) -> Answer:
        """Nobody is there: who holds the robot is asked by the ticket."""
        return None


class _Served(Session):
    """A session that asks the lease who may command."""

    driving: Driving

    def check_may(self, said: str, wanted: Role) -> None:
        check_may(said, wanted, self.user_state.role)
        if must_drive(said, wanted, self.user_state.role):
            self.driving.may(self.user_state.name)


class Room:
    """`wake` is called, in any thread, when `pump` is due in the thread of the connections; `tell` takes what whoever
    runs the server has to know; `robots` says which ones somebody may hold. Raises FileError, FileDamaged, UsageError
    where the robot cannot be served.
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
        self.name, self.plan, self.allowance = name, plan, plan.allowance
        self._robots = robots
        self.life = token_hex(8)
        self.clients: dict[str, ClientSession] = {}
        self._wake, self._audit, self._tell, self._wall = wake, audit, tell, wall
        self._said: deque[Callable[[], list[ClientSession]]] = (
            deque()
        )  # tells those whom it concerns, and says who these are
        self._woken = False
        self._delivery_logs: dict[str, ClientSession] = {}
        self._user_states: dict[object, ClientSession] = {}
        self._hears: ClientSession | None = None  # what was TYPEd last
        self._typed_bytes = self._given_bytes = 0  # counted in the robot's thread, and in that of the connections
        self._seated: dict[ClientSession, None] = {}  # at a prompt
        self._asked_at: dict[ClientSession, float] = {}  # [s] when each asked for something last
        self._away: dict[ClientSession, None] = {}  # whose connection is cut, in the order in which it was
        self.driving = Driving(wall, self._driven, by_asking=plan.one_user)
        self.folder = Folder(plan.folder, closed=True)
        self.prefixes = prefixes_of((plan.folder, plan.journal and plan.journal.parent))
        self.session = self._session()
        self.drag_control = DragControl(self.session, wall)
        self.lookers = plan.allowance.of_looking(plan.allowance.all_looking, wall())
        self._journal: Journal | None = None
        self._memory: MemoryFile | None = None
        self.durable_log = self._durable_log()
        engine = self.session.engine
        if plan.causality:
            engine.perform(SetParameter("CAUSALITY", plan.causality))
        self._self = UserSession(self.session, UserState())
        self._events = engine.events.subscribe(woken=self.stirred)
        first = self._events.take(0.0)
        assert isinstance(first, TimelineReplaced)
        self.broadcast = Broadcast(self._self, first, wall)
        self._meter = Meter(plan.allowance, wall())
        self._measured = wall() - 2 * MEASURED
        self._grown: LimitReached | None = None
        self._ran = False
        self._watched_at = wall()  # when somebody held or watched it last
        self._paused_at: float | None = None  # since when it is paused, because nobody does
        self._watch: Ticket[None] | None = None
        self._looked: object = None  # when those who sit at a prompt were last told what stands around it
        self._clock: messages.Clock | None = None
        self._activity: messages.Activity | None = None
        self._told_now = 0.0  # of the clock
        self.session.driver.lags, self.session.actor.spent = self._lags, self._spent
        self._pulled = messages.Pulled(self.drag_control.pulled)
        self._pulled_at = wall()
        self.session.actor.serve()

    def _session(self) -> _Served:
        plan = self.plan
        plan.folder.mkdir(parents=True, exist_ok=True)
        clock = None if plan.realtime is None else WallClock(time.monotonic, time.sleep, plan.realtime)
        console = _Console(self._by_itself, self._typed)
        limits = plan.allowance.of_run(realtime=clock is not None)
        session = _Served(console, plan.model, clock=clock, limits=limits, folder=self.folder, advice=advice)
        console.session, session.driving = session, self.driving
        session.lease = self._binding(self.driving.lease)
        return session

    def _durable_log(self) -> DurableLog:
        """What was written down before goes on."""
        engine, path = self.session.engine, self.plan.journal
        if path is not None:
            taken = take_up(path, changes=self.plan.reach.changes)
            if taken.torn:
                self._tell(f"{path}: its last line was not written to its end, and is left out")
            self._journal = keep_journal(taken, engine, self._lost, together=True, reach=self.plan.reach)
            try:
                self._memory = MemoryFile(self.session, path.with_suffix(".v2"))
                for wrong in self._memory.bring_back():
                    self._tell(f"{self._memory.path}:{wrong.span.line}: {wrong.message}")
            except BaseException:
                self._journal.close()
                raise
        most = self.allowance.segments
        durable_log = DurableLog(lambda: len(engine.timeline), most, self._journal, self._memory)
        engine.book.journal = durable_log
        return durable_log

    def _lost(self, text: str) -> None:
        """The journal is not where it was: all have to know."""
        self._tell(text)
        self._by_itself(None, Message(text, Tone.ERROR))

    def close(self) -> None:
        """The server ends: what is under way is refused, and all is on the disk. Raises FileError."""
        self.session.actor.close()
        self._events.end()
        self.session.close()
        try:
            self.durable_log.settle()
        finally:
            if self._memory is not None:
                self._memory.close()
            if self._journal is not None:
                self._journal.close()

    # --- its users ---

    def enter(self, grant: Grant, hello: messages.Hello, link: ClientSocket) -> ClientSession:
        """Let a user in, perhaps again; the connection is welcomed."""
        client = self._known(grant, hello) or self._new(grant, hello)
        self._away.pop(client, None)
        connection, now = link.connection, self._wall()
        before = client.link
        if before is not None:
            before.connection.close("this holder has another connection now")
            client.detach()
            before.flush()
        connection.welcome(self._welcome(client, grant), client.delivery_log, now)
        link.flush()  # before the first that is told to all
        client.attach(link, hello)
        self._mind_idleness(now)
        return client

    def _known(self, grant: Grant, hello: messages.Hello) -> ClientSession | None:
        """The client that resumes with the key of its connection and the same token, if it is known."""
        client = None if hello.resume is None else self._delivery_logs.get(hello.resume.connection)
        return client if client is not None and client.grant == grant else None

    def _new(self, grant: Grant, hello: messages.Hello) -> ClientSession:
        client = ClientSession(
            self,
            self._free(grant.name or hello.name or "guest"),
            grant,
            DeliveryLog(token_urlsafe()),
            hello,
            self._wall,
        )
        self.clients[client.name] = self._delivery_logs[client.delivery_log.key] = client
        self._user_states[client.user_state] = client
        if hello.attended:
            self._seated[client] = None
        return client

    def _free(self, wanted: str) -> str:
        """Return a name that no other user has."""
        wanted = "".join(character if character.isprintable() else "?" for character in wanted)[:40]
        name, number = wanted, 1
        while name in self.clients:
            number += 1
            name = f"{wanted}-{number}"
        return name

    def _welcome(self, client: ClientSession, grant: Grant) -> messages.Welcome:
        role = TEACHER if grant.teacher and grant.name else grant.role.title
        return replace(self.greeting(), role=role, name=client.name, robots=self._robots(grant))

    def greeting(self) -> messages.Welcome:
        """For those who look without holding it."""
        return messages.Welcome(
            messages.VERSION,
            "",
            self.name,
            self.life,
            "observer",
            "",
            self.clock(),
            to_dict(self.plan.model),
            server=__version__,
            one_user=self.plan.one_user,
        )

    def clock(self) -> messages.Clock:
        clock = self.session.engine.clock
        if isinstance(clock, WallClock):
            now, rate, paused, wall = clock.read()
            return messages.Clock(now, rate, paused, True, wall)
        return messages.Clock(clock.reached, wall=self._wall())

    def cut(self, client: ClientSession, link: ClientSocket) -> None:
        """A socket is gone."""
        link.connection.cut(self._wall())
        if client.link is link:
            client.detach()
            self._away[client] = None
            if len(self._away) > MOST_AWAY:
                self.leave(next(iter(self._away)))

    def leave(self, client: ClientSession) -> None:
        """A user has left for good."""
        self._away.pop(client, None)
        self._seated.pop(client, None)
        if self.clients.pop(client.name, None) is None:
            return
        del self._delivery_logs[client.delivery_log.key], self._user_states[client.user_state]
        self._asked_at.pop(client, None)
        drove = self.driving.lease.drives(client.name)
        client.user_state.left = self.plan.when_gone is not WhenGone.ABORT
        client.leave()
        self.driving.leave(client.name)
        if drove:
            self._driver_gone(client.name)

    def present(self, client: ClientSession) -> tuple[tuple[str, ...], tuple[str, ...]]:
        return self._robots(client.grant), tuple(self.clients)

    # --- what is asked of it ---

    def others_ask(self, client: ClientSession) -> bool:
        earliest = self._wall() - LATELY
        return any(at > earliest for other, at in self._asked_at.items() if other is not client)

    def begin(self, client: ClientSession, pending: Pending) -> None:
        if pending.id:
            self._asked_at[client] = self._wall()
        self.broadcast.hold()

    def checked(self, dialogue: Dialogue[Any], always: Callable[[], bool]) -> Dialogue[Any]:
        """In the robot's thread. Raises FileError, LimitReached where nothing may be changed now."""
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
        if (now := self._wall()) - self._measured > MEASURED:
            self._measured, self._grown = now, self._too_large()
        if self._grown is not None:
            raise self._grown

    def _too_large(self) -> LimitReached | None:
        """What keeps the robot from growing any more."""
        session = self.session
        try:
            check_growth(self.allowance, len(session.environment.kinds()) + len(session.programs))
            check_room(self.folder, self.allowance)
        except LimitReached as error:
            return error
        return None

    def may_always(self, line: str) -> bool:
        """Whether a line only looks, stops, or makes room."""
        try:
            statement = parse_prompt(line, self.session.names())
        except VrsError:
            return False
        if isinstance(statement, Instruction) and (statement.word in FREEING or statement.word.startswith("DELETE")):
            return True
        return not isinstance(statement, ProgramHeader | None) and may_all(*needed(statement))

    def stops(self, client: ClientSession) -> None:
        session = self.session
        if session.running or self._self.now < session.engine.end:
            said = Message(f"{client.name} stops the robot", Tone.WARNING)
            for other in self.clients.values():
                if other is not client:
                    other.tell(messages.Told(said))
                    self._flush(other)

    @staticmethod
    def _flush(client: ClientSession) -> None:
        if client.link is not None:
            client.link.flush()

    def note(self, client: ClientSession, what: str, result: str) -> None:
        self._audit.note(self.name, client.name, client.address, what, result)

    # --- what it says: in its own thread ---

    def hear(self, client: ClientSession, pending: Pending, ticket: Ticket[Any], said: Reply | Question | None) -> None:
        """In the robot's thread. Who is told a long reply has the next request carried out when he has taken it."""
        if said is not None and not isinstance(said, Question) and is_long(said):
            self.session.actor.let_wait(client.user_state)
        self._put(lambda: self._tell_of(client, pending, ticket, said))

    def _by_itself(self, user_state: object, reply: Reply) -> None:
        ticket = self.session.actor.at_work
        self.session.actor.tell(lambda: self._put(lambda: self._show(user_state, reply, ticket)))

    def _typed(self, user_state: object, text: str, newline: bool) -> None:
        size = len(text) + BESIDE
        self._hears, self._typed_bytes = self._user_states.get(user_state), self._typed_bytes + size
        self.session.actor.tell(lambda: self._put(lambda: self._type(user_state, text, newline, size)))

    def _lags(self) -> bool:
        """Whether time waits until what programs have TYPEd is given on; virtual time also for who hears it."""
        if self._typed_bytes - self._given_bytes > MUCH:
            return True
        return self._hears is not None and not self.session.engine.realtime and self._hears.pace.lags(self._wall())

    def _spent(self, user_state: object, ticket: Ticket[Any], seconds: float) -> None:
        """A request of somebody has cost CPU time [s]. In any thread."""
        client = self._user_states.get(user_state)
        if client is not None:
            client.spend(seconds, typing=client.types(ticket))

    def _driven(self, lease: RobotLease, notice: Notice | None) -> None:
        self.session.lease = self._binding(lease)
        self._put(lambda: self._tell_lease(notice))

    def _binding(self, lease: RobotLease) -> RobotLease | None:
        """Whoever holds the robot of one user may drive it, as long as nobody has asked to do so alone."""
        return None if self.plan.one_user and not lease.holder else lease

    def _put(self, tell: Callable[[], list[ClientSession]]) -> None:
        self._said.append(tell)
        self.stirred()

    def stirred(self) -> None:
        """There is something to be pumped."""
        if not self._woken:
            self._woken = True
            self._wake()

    # --- what it says: in the thread of the connections ---

    def pump(self) -> None:
        """Give what was said to those whom it concerns."""
        self._woken = False
        touched: dict[ClientSession, None] = {}
        until = time.thread_time() + TOGETHER
        while self._said and time.thread_time() < until:
            for client in self._give(self._said.popleft()):
                touched[client] = None
        for client in touched:
            self._flush(client)
        if self._said:
            self.stirred()
        for event in self._events.taken():
            if not isinstance(event, MissedEvents):
                applied = self._self.now
                self.broadcast.tell(event, applied)
                if isinstance(event, TimelineDelta) and event.motion.kind is not MotionKind.STEERED:
                    self._told_now = applied  # what is told in short does not say it
        self._announce()

    def _give(self, tell: Callable[[], list[ClientSession]]) -> list[ClientSession]:
        """The same, whatever goes wrong with one of them."""
        try:
            return tell()
        except Exception as error:
            self._tell(internal_error(error).text)
            return []

    def _tell_of(
        self, client: ClientSession, pending: Pending, ticket: Ticket[Any], said: Reply | Question | None
    ) -> list[ClientSession]:
        """Of a request; None for its end."""
        client.hear(pending, ticket, said)
        if said is None:
            self.broadcast.release()
        return [client]

    def _type(self, user_state: object, text: str, newline: bool, size: int) -> list[ClientSession]:
        """What a program TYPEs, to whoever drives it, and to all consoles."""
        self._given_bytes += size
        hearing = [client for client in self.clients.values() if client.console or client.user_state is user_state]
        for client in hearing:
            client.tell(messages.Typed(text, newline))
        return hearing

    def _show(self, user_state: object, reply: Reply, ticket: Ticket[Any] | None = None) -> list[ClientSession]:
        """Tell who is at a desk, all where nobody is, what the robot says by itself; with the id of the command of that
        ticket, to who has given it.
        """
        everybody = list(self.clients.values())
        hearing = [client for client in everybody if client.user_state is user_state] or everybody
        for client in hearing:
            asked = None if ticket is None else client.pending.get(ticket)
            client.tell(messages.Told(reply, None if asked is None else asked.id or None))
        return hearing

    def _tell_lease(self, notice: Notice | None) -> list[ClientSession]:
        """It is in other hands, or asked for."""
        everybody = list(self.clients.values())
        for client in everybody:
            client.tell(messages.Lease(self.driving.lease.holder, notice))
        return everybody

    def _announce(self) -> None:
        """The clock and the activity, where they are not what all were told last. What the clock shows in virtual time
        is told by most changes.
        """
        now, before = self.clock(), self._clock
        same = before is not None and (now.rate, now.paused) == (before.rate, before.paused)
        if not same or (not now.realtime and now.now != self._told_now):
            self._clock, self._told_now = now, now.now
            self.broadcast.announce(now)
        self._announce_pulled()
        activity = self.activity()
        if activity != self._activity:
            self._activity = activity
            self.broadcast.announce(activity)

    def _announce_pulled(self) -> None:
        """What holds the tool at once, how far it is from the wish some times a second."""
        pulled, before, now = self.drag_control.pulled, self._pulled.state, self._wall()
        if pulled == before:
            return
        same = pulled.by == before.by and pulled.held.holds == before.held.holds
        if not same or now - self._pulled_at > PULLED_EVERY:
            self._pulled, self._pulled_at = messages.Pulled(pulled), now
            self.broadcast.announce(self._pulled)

    def activity(self) -> messages.Activity:
        """Who drives, and which programs run."""
        running = (track for track in tuple(self.session.tasks) if track.running and track.in_program)
        return messages.Activity(self.driving.lease.holder, tuple(track.task.program for track in running))

    # --- as time passes ---

    def tick(self) -> None:
        """See who is gone, and what has grown too large. To be called some times a second. Raises what went wrong in
        the robot's thread and nobody has waited for.
        """
        now = self._wall()
        for client in tuple(self._away):
            if client.link is None and client.delivery_log.expired(now):
                self.leave(client)
        driver = self.clients.get(self.driving.lease.holder)
        if driver is not None and driver.link is not None and now - driver.heard_at > ALIVE:
            driver.link.ping()
        if gone := self.driving.lapsed():
            self._driver_gone(gone)
        self._mind_idleness(now)
        self._watch_over()
        self._withdraw_questions()
        self._measure(now)
        self._push_status()
        self._note_ends()
        self._announce()
        if self.session.actor.internal_errors:
            raise self.session.actor.internal_errors.pop(0)

    def _driver_gone(self, who: str) -> None:
        """What becomes of the program is a setting."""
        if not self.session.running or self.plan.when_gone is WhenGone.GO_ON:
            return
        act = Session.abort if self.plan.when_gone is WhenGone.ABORT else Session.pause
        self._call(act, urgent=self.plan.when_gone is WhenGone.ABORT)
        said = "stopped" if self.plan.when_gone is WhenGone.ABORT else "paused"
        message = Message(f"{who} drove, and has gone: the program is {said}", Tone.WARNING)
        self._put(lambda: self._show(None, message))

    def _call(self, act: Callable[[Session], None], *, urgent: bool = False) -> None:
        """Have something done while nobody else changes anything."""
        self._self.put(quietly(lambda: act(self.session)), urgent=urgent)

    def _mind_idleness(self, now: float) -> None:
        """Pause a robot that works for nobody; let it go on when somebody holds or watches it."""
        if self.broadcast.watched:
            self._watched_at = now
            if self._paused_at is not None:
                self._go_on(now - self._paused_at)
        elif self._paused_at is None and now - self._watched_at >= self.plan.idle and self._works:
            self._paused_at = now
            self.session.actor.rest(True)
            self._audit.note(self.name, "", "", "(pause)", "nobody holds or watches it")

    @property
    def _works(self) -> bool:
        return self.session.running or self._self.now < self.session.engine.end

    def _go_on(self, paused: float) -> None:
        self._paused_at = None
        self.session.actor.rest(False)
        self._audit.note(self.name, "", "", "(go on)", f"after {paused:.0f} s")
        said = Message(f"nobody was here: the robot stood still for {paused:.0f} s, and goes on now", Tone.WARNING)
        self._put(lambda: self._show(None, said))

    def _watch_over(self) -> None:
        """A program whose holder has gone goes on, though nobody waits for it."""
        session = self.session
        if session.running and not session.driver.waited and (self._watch is None or self._watch.done()):
            self._watch = self._self.put(session.watch_over())

    def _withdraw_questions(self) -> None:
        """A program that was stopped asks nothing any more."""
        asked = tuple(one for client in self.clients.values() for one in client.asked_by_programs)
        if not asked:
            return

        def look(session: Session) -> None:
            if session.driver.withdrawn:
                for question, ticket in asked:
                    ticket.throw(AskedInVain(), question.id)

        self._call(look)

    def _measure(self, now: float) -> None:
        wrong = self._meter.look(self.session.actor.worked, now)
        if wrong is not None and not self.session.driver.end_by(wrong):
            self._call(Session.stop, urgent=True)  # tasks that nobody waits for
            told = refusal(wrong, "")
            self._put(lambda: self._show(None, told))

    def _note_ends(self) -> None:
        """What a program that has ended changed is written down."""
        ran, self._ran = self._ran, self.session.running
        if ran and not self._ran:
            self._call(lambda _session: self.durable_log.note())

    def _push_status(self) -> None:
        """What stands around a prompt, to those who sit at one: where something has happened, and each second."""
        engine, t = self.session.engine, self._self.now
        happened = engine.timeline.version, self.session.running, engine.settings, self.driving.lease.holder
        now = (*happened, min(t, engine.end), int(t))
        if now == self._looked:
            return
        self._looked = now
        for client in self._seated:
            if client.link is not None:
                client.look()
