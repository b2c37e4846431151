"""An actor: the executor of all requests that users send to one robot. Requests come from any thread; the actor does
one thing at a time. A request is a dialogue: a generator of replies and questions. The requests of one user begin in
the order of their arrival, and users take turns, so that nobody waits for all requests of another user. An urgent
request is carried out before all others, and requests that have not begun are then refused. While a request waits, for
an answer or for a program to stop, others continue. `peek` returns the time of the next event, `step` carries out that
event, and nothing happens between two steps. In a shell, a batch run or a test, `finish` calls `step` until a request
has ended; in a server, a separate thread (`serve`) calls it."""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import cached_property, partial
from itertools import count
from math import inf
from threading import Lock, Thread
from typing import TYPE_CHECKING, Any, TypeVar

from msgspec import structs

from vrs_cli.engine.clock import WallClock
from vrs_cli.engine.feed import Inbox
from vrs_cli.errors import FileError, RequestRefused, VrsError
from vrs_cli.interfaces.dialogue import (
    Dialogue,
    Outlet,
    Reaction,
    Running,
    Said,
    Slice,
    Terminal,
    Ticket,
    Waiting,
    Work,
    quietly,
)
from vrs_cli.interfaces.tasks.tasks import PROMPT_LINE
from vrs_cli.values import questions, results

if TYPE_CHECKING:
    from queue import SimpleQueue

    from vrs_cli.interfaces.tasks.driver import Driver
    from vrs_cli.values.replies import Reply

MAX_WAITING_REQUESTS = 10_000  # refuse new requests while this many requests wait
GROUP_COMMIT_S = 0.02  # [s] delay answers by this time at most, so that several changes are written to disk together
MAX_WORK_THREADS = 3  # do long work in at most this many threads; more would slow down the robot's own thread
LAG_CHECK_S = 0.01  # [s] check at this interval whether the users have received the output of programs (TYPE)
T = TypeVar("T")


_Given = tuple[Ticket[Any] | None, Callable[[], None]]
"""A ticket, and a function that delivers a reply to its user; None, and one that delivers a message of the robot."""


