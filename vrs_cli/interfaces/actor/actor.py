"""An actor: one robot that many ask at once. Requests come from any thread, and one thing is done at a time.

A request is a talk: a generator of replies and questions. What one holder asks for is begun in the order in which it
came, and several have their turns, so that nobody waits for all that another one wants. What is urgent overtakes them,
and then those that have not begun are refused. A request that waits, for an answer or until a program stops, lets
others go first.

`peek` tells when the next thing is due, `step` does it, and nothing happens between two steps. A shell, a batch run and
a test let `finish` step until their request is over; for a server `serve` steps in a thread of its own.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import partial
from itertools import count
from math import inf
from queue import SimpleQueue
from threading import Lock, Thread
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar

from msgspec import Struct, structs

from vrs_cli.engine.book import JournalWriter
from vrs_cli.engine.clock import WallClock
from vrs_cli.engine.feed import Inbox
from vrs_cli.errors import FileError, RequestRefused, VrsError
from vrs_cli.interfaces.actor.ticket import Outlet, Reaction, Ticket
from vrs_cli.interfaces.actor.turns import Turns
from vrs_cli.interfaces.dialogue import Dialogue, Running, Said, Slice, Terminal, Work, quietly
from vrs_cli.interfaces.tasks.tasks import PROMPT_LINE
from vrs_cli.values.questions import Question
from vrs_cli.values.replies import Message, Reply, Tone

if TYPE_CHECKING:
    from vrs_cli.interfaces.tasks.driver import Driver

MOST_WAITING = 10_000  # requests
TOGETHER = 0.02  # [s] for which answers may wait for others, that go to the disk with them
MOST_BESIDE = 3  # threads that work for those who look: more would keep the robot's own from its turn
LAG = 0.01  # [s] between two looks whether who hears of a program has caught up
T = TypeVar("T")


class _Request(Struct, eq=False):
    """What somebody asks for: its talk, and what that is sent when it goes on."""

    ticket: Ticket[Any]
    dialogue: Dialogue[Any]
    by: object
    reaction: Reaction = None
    asked: int = 0  # the id of its last question

    def go_on(self) -> Said:
        """What it says next. Raises StopIteration with its result, and whatever goes wrong in it."""
        reaction, self.reaction = self.reaction, None
        return self.dialogue.throw(reaction) if isinstance(reaction, BaseException) else self.dialogue.send(reaction)


class _Answer(NamedTuple):
    """What is given to the holder of a ticket; without one, what the robot says by itself."""

    ticket: Ticket[Any] | None
    give: Callable[[], None]


class Actor:
    """What is asked of one robot, and what becomes due on it."""

    def __init__(self, driver: Driver) -> None:
        self._driver = driver
        self._inbox: Inbox[Callable[[], object]] = Inbox()  # what is to be done of what others ask for
        self._present: list[_Request] = []  # in the middle of what they do: the last goes on first
        self._waiting: Turns[_Request] = Turns()  # to begin
        self._running: list[_Request] = []  # until a program has stopped
        self._asking: list[_Request] = []
        self._beside: list[_Request] = []  # another thread works for them
        self._at_work: _Request | None = None  # the one that does its part now
        self._behind: frozenset[object] = frozenset()  # who has not taken what he was told
        self._questions = count(1)
        self._time_first = False  # time goes on before the next request begins
        self._look = False  # what was done may have stopped a program that others wait for
        self._rests = self._stopped = False  # programs and motions stand; their clock was stopped for that
        self._answers: list[_Answer] = []  # to be given when the changes that they are of are on the disk
        self._beat: Callable[[], float | None] | None = None  # what the robot does by itself
        self._beats_at = inf  # [s] of the robot's clock
        self._since = inf  # [s] of real time: when the first of them was made
        self.internal_errors: list[Exception] = []  # errors of the program itself, while it was served
        self.worked = 0.0  # [s] of CPU, while it was served
        # told of the CPU time [s] that a request of somebody has cost, where many are served; from any thread
        self.spent: Callable[[object, Ticket[Any], float], None] = lambda _by, _ticket, _seconds: None
        self._stepping = Lock()
        self._works: SimpleQueue[tuple[_Request, Work] | None] = SimpleQueue()  # to be done beside; None ends it
        self._workers = 0
        self._server: Thread | None = None
        self._closed = False
        clock = driver.engine.clock
        if isinstance(clock, WallClock) and clock.sleep is time.sleep:
            clock.sleep = self._inbox.wait  # to wait for the time is to wait for the inbox
        driver.devices.outside.wake = self.wake

    # --- asking, from any thread ---

    def submit(
        self, dialogue: Dialogue[T], *, urgent: bool = False, by: object = None, outlet: Outlet | None = None
    ) -> Ticket[T]:
        """Ask for what a talk does. The ticket has what is said of it, and how it ends; or the outlet hears of that.
        `by`: who asks; while another thread works for that one, what he asks for next waits.
        """
        ticket: Ticket[T] = Ticket(self._put_reaction, self._put_withdrawal, outlet)
        if self._closed:
            ticket.refuse(RequestRefused("the robot is not driven any more"))
        elif not urgent and len(self._inbox) + len(self._waiting) >= MOST_WAITING:
            ticket.refuse(RequestRefused(f"{MOST_WAITING} requests wait already", "wait for some answers first"))
        else:
            request = _Request(ticket, dialogue, by)
            self._inbox.put(partial(self._overtake, request) if urgent else partial(self._waiting.put, request, by))
        return ticket

    def call(self, act: Callable[[], T], *, urgent: bool = False) -> Ticket[T]:
        """Ask for something to be done, while nobody else changes anything."""
        return self.submit(quietly(act), urgent=urgent)

    def tell(self, give: Callable[[], None]) -> None:
        """The robot says something by itself: it is given where its answers are, and in their order. For what happens
        in one of its steps.
        """
        self._answers.append(_Answer(None, give))

    def let_wait(self, by: object) -> None:
        """Hold back the requests of a user who has not taken the replies, until `let_go_on`. In any thread."""
        self._behind = self._behind | {by}

    def let_go_on(self, by: object) -> None:
        if by in self._behind:
            self._behind = self._behind - {by}
            self._inbox.put(lambda: None)

    def repeat(self, beat: Callable[[], float | None]) -> None:
        """In real time: from now on it is done, in the place of what was before, whenever it is due. It says when that
        is again [s], None for never. For what happens in one of the robot's steps.
        """
        self._beat, self._beats_at = beat, self._driver.engine.clock.reached

    def rest(self, rests: bool) -> None:
        """Let programs, motions and the clock stand from now on, or go on from where they stand; requests are carried
        out all the same. In any thread.
        """
        self._inbox.put(partial(self._rest, rests))

    def _rest(self, rests: bool) -> None:
        clock, self._rests = self._driver.engine.clock, rests
        if isinstance(clock, WallClock) and (self._stopped if not rests else not clock.paused):
            clock.change(paused=rests)
            self._stopped = rests

    def wake(self) -> None:
        """End a wait of `step`."""
        self._inbox.put(lambda: None)

    def _put_reaction(self, ticket: Ticket[Any], reaction: Reaction, question: int) -> None:
        self._inbox.put(partial(self._react, ticket, reaction, question))

    def _put_withdrawal(self, ticket: Ticket[Any]) -> None:
        self._inbox.put(partial(self._withdraw, ticket))

    # --- driving ---

    def peek(self) -> float:
        """When the next thing is due [s]: now where somebody asks for something, infinity where nothing happens by
        itself."""
        clock = self._driver.engine.clock
        if len(self._inbox) or self._present or self._ready or (self._running and self._look):
            return clock.reached
        if self._rests:
            return inf
        due = min(self._driver.peek(), self._beats_at)
        passes = not self._driver.stands if self._running else clock.realtime and not clock.paused
        return due if passes or due <= clock.reached else inf

    def step(self) -> None:
        """Do the next thing; where none is due, wait for it, or for a request. One thread may step at a time."""
        if not self._stepping.acquire(blocking=False):
            raise RuntimeError("another thread drives this robot: wait for the ticket")
        try:
            self._driver.engine.events.hold()
            self._step()
        finally:
            self._give_answers()
            self._stepping.release()

    def finish(self, ticket: Ticket[T], terminal: Terminal) -> T:
        """Drive until a request is over, or wait where it is served; what is said is shown and asked at a terminal.
        Return what comes of it. Raises what went wrong in it.
        """
        if self._server is not None:
            for said in ticket:
                self.put(said, ticket, terminal)
            return ticket.result()
        try:
            while not ticket.done():
                time_goes_on = bool(self._running)
                self.step()
                if time_goes_on:
                    self.put(Running(self._driver.engine.now), ticket, terminal)
                for said in ticket.heard():
                    self.put(said, ticket, terminal)
        except BaseException:
            self._withdraw(ticket)
            raise
        return ticket.result()

    @staticmethod
    def put(said: Reply | Question | Running, ticket: Ticket[Any], terminal: Terminal) -> None:
        """Show or ask it. What goes wrong with that is raised in the request, which may go on."""
        try:
            if isinstance(said, Question):
                ticket.answer(said.id, terminal.ask(said))
            elif isinstance(said, Running):
                terminal.progress(said)
            else:
                terminal.show(said)
        except (Exception, KeyboardInterrupt) as error:
            ticket.throw(error, said.id if isinstance(said, Question) else 0)

    def serve(self) -> None:
        """Drive in a thread of its own, until `close`."""
        self._server = Thread(target=self._serve, name="robot", daemon=True)
        self._server.start()

    def _serve(self) -> None:
        while not self._closed:
            try:
                self.step()
            except Exception as error:  # of a task that nobody waits for, which has ended with it
                self.internal_errors.append(error)
            self.worked = time.thread_time()

    def close(self) -> None:
        """Drive no longer: what has not ended is refused."""
        self._inbox.put(self._shut)
        if self._server is not None:
            self._server.join()
            self._server = None
            for _ in range(self._workers):
                self._works.put(None)
        self._take()

    # --- one step ---

    def _step(self) -> None:
        came = self._take()
        time_goes_on = bool(self._running) and not self._rests and not self._driver.stands
        if self._present:
            self._look = True
            self._work(self._present.pop())
        elif self._running and self._look:
            self._look = False
            self._go_on_all()
        elif self._beats_at <= self._driver.engine.clock.reached:
            self._go_on_by_itself()
        elif (ready := self._ready) and not (time_goes_on and (self._time_first or self._line_runs())):
            self._time_first = self._look = bool(self._running)
            self._waiting.begin(ready, ready.by)
            self._work(ready)
        elif time_goes_on:
            self._time_first = False
            self._happen()
        elif not self._rests and self._driver.peek() <= self._driver.engine.clock.reached:
            self._happen()
        elif not came:
            self._wait()

    @property
    def _ready(self) -> _Request | None:
        """Who begins next: whose turn it is, of those whose former request no other thread still works for, and who
        have taken what they were told.
        """
        busy = {request.by for request in self._beside if request.by is not None}
        return self._waiting.next(busy | self._behind)

    def _line_runs(self) -> bool:
        """Whether a line of the prompt is being carried out, which others wait for."""
        line = self._driver.tasks.get(PROMPT_LINE)
        return line is not None and line.running

    def _wait(self) -> None:
        """Until the next thing is due or a message comes."""
        due = self.peek()
        if due == inf:
            self._inbox.wait(None)
        else:
            self._driver.engine.clock.wait(due)

    def _go_on_by_itself(self) -> None:
        beat, self._beat, self._beats_at = self._beat, None, inf
        assert beat is not None
        again = beat()
        if again is not None:
            self._beat, self._beats_at = beat, again

    def _happen(self) -> None:
        """Let time go on to what is due next, and see who has waited for it."""
        error: BaseException | None = None
        try:
            if self._driver.held:
                self._inbox.wait(LAG)
            else:
                self._driver.step()
        except (Exception, KeyboardInterrupt) as raised:
            if not self._running:
                self._driver.drop()
                raise
            error = raised
        self._go_on_all(error)

    def _go_on_all(self, error: BaseException | None = None) -> None:
        """Let those go on that wait until a program has stopped."""
        waited, self._running = self._running, []
        for request in waited:
            request.reaction = request.reaction if error is None else error
            self._go_on(request)

    def _work(self, request: _Request) -> None:
        """Let a request do its next part, at the cost of who asks. Who is alone with a robot pays nothing."""
        if self._server is None:
            self._go_on(request)
            return
        begun = time.thread_time()
        self._go_on(request)
        self.spent(request.by, request.ticket, time.thread_time() - begun)

    def _go_on(self, request: _Request) -> None:
        """Let a request do its next part."""
        ticket, self._at_work = request.ticket, request
        try:
            said = request.go_on()
        except StopIteration as over:
            self._answers.append(_Answer(ticket, partial(ticket.end, over.value)))
        except BaseException as error:  # it is raised again where somebody waits for the result
            self._answers.append(_Answer(ticket, partial(ticket.refuse, error)))
        else:
            self._said(request, said)
        finally:
            self._at_work = None

    @property
    def at_work(self) -> Ticket[Any] | None:
        """The request that what happens now belongs to: it does its part, or a line of the prompt does it for it."""
        if self._at_work is not None:
            return self._at_work.ticket
        line = self._driver.tasks.get(PROMPT_LINE)
        if line is None or self._driver.tasks.current != PROMPT_LINE:
            return None
        return next((one.ticket for one in self._running if one.by is line.driven_by), None)

    def _said(self, request: _Request, said: Said) -> None:
        if said is Slice.RUNNING:
            self._running.append(request)
            return
        if isinstance(said, Slice):
            self._present.append(request)
            return
        if isinstance(said, Work):
            self._work_beside(request, said)
            return
        if isinstance(said, Question):
            request.asked = next(self._questions)
            said = structs.replace(said, id=request.asked)
            self._asking.append(request)
        else:
            self._present.append(request)
        self._answers.append(_Answer(request.ticket, partial(request.ticket.say, said)))

    def _work_beside(self, request: _Request, it: Work) -> None:
        """In another thread where many are served. Elsewhere there is nothing else to do meanwhile."""
        if self._server is None:
            it.run()
            self._present.append(request)
            return
        self._beside.append(request)

        self._works.put((request, it))
        if self._workers < min(len(self._beside), MOST_BESIDE):
            self._workers += 1
            Thread(target=self._work_on, name="beside", daemon=True).start()

    def _work_on(self) -> None:
        """What there is to be done beside, in a thread of its own."""
        while (one := self._works.get()) is not None:
            self._do_beside(*one)
            del one  # while this thread waits for more, it keeps nothing of what was done

    def _do_beside(self, request: _Request, it: Work) -> None:
        begun = time.thread_time()
        it.run()
        self.spent(request.by, request.ticket, time.thread_time() - begun)
        self._inbox.put(partial(self._worked, request.ticket))

    def _give_answers(self) -> None:
        """The changes that were made are on the disk, then who commanded them is answered, then all others hear of it.
        Where several changes go to the disk together, those that are asked for already are made before.
        """
        journal = self._driver.engine.book.journal
        if journal is not None and journal.unsettled:
            now = time.monotonic()
            self._since = min(self._since, now)
            if (len(self._inbox) or self._present or self._ready) and now - self._since < TOGETHER:
                return
            self._settle(journal)
        answers, self._answers, self._since = self._answers, [], inf
        for answer in answers:
            answer.give()
        self._driver.engine.events.release()

    def _settle(self, journal: JournalWriter) -> None:
        try:
            journal.settle()
        except FileError as error:
            lost = Message(f"{error}; what was done last is not on the disk", Tone.ERROR)
            tickets = dict.fromkeys(one.ticket for one in self._answers if one.ticket is not None)
            self._answers = [*(_Answer(ticket, partial(ticket.say, lost)) for ticket in tickets), *self._answers]

    # --- messages ---

    def _take(self) -> bool:
        """All messages that have come; whether any has."""
        if not self._inbox and not self._closed:
            return False
        acts = self._inbox.taken()
        for act in acts:
            act()
        if self._closed:
            self._end_all()
        return bool(acts)

    def _shut(self) -> None:
        self._closed = True

    def _overtake(self, request: _Request) -> None:
        """It comes before all others; those that have not begun are not begun after it."""
        for waiting in self._waiting.taken():
            self._end(waiting, RequestRefused("the robot was stopped before it began", "give it again"))
        self._present.append(request)

    def _react(self, ticket: Ticket[Any], reaction: Reaction, question: int) -> None:
        """An answer to the question with that id; or (0) what went wrong with something that was said, which may come
        late.
        """
        found, place = self._found(ticket)
        if found is None or (question and (place is not self._asking or question != found.asked)):
            return
        found.reaction = reaction
        if place is self._asking:
            place.remove(found)
            self._present.append(found)

    def _worked(self, ticket: Ticket[Any]) -> None:
        found, place = self._found(ticket)
        if found is not None and place is self._beside:
            place.remove(found)
            self._present.append(found)

    def _withdraw(self, ticket: Ticket[Any]) -> None:
        found, place = self._found(ticket)
        if found is None:
            return
        if place is None:
            self._waiting.begin(found, found.by)
        else:
            place.remove(found)
        self._end(found, RequestRefused("it was withdrawn"))

    def _end_all(self) -> None:
        left = self._waiting.taken()
        for place in self._places:
            while place:
                left.append(place.pop())
        for request in left:
            self._end(request, RequestRefused("the robot is not driven any more"))

    def _end(self, request: _Request, why: VrsError) -> None:
        """It goes on no more. What it leaves in order is in its talk."""
        try:
            request.dialogue.close()
        except Exception as error:
            request.ticket.refuse(error)
        else:
            request.ticket.refuse(why)

    @property
    def _places(self) -> tuple[list[_Request], ...]:
        """Of those that have begun."""
        return self._present, self._running, self._asking, self._beside

    def _found(self, ticket: Ticket[Any]) -> tuple[_Request | None, list[_Request] | None]:
        """The request of a ticket that has not ended, and where it is; None for one that waits to begin."""
        for place in (*self._places, None):
            for request in self._waiting if place is None else place:
                if request.ticket is ticket:
                    return request, place
        return None, None
