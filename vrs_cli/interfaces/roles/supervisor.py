"""Roles of programs at a port (the connection of one user to a robot). An observer asks for the position of a robot at
any time, and never waits for users who move the robot. A supervisor is an observer who also commands motions, programs,
settings, branches and ABORT."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from copy import copy
from pathlib import Path
from threading import Lock
from typing import TYPE_CHECKING, NamedTuple, TypeVar, cast
from weakref import finalize

from vrs_cli.engine import clock, engine, feed, position
from vrs_cli.errors import RequestRefused, VrsError, hints_for_python
from vrs_cli.files import atomic, program_file
from vrs_cli.interfaces.dialogue import Answers, Notes
from vrs_cli.interfaces.port.port import MakeRequest, Port, Previewed, answer_to, ends
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.values import acts, commands, replies, results
from vrs_cli.wire import messages

if TYPE_CHECKING:
    from vrs_cli.kinematics.arrays import Floats


T = TypeVar("T")


class RecordedRobot(NamedTuple):
    """A saved trajectory that can be observed like a robot whose motions are all over."""

    arm: RobotArm
    timeline: Timeline

    @property
    def now(self) -> float:
        return self.timeline.end


class Observer:
    """An observer of a robot: computes its position at any time of its timeline (the function g). Units are metres,
    radians and seconds."""

    def __init__(self, watched: position.Watched) -> None:
        self.watched = watched

    @property
    def arm(self) -> RobotArm:
        return self.watched.arm

    @property
    def timeline(self) -> Timeline:
        return self.watched.timeline

    @property
    def now(self) -> float:
        return self.watched.now

    @property
    def frames(self) -> commands.Frames:
        """The frames BASE and TOOL that are in effect now."""
        return self.timeline.locate(self.now)[0].motion.frames

    def at(self, t: float | None = None) -> results.Position:
        """Return the position of the robot at time t [s], past or future; by default now."""
        return position.position_at(self.arm, self.timeline, self.now if t is None else t)

    def over(self, times: Floats) -> position.PositionArrays:
        """Return the positions of the robot at the given times [s], an array of shape (N,)."""
        return position.positions_at(self.arm, self.timeline, times)


class _Conversation:
    """A listener at a port. It passes messages that answer no request to the inbox of the current conversation, if
    there is one. It does not refer to the Supervisor, so that the port, which refers to it, does not keep the
    Supervisor alive."""

    def __init__(self) -> None:
        self.notes, self.lock = Notes(), Lock()
        self.inbox: feed.Inbox[messages.ServerMessage] | None = None

    def hear(self, message: messages.ServerMessage) -> None:
        if self.inbox is not None:
            self.inbox.put(message)


class Supervisor(Observer):
    """A user who commands a robot through a port. Units are metres, radians and seconds. Any thread may call any
    method: requests are carried out one at a time, in the order of sending. VrsError is raised if the robot refuses a
    request, RequestRefused if there is no connection. No method waits for a connection."""

    def __init__(self, port: Port) -> None:
        self.port, self.followed = port, port.follow()
        super().__init__(self.followed)
        self._conversation = _Conversation()
        port.listen(self._conversation.hear)
        self._sent: list[Callable[[], object]] | None = None

    def on(self, port: Port) -> Supervisor:
        """Return a supervisor like this one that sends its requests through another port, which may attach conditions
        to them."""
        other = copy(self)
        other.port = port
        return other

    # --- requests ---

    def act(self, act: results.Act[T], answer: Answers | None = None, issued: float | None = None) -> T:
        """Let the robot carry out an act. Return its result. `answer`: a function that answers the questions of the
        act. `issued`: the time of issue t_iss [s], by default now."""
        if answer is None:
            return self.start(act, issued)()
        with hints_for_python(), self._collect_replies(answer):
            return cast(T, self._converse(lambda id: messages.At(id, act, issued)).found)

    def start(self, act: results.Act[T], issued: float | None = None) -> Callable[[], T]:
        """Send an act without waiting. Return a function that waits until the act has ended, and returns its result."""
        inbox: feed.Inbox[messages.ServerMessage] = feed.Inbox()
        id = self.port.begin(lambda id: messages.At(id, act, issued), inbox.put)

        def wait() -> T:
            with hints_for_python():
                return cast(T, cast(messages.Done, self._end(inbox, id)).found)

        return wait

    def say(self, line: str, answer: Answers) -> tuple[replies.Reply, ...]:
        """Carry out a prompt line. Return the replies and the text that programs have typed. `answer`: a function that
        answers questions. Raises LineRefused."""
        with self._collect_replies(answer) as notes:
            self._converse(lambda id: messages.At(id, acts.Say(line)))
            return notes.take_all()

    def type(self, text: str, answer: Answers) -> tuple[replies.Reply, ...]:
        """Carry out lines as if they were typed at a prompt; they may contain programs. Return the replies, which also
        report mistakes. `answer`: a function that answers questions."""
        with self._collect_replies(answer) as notes:
            done = self._converse(lambda id: messages.Line(id, text))
            if done.status is None or done.status.in_program:
                self._converse(lambda id: messages.At(id, acts.LeaveEntry("the text ends; ")))
            return notes.take_all()

    def abort(self) -> None:
        """Stop the program and the motion immediately, before all other requests."""
        self._ask(messages.Abort)

    def drive(self, act: messages.LeaseAct, to: str = "") -> None:
        """Request, take, give or release the lease (the exclusive right to drive the robot). `to`: the user who
        receives it. Raises LeaseHeld."""
        self._ask(lambda id: messages.Drive(id, act, to))

    def close(self) -> None:
        """Disconnect from the robot; no more requests are sent."""
        self.port.close()

    @contextmanager
    def _collect_replies(self, answer: Answers) -> Iterator[Notes]:
        """Collect the replies of requests within this context, and answer questions by `answer`. Raises RequestRefused
        if the connection is lost, or was lost while an earlier conversation of this supervisor went on."""
        conversation, cuts = self._conversation, self.port.cuts
        self.port.check_open()
        with conversation.lock:
            if self.port.cuts != cuts:
                raise RequestRefused("the connection was cut before its turn came: it was not sent", "give it again")
            conversation.notes.begin(answer)
            conversation.inbox = feed.Inbox()
            try:
                yield conversation.notes
            finally:
                conversation.inbox = None

    def _converse(self, make: MakeRequest) -> messages.Done:
        """Send a command in the current conversation, and wait until it has ended. Return its last message."""
        inbox = self._conversation.inbox
        assert inbox is not None, "a conversation goes on"
        return cast(messages.Done, self._end(inbox, self.port.begin(make, inbox.put)))

    def _ask(self, make: MakeRequest) -> messages.ServerMessage:
        """Send a request, and wait until it has ended. Return its last message."""
        inbox: feed.Inbox[messages.ServerMessage] = feed.Inbox()
        with hints_for_python():
            return self._end(inbox, self.port.begin(make, inbox.put))

    def _end(self, inbox: feed.Inbox[messages.ServerMessage], id: int) -> messages.ServerMessage:
        """Wait until a request has ended, and process the messages before its end. Return the last message. Raises the
        error if the robot has refused the request. Ctrl-C stops the request; a second Ctrl-C, or one that cannot be
        sent, ends the wait."""
        interrupted = False
        while True:
            try:
                message = self.port.take(inbox)
                assert message is not None, "it waits as long as that takes"
                if ends(message, id):
                    break
                self._hear(message)
            except KeyboardInterrupt:
                if interrupted or not self.port.open or not self.port.interrupt():
                    raise
                interrupted = True
        if interrupted:
            raise KeyboardInterrupt
        # raise here, not in `check_end`: each function call adds lines to the traceback that a user of Python reads
        if isinstance(message, messages.Done | messages.Refused) and message.refusal is not None:
            raise message.refusal.error().with_traceback(None) from None
        return message

    def _hear(self, message: messages.ServerMessage) -> None:
        notes = self._conversation.notes
        match message:
            case messages.Told(reply):
                notes.show(reply)
            case messages.Typed(text, newline):
                notes.type(text, newline)
            case messages.Asked():
                self.port.tell(answer_to(message, notes.ask))

    def move(
        self,
        target: commands.Target,
        *,
        straight: bool = False,
        issued: float | None = None,
        executed: float | None = None,
        speed: float | None = None,
        text: str = "",
    ) -> None:
        """Go to a target, by a joint-interpolated or a `straight` motion. `issued`: the time of issue t_iss [s];
        `executed`: the start time t_exec [s], by default after the last motion; `speed`: a fraction of the nominal
        speed in (0, 1]. `text`: the command shown in the timeline. Raises MotionError, IllegalValue, FileError."""
        self.send(acts.Go(acts.Goal.of(target), straight, executed, speed, text), issued)

    def send(self, act: results.Act[None], issued: float | None = None) -> None:
        """Let the robot carry out an act, and wait until it has ended, except in the context `without_waiting`."""
        wait = self.start(act, issued)
        if self._sent is None:
            wait()
        else:
            self._sent.append(wait)

    @contextmanager
    def without_waiting(self) -> Iterator[None]:
        """Within this context, send motions without waiting for each of them; at its end, wait for all. Raises the
        first refusal."""
        before, sent = self._sent, list[Callable[[], object]]()
        self._sent = sent
        try:
            yield
        finally:
            self._sent = before
            refused = list[VrsError]()
            for wait in sent:
                try:
                    wait()
                except VrsError as error:
                    refused.append(error)
        if refused:
            raise refused[0]

    # --- positions ---

    def at(self, t: float | None = None) -> results.Position:
        t = self.now if t is None else t
        return self._past((t,))[0] if t < self.followed.begins else super().at(t)

    def over(self, times: Floats) -> position.PositionArrays:
        found = super().over(times)
        gone = times < self.followed.begins
        if gone.any():
            position.fill(found, gone, self._past(times[gone].tolist()))
        return found

    def _past(self, times: Sequence[float]) -> tuple[results.Position, ...]:
        """Return the robot's positions at times [s] before the part of the timeline that is known in this process."""
        found: list[results.Position] = []
        for first in range(0, len(times), messages.MAX_TIMES):
            some = tuple(times[first : first + messages.MAX_TIMES])
            located = self._ask(lambda id, some=some: messages.Positions(id, some))  # type: ignore[misc]
            assert isinstance(located, messages.Located), "it answers Positions"
            found += located.positions
        return tuple(found)

    # --- motions ---

    def wait(self) -> None:
        """Wait until the robot has stopped; in real time this takes as long as its motions. Other users may send
        requests in the meantime. Raises ClockPaused if the clock is paused."""
        while (rate := self.followed.rate) is not None and (left := self.timeline.end - self.now) > 0.0:
            time.sleep(min(left / rate, clock.SLICE_S))
        self.act(acts.Rest())

    def preview_now(self) -> Previewed:
        """Return the robot's future, including the effects of commands that are still being transmitted."""
        return self.port.preview_now()

    # --- programs and variables ---

    def define(self, text: str, where: str = "line ") -> tuple[str, ...]:
        """Store in memory the programs and variables of a string with the contents of a program file. Return the names
        of the programs. Raises ProgramNotExecutable if the string contains mistakes; the error names the line of the
        first mistake, with `where` before the line number."""
        return self.act(acts.Define(text, where)).names

    def load(self, path: str | Path) -> tuple[str, ...]:
        """Store the programs and variables of a file in memory. Return the names of the programs. Raises
        NonexistentFile, FileError, and ProgramNotExecutable for a file with mistakes."""
        found = program_file.find_program_file(path)
        return self.define(program_file.read_program_file(found), f"{found}:")

    def execute(self, program: str, cycles: int, answer: Answers) -> results.RunResult:
        """Run a program in memory. `answer`: a function that answers its PROMPTs. The result contains an error that
        occurs in the program. Raises UndefinedName, ProgramNotExecutable, ArgumentMismatch."""
        return self.act(acts.Execute(program, cycles), answer)

    # --- the timeline ---

    def save(self, path: Path) -> None:
        """Write the robot's trajectory to a file. Raises FileError."""
        recorded = self.act(acts.Record())
        with atomic.atomically(path) as stream:
            stream.write(recorded.data)

    def subscribe(self) -> feed.Subscription[engine.TimelineChange]:
        """Subscribe to the timeline and all later changes of it. The subscription ends when the supervisor no longer
        exists."""
        subscription = self.port.subscribe()
        finalize(self, subscription.end)
        return subscription