class Actor:
    """The executor of all requests to one robot and of its events. `internal_errors`: errors of vrs itself that
    occurred while serving. `worked`: the CPU time that the actor's thread has used [s]. If many users are served,
    `spent` is called after each part of a request with its user and the CPU time used [s], in any thread."""

    def __init__(self, driver: Driver) -> None:
        self._driver = driver
        # calls that other threads have queued for the actor's thread
        self._inbox: Inbox[Callable[[], object]] = Inbox()
        self._waiting = Waiting()  # requests that have not begun
        self._present: list[Ticket[Any]] = []  # requests that have begun and can continue, the next one last
        self._running: list[Ticket[Any]] = []  # requests that wait until a program has stopped
        self._asking: list[Ticket[Any]] = []
        self._working: list[Ticket[Any]] = []  # requests that wait for work in another thread
        self._at_work: Ticket[Any] | None = None  # the request that is running now
        self._behind: frozenset[object] = frozenset()  # users who have not yet received their replies
        self._questions = count(1)
        # whether the clock must advance before the next request begins, so that programs continue
        self._time_first = False
        self._look = False  # whether a program may have stopped, so that requests waiting for it must be resumed
        self._rests = self._stopped = False  # whether `rest` has stopped everything; whether it has paused the clock
        self._answers: list[_Given] = []  # replies to send as soon as the changes that they report are on the disk
        self._since = inf  # [s] real time since which the first of these replies has waited
        # callback that `repeat` has installed; None if there is none
        self._beat: Callable[[], float | None] | None = None
        self._beats_at = inf  # [s] time of its next call, by the robot's clock
        self.internal_errors: list[Exception] = []
        self.worked = 0.0
        self.spent: Callable[[object, Ticket[Any], float], None] = lambda _by, _ticket, _seconds: None
        self._stepping = Lock()
        self._workers = 0
        self._server: Thread | None = None
        self._closed = False
        clock = driver.engine.clock
        if isinstance(clock, WallClock) and clock.sleep is time.sleep:
            clock.sleep = self._inbox.wait  # a message in the inbox then ends the sleep of the clock early
        driver.devices.outside.wake = self.wake

    # --- requests, from any thread ---

    def submit(
        self, dialogue: Dialogue[T], *, urgent: bool = False, by: object = None, outlet: Outlet | None = None
    ) -> Ticket[T]:
        """Queue a dialogue as a request. Its replies and result are collected in the ticket, or passed to the outlet.
        `urgent`: carry it out before all others. `by`: the user who sent it. While another thread works on a request of
        this user, the user's next request waits."""
        ticket = Ticket(dialogue, by, outlet, self._inbox.put, self._react, self._withdraw)
        if self._closed:
            ticket.end(None, RequestRefused("the robot is not driven any more"))
        elif not urgent and len(self._inbox) + self._waiting.count >= MAX_WAITING_REQUESTS:
            refusal = RequestRefused(f"{MAX_WAITING_REQUESTS} requests wait already", "wait for some answers first")
            ticket.end(None, refusal)
        else:
            self._inbox.put(partial(self._overtake, ticket) if urgent else partial(self._move, self._waiting, ticket))
        return ticket

    def call(self, act: Callable[[], T], *, urgent: bool = False) -> Ticket[T]:
        """Queue a function as a request. No other request can change anything while the function runs."""
        return self.submit(quietly(act), urgent=urgent)

    def tell(self, give: Callable[[], None]) -> None:
        """Queue a message of the robot itself, to be delivered by `give` after all replies queued so far. Call only
        within a step of the robot."""
        self._answers.append((None, give))

    def let_wait(self, by: object) -> None:
        """Let the requests of a user wait until `let_go_on` is called, because the user has not received the replies
        yet. Any thread may call this method."""
        self._behind = self._behind | {by}

    def let_go_on(self, by: object) -> None:
        if by in self._behind:
            self._behind = self._behind - {by}
            self.wake()

    def repeat(self, beat: Callable[[], float | None]) -> None:
        """Install the periodic callback, replacing the previous one. The callback returns the time of its next call by
        the robot's clock [s], or None to end. Call only within a step of the robot."""
        self._beat, self._beats_at = beat, self._driver.engine.clock.reached

    def rest(self, rests: bool) -> None:
        """Stop programs, motions and the clock (True), or let them continue (False). Requests are carried out in both
        cases. Any thread may call this method."""
        self._inbox.put(partial(self._rest, rests))

    def _rest(self, rests: bool) -> None:
        clock, self._rests = self._driver.engine.clock, rests
        if isinstance(clock, WallClock) and (self._stopped if not rests else not clock.paused):
            clock.change(paused=rests)
            self._stopped = rests

    def wake(self) -> None:
        """Make `step` return if it is waiting."""
        self._inbox.put(lambda: None)

    # --- stepping ---

    @property
    def has_requests(self) -> bool:
        """Return whether a request can begin or continue now, because it waits neither for a program nor for an
        answer."""
        return bool(len(self._inbox) or self._present or self._ready)

    @property
    def lets_time_pass(self) -> bool:
        """Return whether a request waits for a program to stop; only then may `step` advance a virtual clock."""
        return bool(self._running)

    def peek(self) -> float:
        """Return the time of the next event [s]: now if a request can continue, infinity if nothing will happen without
        a new request."""
        clock = self._driver.engine.clock
        if len(self._inbox) or self._present or self._ready or (self._running and self._look):
            return clock.reached
        if self._rests:
            return inf
        due = min(self._driver.peek(), self._beats_at)
        passes = not self._driver.blocked_by_clock if self._running else clock.realtime and not clock.paused
        return due if passes or due <= clock.reached else inf

    def step(self) -> None:
        """Carry out the next event; if there is none now, wait for an event or a request. Raises RuntimeError if
        another thread is in a step."""
        if not self._stepping.acquire(blocking=False):
            raise RuntimeError("another thread drives this robot: wait for the ticket")
        try:
            self._driver.engine.events.hold()
            came = self._take()
            time_goes_on = bool(self._running) and not self._rests and not self._driver.blocked_by_clock
            if self._present:
                self._look = True
                self._work(self._present[-1])
            elif self._running and self._look:
                self._look = False
                self._go_on_all()
            elif self._beat is not None and self._beats_at <= self._driver.engine.clock.reached:
                beat, self._beat, self._beats_at = self._beat, None, inf
                if (again := beat()) is not None:
                    self._beat, self._beats_at = beat, again
            elif (ready := self._ready) and not (time_goes_on and (self._time_first or self._line_runs())):
                self._time_first = self._look = bool(self._running)
                self._work(ready)
            elif time_goes_on:
                self._time_first = False
                self._happen()
            elif not self._rests and self._driver.peek() <= self._driver.engine.clock.reached:
                self._happen()
            elif not came:
                self._wait()
        finally:
            self._give_answers()
            self._stepping.release()

    def finish(self, ticket: Ticket[T], terminal: Terminal) -> T:
        """Call `step` until a request has ended. Return its result. The terminal shows the replies and asks the
        questions of the request. Raises the error of the request."""
        try:
            while not ticket.done():
                time_goes_on = bool(self._running)
                self.step()
                if time_goes_on:
                    self.put(Running(self._driver.engine.now), ticket, terminal)
                for said in ticket.take_said():
                    self.put(said, ticket, terminal)
        except BaseException:
            self._withdraw(ticket)
            raise
        return ticket.result()

    @staticmethod
    def put(said: Reply | questions.Question | Running, ticket: Ticket[Any], terminal: Terminal) -> None:
        """Show a reply or ask a question at the terminal. An error of the terminal is raised inside the dialogue of the
        request, which may handle it and continue."""
        try:
            if isinstance(said, questions.Question):
                ticket.answer(said.id, terminal.ask(said))
            elif isinstance(said, Running):
                terminal.progress(said)
            else:
                terminal.show(said)
        except (Exception, KeyboardInterrupt) as error:
            ticket.throw(error, said.id if isinstance(said, questions.Question) else 0)

    def serve(self) -> None:
        """Call `step` repeatedly in a separate thread, until `close` is called."""
        self._server = Thread(target=self._serve, name="robot", daemon=True)
        self._server.start()

    def _serve(self) -> None:
        while not self._closed:
            try:
                self.step()
            except Exception as error:  # an error in a task for which no user waits; the task has been stopped
                self.internal_errors.append(error)
            self.worked = time.thread_time()

    def close(self) -> None:
        """Stop the actor. Requests that have not ended are refused."""
        self._inbox.put(self._end_all)
        if self._server is not None:
            self._server.join()
            self._server = None
            for _ in range(self._workers):
                self._works.put(None)
        self._take()

    # --- one step ---

    @property
    def _ready(self) -> Ticket[Any] | None:
        """Return the next request to begin; None if there is none. Users who have not received their replies, and users
        for whom another thread works, must wait."""
        return self._waiting.next({ticket.by for ticket in self._working if ticket.by is not None} | self._behind)

    def _line_runs(self) -> bool:
        """Return whether a prompt line is moving the arm, so that other requests must wait."""
        line = self._driver.tasks.get(PROMPT_LINE)
        return line is not None and line.running

    def _wait(self) -> None:
        """Wait until the time of the next event, or until a message arrives."""
        due = self.peek()
        if due == inf:
            self._inbox.wait(None)
        else:
            self._driver.engine.clock.wait(due)

    def _happen(self) -> None:
        """Advance the clock to the next event of programs and carry it out; then resume the requests that wait for
        programs."""
        error: BaseException | None = None
        try:
            if self._driver.waits_for_users:
                self._inbox.wait(LAG_CHECK_S)
            else:
                self._driver.step()
        except (Exception, KeyboardInterrupt) as raised:
            if not self._running:
                self._driver.drop()
                raise
            error = raised
        self._go_on_all(error)

    def _go_on_all(self, error: BaseException | None = None) -> None:
        """Resume the requests that wait for programs; those whose programs have stopped end, the others wait again.
        `error`: raise it inside these requests."""
        for ticket in tuple(self._running):
            ticket.reaction = ticket.reaction if error is None else error
            self._go_on(ticket)

    def _work(self, ticket: Ticket[Any]) -> None:
        """Carry out the next part of a request, and report the CPU time used to `spent` if many users are served."""
        if self._server is None:
            self._go_on(ticket)
            return
        begun = time.thread_time()
        self._go_on(ticket)
        self.spent(ticket.by, ticket, time.thread_time() - begun)

    def _go_on(self, ticket: Ticket[Any]) -> None:
        """Carry out the next part of a request, and queue its reply, its question or its end."""
        self._move(None, ticket)
        self._at_work, reaction, ticket.reaction = ticket, ticket.reaction, None
        dialogue = ticket.dialogue
        try:
            said = dialogue.throw(reaction) if isinstance(reaction, BaseException) else dialogue.send(reaction)
        except StopIteration as over:
            self._answers.append((ticket, partial(ticket.end, over.value)))
        except BaseException as error:  # the ticket raises it again for the user who waits for the result
            self._answers.append((ticket, partial(ticket.end, None, error)))
        else:
            self._take_said(ticket, said)
        finally:
            self._at_work = None

    def _move(self, place: list[Ticket[Any]] | Waiting | None, ticket: Ticket[Any]) -> None:
        """Move a request to another queue. None: only remove it from its queue."""
        if ticket.place is not None:
            ticket.place.remove(ticket)
        ticket.place = place
        if place is not None:
            place.append(ticket)

    @property
    def at_work(self) -> Ticket[Any] | None:
        """The request that the actor is working on: the one whose dialogue is running, or the one whose prompt line is
        being carried out; None if there is none."""
        if self._at_work is not None:
            return self._at_work
        line = self._driver.tasks.get(PROMPT_LINE)
        if line is None or self._driver.tasks.current != PROMPT_LINE:
            return None
        return next((ticket for ticket in self._running if ticket.by is line.driven_by), None)

    def _take_said(self, ticket: Ticket[Any], said: Said) -> None:
        """Put a request that has yielded `said` into the right queue, and queue the reply or question for its user."""
        if isinstance(said, Work):
            self._work_in_thread(ticket, said)
            return
        question = isinstance(said, questions.Question)
        self._move(self._asking if question else self._running if said is Slice.RUNNING else self._present, ticket)
        if isinstance(said, questions.Question):
            ticket.asked = next(self._questions)
            said = structs.replace(said, id=ticket.asked)
        if not isinstance(said, Slice):
            self._answers.append((ticket, partial(ticket.say, said)))

    def _work_in_thread(self, ticket: Ticket[Any], it: Work) -> None:
        """Let another thread do the work of a request if many users are served. Otherwise do it at once, because nobody
        else waits."""
        if self._server is None:
            it.run()
            self._move(self._present, ticket)
            return
        self._move(self._working, ticket)
        self._works.put((ticket, it))
        if self._workers < min(len(self._working), MAX_WORK_THREADS):
            self._workers += 1
            Thread(target=self._work_on, name="beside", daemon=True).start()

    @cached_property
    def _works(self) -> SimpleQueue[tuple[Ticket[Any], Work] | None]:
        """Return the queue of work for other threads; a thread that gets None ends."""
        from queue import SimpleQueue  # imported here because short runs have no work for other threads

        return SimpleQueue()

    def _work_on(self) -> None:
        """Do the queued work of requests. This method is the loop of a worker thread."""
        while (one := self._works.get()) is not None:
            self._do_in_thread(*one)
            del one  # otherwise finished work would stay in memory while this thread waits for more

    def _do_in_thread(self, ticket: Ticket[Any], it: Work) -> None:
        begun = time.thread_time()
        it.run()
        self.spent(ticket.by, ticket, time.thread_time() - begun)
        self._inbox.put(partial(self._end_work, ticket))

    def _give_answers(self) -> None:
        """Write changes to the disk, then send the replies that report them, then notify all other users. If several
        changes are to be written together, do nothing until requests that have already arrived are carried out."""
        journal = self._driver.engine.book.journal
        if journal is not None and journal.unsettled:
            now = time.monotonic()
            self._since = min(self._since, now)
            if (len(self._inbox) or self._present or self._ready) and now - self._since < GROUP_COMMIT_S:
                return
            try:
                journal.settle()
            except FileError as error:
                lost = results.Message(f"{error}; what was done last is not on the disk", results.Tone.ERROR)
                tickets = dict.fromkeys(ticket for ticket, _ in self._answers if ticket is not None)
                self._answers = [*((ticket, partial(ticket.say, lost)) for ticket in tickets), *self._answers]
        answers, self._answers, self._since = self._answers, [], inf
        for _, give in answers:
            give()
        self._driver.engine.events.release()

    # --- messages ---

    def _take(self) -> bool:
        """Carry out all calls that are queued in the inbox. Return whether there were any."""
        if not self._inbox and not self._closed:
            return False
        acts = self._inbox.take_all()
        for act in acts:
            act()
        if self._closed:
            self._end_all()
        return bool(acts)

    def _overtake(self, ticket: Ticket[Any]) -> None:
        """Begin an urgent request at once, and refuse all requests that have not begun."""
        for waiting in self._waiting.all():
            self._end(waiting, RequestRefused("the robot was stopped before it began", "give it again"))
        self._move(self._present, ticket)

    def _react(self, ticket: Ticket[Any], reaction: Reaction, question: int) -> None:
        """Let a request continue with the answer to the question with the id `question`. Id 0: with an error that
        occurred while a reply was shown. An answer to an earlier question is ignored."""
        asks = ticket.place is self._asking
        if ticket.place is None or (question and not (asks and question == ticket.asked)):
            return
        ticket.reaction = reaction
        if asks:
            self._move(self._present, ticket)

    def _end_work(self, ticket: Ticket[Any]) -> None:
        if ticket.place is self._working:
            self._move(self._present, ticket)

    def _withdraw(self, ticket: Ticket[Any]) -> None:
        if ticket.place is not None:
            self._end(ticket, RequestRefused("it was withdrawn"))

    def _end_all(self) -> None:
        """End all requests early, and refuse new ones from now on."""
        self._closed = True
        for ticket in (*self._waiting.all(), *self._present, *self._running, *self._asking, *self._working):
            self._end(ticket, RequestRefused("the robot is not driven any more"))

    def _end(self, ticket: Ticket[Any], why: VrsError) -> None:
        """End a request early with the error `why`. Its dialogue is closed, and can clean up."""
        self._move(None, ticket)
        try:
            ticket.dialogue.close()
        except Exception as error:
            ticket.end(None, error)
        else:
            ticket.end(None, why)
