"""One user of a robot: messages of the user become requests to the robot's actor, and replies of the robot become
messages to the user. No function here waits, or depends on whether the user is in the same process or at the other end
of a connection."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple, TypeVar

from msgspec import Struct

from vrs_cli.engine.position import position_at
from vrs_cli.errors import LimitReached, RequestRefused, VrsError
from vrs_cli.interfaces.conversation.conversation import Conversation
from vrs_cli.interfaces.dialogue import Dialogue, Ticket, beside, internal_error, quietly
from vrs_cli.interfaces.dialogue import Outlet as ActorOutlet
from vrs_cli.interfaces.monitor.programs import emergency_stop
from vrs_cli.interfaces.port.port import Outlet
from vrs_cli.interfaces.session.acts import act_on
from vrs_cli.interfaces.session.session import Session
from vrs_cli.interfaces.station.station import LineStopped
from vrs_cli.interfaces.users import STOPPING, UserState
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.language.text import ast, parser
from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.values import acts, questions, replies, results
from vrs_cli.wire import messages

T = TypeVar("T")


class Pending(Struct, eq=False):
    """A request that has not ended, and the outlet for its messages. `message`: the message with the request. `answer`:
    makes the last message from the result; None: the last message is `Done`. `wrong`: the first error reply of the
    request."""

    id: int
    outlet: Outlet
    message: messages.ClientMessage | None = None
    answer: Callable[[Any], messages.ServerMessage | None] | None = None
    wrong: replies.Reply | None = None


class _Found(NamedTuple):
    """The result of a command, and the state that the prompt shows after it."""

    status: questions.PromptStatus
    found: Any


class UserSession:
    """One user of a robot. `user_state`: the state kept for the user; `conversation`: the lines that the user types;
    `pending`: the requests that have not ended; `questions`: the open questions by id. A subclass may limit requests
    (`ask`), and choose how they reach the robot (`submit`). `tells_status`: the message at the end of a command
    contains the state that the prompt shows."""

    tells_status = True

    def __init__(self, session: Session, user_state: UserState) -> None:
        self.session, self.user_state = session, user_state
        self.conversation = Conversation(session, user_state)
        self.pending: dict[Ticket[Any], Pending] = {}
        self.questions: dict[int, tuple[questions.Question, Ticket[Any]]] = {}

    # --- reading, in any thread and without waiting ---

    @property
    def arm(self) -> RobotArm:
        return self.session.engine.arm

    @property
    def timeline(self) -> Timeline:
        """The timeline of the branch of the trajectory that the user sees."""
        return self.session.branches.seen_by(self.user_state)[0]

    @property
    def now(self) -> float:
        """The time of the robot's clock on the branch that the user sees [s]."""
        return self.session.branches.seen_by(self.user_state)[1]

    # --- messages from the user ---

    def take(self, message: messages.ClientMessage, outlet: Outlet) -> None:
        """Carry out a message of the user. The outlet receives the replies, or the refusal if the message causes an
        error."""
        try:
            self.carry_out(message, outlet)
        except Exception as error:
            self.refuse(message, error, outlet)

    def carry_out(self, message: messages.ClientMessage, outlet: Outlet) -> None:
        """Carry out a message of the user. The outlet receives the replies. Raises errors that prevent this."""
        conversation = self.conversation
        match message:
            case messages.Line():
                dialogue = self._with_issue_time(message.issued, conversation.lines(message.text, message.more))
                self.ask(message, dialogue, outlet, urgent=self.stops(message.text))
            case messages.At(act=results.UserAct() as act):
                self.ask(message, conversation.act(act), outlet)
            case messages.At(act=act):
                doing = self._with_issue_time(message.issued, act_on(self.session, act))
                self.ask(message, doing, outlet, urgent=isinstance(act, acts.Say) and self.stops(act.line))
            case messages.Abort():
                self.session.check_may_stop(self.user_state)
                self.ask(message, emergency_stop(self.session), outlet, urgent=True)
            case messages.Interrupt():
                self._interrupt()
            case messages.Answer():
                self._answer(message)
            case messages.Complete(id, text, everything):
                suggested = conversation.suggest(text, everything)
                self.ask(message, suggested, outlet, lambda found: messages.Completed(id, tuple(found)))
            case messages.Check(id, text):
                self.ask(message, quietly(partial(conversation.mistake, text)), outlet, partial(messages.Checked, id))
            case messages.Positions(id, times):
                if len(times) > messages.MAX_TIMES:
                    raise LimitReached(
                        f"{len(times)} times at once, {messages.MAX_TIMES} at most", "ask again for the others"
                    )
                timeline, arm = self.timeline, self.arm
                located = beside(lambda: tuple(position_at(arm, timeline, t) for t in times))
                self.ask(message, located, outlet, partial(messages.Located, id, timeline.version))
            case _:
                raise KeyError(type(message))

    def refuse(self, message: messages.ClientMessage, error: Exception, outlet: Outlet) -> None:
        """Tell the user that a message was refused because of an error."""
        refusal, id = self.refusal(error), message.id if isinstance(message, messages.Request) else None
        outlet(
            messages.Done(message.id, ok=False, refusal=refusal, version=self.timeline.version)
            if isinstance(message, messages.Command)
            else messages.Refused(refusal, id)
        )

    def ask(
        self,
        message: messages.Request,
        dialogue: Dialogue[Any],
        outlet: Outlet,
        answer: Callable[[Any], messages.ServerMessage] | None = None,
        *,
        urgent: bool = False,
    ) -> None:
        """Let the robot run the dialogue that carries out a request. `answer`: makes the last message from the
        result."""
        if self.tells_status and isinstance(message, messages.Line | messages.At | messages.Abort):
            dialogue = self._with_status(dialogue)
        self.submit(dialogue, Pending(message.id, outlet, message, answer), urgent=urgent)

    def _with_status(self, dialogue: Dialogue[Any]) -> Dialogue[_Found]:
        found = yield from dialogue
        return _Found(self.status(), found)

    def status(self) -> questions.PromptStatus:
        """Return the state that the user's prompt shows. Call only in the robot's thread, while this user is being
        served."""
        return self.conversation.status()

    def submit(self, dialogue: Dialogue[Any], pending: Pending, *, urgent: bool = False) -> None:
        ticket = self.put(dialogue, partial(self.hear, pending), urgent=urgent)
        if not ticket.done():
            self.pending[ticket] = pending

    def put(self, dialogue: Dialogue[T], outlet: ActorOutlet | None = None, *, urgent: bool = False) -> Ticket[T]:
        """Queue a dialogue as a request of this user; it runs with this user's state."""
        session = self.session
        if self.user_state is not session.own_user_state:
            dialogue = session.at(self.user_state, dialogue)
        return session.actor.submit(dialogue, urgent=urgent, by=self.user_state, outlet=outlet)

    def stops(self, line: str) -> bool:
        """Return whether a line is an ABORT that this user may give now; it is carried out before all waiting
        requests."""
        if line.lstrip()[:2].upper() != STOPPING[0][:2] or self.user_state.editor is not None:
            return False
        try:
            statement = parser.parse_prompt(line, ())
            if not isinstance(statement, ast.Instruction) or statement.word not in STOPPING:
                return False
            self.session.check_may_stop(self.user_state)
        except VrsError:
            return False
        return True

    def _with_issue_time(self, issued: float | None, dialogue: Dialogue[T]) -> Dialogue[T]:
        """Return a dialogue that knows when its request was issued: at the time claimed by the sender, limited to
        possible values."""
        user = self.user_state
        return dialogue if issued is None else user.with_issue_time(user.times.issue_time(issued, self.now), dialogue)

    def _interrupt(self) -> None:
        """Interrupt the open questions as Ctrl-C does. If none is open, interrupt the requests that have not ended."""
        waits = {} if self.questions else self.pending
        for question, ticket in self.questions.values():
            ticket.throw(KeyboardInterrupt(), question.id)
        self.questions.clear()
        for ticket, pending in tuple(waits.items()):
            if pending.answer is None:
                self.conversation.interrupt(ticket)

    def _answer(self, message: messages.Answer) -> None:
        """Pass an answer to the request that asked the question. Ignore an answer to a question that is no longer
        open."""
        if message.question not in self.questions:
            return
        question, ticket = self.questions.pop(message.question)
        if message.how is messages.How.ANSWERED:
            ticket.answer(message.question, message.value)
        elif message.how is messages.How.INTERRUPTED:
            ticket.throw(KeyboardInterrupt(), message.question)
        else:
            ticket.throw(questions.end_of_input(question), message.question)

    # --- replies of the robot to a request ---

    def hear(self, pending: Pending, ticket: Ticket[Any], said: replies.Reply | questions.Question | None) -> None:
        """Send a reply or question of a request to the user. `said` is None when the request has ended."""
        if said is None:
            self.end(pending, ticket)
        elif isinstance(said, questions.Question):
            self._withdraw(ticket, pending.outlet)
            self.questions[said.id] = said, ticket
            pending.outlet(messages.Asked(said.id, said, pending.id))
        else:
            if pending.wrong is None and replies.is_error(said):
                pending.wrong = said
            pending.outlet(messages.Told(said, pending.id or None))

    def end(self, pending: Pending, ticket: Ticket[Any]) -> None:
        """Tell the user how a request has ended."""
        self._withdraw(ticket, pending.outlet)
        self.pending.pop(ticket, None)
        error = ticket.error(0.0)
        if pending.answer is not None:
            self._tell_found(pending, ticket, error)
            return
        found = ticket.result() if error is None else None
        status, found = found if isinstance(found, _Found) else (None, found)
        ok = error is None and pending.wrong is None
        refusal = None if error is None else self.refusal(error)
        pending.outlet(messages.Done(pending.id, ok, refusal, self.timeline.version, status, found))

    def _tell_found(self, pending: Pending, ticket: Ticket[Any], error: BaseException | None) -> None:
        assert pending.answer is not None, "Done ends all others"
        try:
            found = pending.answer(ticket.result()) if error is None else None
        except Exception as wrong:
            found, error = None, wrong.with_traceback(None)
        if found is not None:
            pending.outlet(found)
        elif error is not None and pending.id:
            pending.outlet(messages.Refused(self.refusal(error), pending.id))

    def _withdraw(self, ticket: Ticket[Any], outlet: Outlet) -> None:
        """Withdraw the open question of a request, because the request has continued or ended without an answer."""
        for number, (_, asked) in tuple(self.questions.items()) if self.questions else ():
            if asked is ticket:
                del self.questions[number]
                outlet(messages.Withdrawn(number))

    @property
    def asked_by_programs(self) -> tuple[tuple[questions.Question, Ticket[Any]], ...]:
        """The open questions of programs (PROMPT), with the requests that ask them."""
        return tuple(one for one in self.questions.values() if isinstance(one[0], questions.LineWanted))

    def drop(self, error: BaseException) -> None:
        """End the requests that have not ended, and send the error as the last reply to each of them."""
        for ticket, pending in tuple(self.pending.items()):
            ticket.withdraw()
            outlet, pending.outlet = pending.outlet, lambda _message: None
            outlet(messages.Told(self.conversation.error_reply(error, ""), pending.id))
            outlet(messages.Done(pending.id, ok=False))

    def refusal(self, error: BaseException) -> messages.Refusal:
        """Return the message for an error. For an internal error it contains as little detail as in the shell."""
        if isinstance(error, VrsError):
            return messages.Refusal.of(error)
        if isinstance(error, LineStopped):
            return messages.Refusal.of(RequestRefused("it was stopped before it was done"))
        if isinstance(error, KeyboardInterrupt):
            return messages.Refusal.of(RequestRefused("it was interrupted"))
        said = internal_error(error, afar=True) if isinstance(error, Exception) else results.Message(str(error))
        return messages.Refusal.of(RequestRefused(said.text))

    def leave(self) -> None:
        """End the requests of a user who has left, and forget the user."""
        for ticket in tuple(self.pending):
            ticket.withdraw()
        self.session.actor.call(lambda: self.session.leave(self.user_state))
