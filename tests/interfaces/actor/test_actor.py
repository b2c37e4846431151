"""One thing at a time, in the order in which it was asked for; what stops the robot comes first."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from math import inf
from threading import Event, Thread

import pytest

from tests.engine.paper import Paper
from tests.engine.wall import ManualWall
from tests.interfaces.terminals import RecordingTerminal
from tests.live import PATIENCE
from vrs_cli.engine.clock import WallClock
from vrs_cli.errors import FileError, MotionError, RequestRefused, UsageError
from vrs_cli.interfaces.actor import actor as module
from vrs_cli.interfaces.actor.actor import Actor
from vrs_cli.interfaces.dialogue import Dialogue, Slice, Ticket, beside
from vrs_cli.interfaces.session.acts import act_on
from vrs_cli.interfaces.session.session import Session
from vrs_cli.values.acts import FollowChunk
from vrs_cli.values.questions import Answer, Confirmation
from vrs_cli.values.replies import Reply
from vrs_cli.values.results import Message

SWING = ".PROGRAM swing\nDO\nDRIVE 1, 5\nDRIVE 1, -5\nUNTIL FALSE\n.END"


@pytest.fixture
def actor(session: Session) -> Actor:
    return session.actor


def stepped(actor: Actor) -> None:
    while actor.peek() < inf:
        actor.step()


def noting(done: list[str], name: str, parts: int = 1) -> Dialogue[str]:
    for part in range(parts):
        done.append(f"{name}{part}")
        yield Slice.MORE
    return name


def test_requests_are_carried_out_in_the_order_of_their_arrival(actor: Actor) -> None:
    done: list[str] = []
    tickets = [actor.submit(noting(done, name, 2)) for name in "abc"]
    stepped(actor)
    assert done == ["a0", "a1", "b0", "b1", "c0", "c1"]
    assert [ticket.result() for ticket in tickets] == ["a", "b", "c"]


def test_who_asks_for_much_does_not_keep_others_waiting(actor: Actor) -> None:
    done: list[str] = []
    for number in range(4):
        actor.submit(noting(done, f"a{number}."), by="ada")
    withdrawn = actor.submit(noting(done, "gone"), by="bob")
    for number in range(2):
        actor.submit(noting(done, f"b{number}."), by="bob")
    actor.submit(noting(done, "c0."), by="carl")
    withdrawn.withdraw()
    stepped(actor)
    assert sorted(done[:3]) == ["a0.0", "b0.0", "c0.0"]
    assert sorted(done[3:5]) == ["a1.0", "b1.0"]
    assert done[5:] == ["a2.0", "a3.0"]
    with pytest.raises(RequestRefused, match="withdrawn"):
        withdrawn.result()


def test_what_is_done_costs_who_asks_for_it(served: Session) -> None:
    spent: dict[object, float] = {}
    served.actor.spent = lambda by, _ticket, seconds: spent.update({by: spent.get(by, 0.0) + seconds})

    def busy() -> float:
        until = time.thread_time() + 0.02
        while time.thread_time() < until:
            pass
        return until

    def dialogue() -> Dialogue[float]:
        yield Slice.MORE
        return busy()

    served.actor.submit(dialogue(), by="ada").result()
    served.actor.submit(beside(busy), by="bob").result()
    served.actor.call(lambda: None).result()
    assert spent["ada"] >= 0.02
    assert spent["bob"] >= 0.02


def test_nothing_is_due_before_somebody_asks(actor: Actor) -> None:
    assert actor.peek() == inf
    actor.call(lambda: None)
    assert actor.peek() == 0.0
    actor.step()
    assert actor.peek() == inf


def test_what_goes_wrong_is_raised_where_the_result_is_wanted_and_nowhere_else(actor: Actor) -> None:
    broken, whole = actor.call(lambda: 1 // 0), actor.call(lambda: 7)
    stepped(actor)
    assert whole.result() == 7
    with pytest.raises(ZeroDivisionError):
        broken.result()


def test_what_is_urgent_comes_between_the_parts_of_others_and_those_not_begun_are_refused(actor: Actor) -> None:
    done: list[str] = []
    first, second = actor.submit(noting(done, "a", 3)), actor.submit(noting(done, "b"))
    actor.step()
    actor.submit(noting(done, "stop"), urgent=True)
    later = actor.submit(noting(done, "c"))
    stepped(actor)
    assert done == ["a0", "stop0", "a1", "a2", "c0"]
    assert (first.result(), later.result()) == ("a", "c")
    with pytest.raises(RequestRefused, match="stopped before it began"):
        second.result()


def sure() -> Dialogue[Answer]:
    answer = yield Confirmation("Sure (Y/N)?")
    yield Message(str(answer))
    return answer


def test_who_waits_for_an_answer_lets_others_go_first(actor: Actor) -> None:
    asking, other = actor.submit(sure()), actor.call(lambda: 7)
    stepped(actor)
    assert (asking.done(), other.result()) == (False, 7)
    assert asking.take_said() == [Confirmation("Sure (Y/N)?", id=1)]
    asking.answer(1, True)
    stepped(actor)
    assert (asking.result(), asking.take_said()) == (True, [Message("True")])
    asking.answer(1, False)  # too late: nobody asks
    stepped(actor)


def test_a_late_answer_is_not_taken_for_that_to_another_question(actor: Actor) -> None:
    def twice() -> Dialogue[tuple[Answer, Answer]]:
        return (yield Confirmation("Sure (Y/N)?")), (yield Confirmation("Quite sure (Y/N)?"))

    asking = actor.submit(twice())
    stepped(actor)
    (first,) = [said.id for said in asking.take_said() if isinstance(said, Confirmation)]
    asking.answer(first, True)
    asking.answer(first, True)
    asking.throw(KeyboardInterrupt(), first)
    stepped(actor)
    (second,) = [said.id for said in asking.take_said() if isinstance(said, Confirmation)]
    assert (asking.done(), first != second) == (False, True)
    asking.answer(second, False)
    stepped(actor)
    assert asking.result() == (True, False)


class Gone(RecordingTerminal):
    """Whoever read the answers does so no more."""

    def show(self, reply: Reply) -> None:  # noqa: ARG002 (as terminals have it)
        raise BrokenPipeError


def test_what_could_not_be_shown_is_raised_in_the_request(actor: Actor) -> None:
    left: list[str] = []

    def dialogue() -> Dialogue[None]:
        try:
            yield Message("one")
            yield Message("two")
        finally:
            left.append("in order")

    with pytest.raises(BrokenPipeError):
        actor.finish(actor.submit(dialogue()), Gone())
    assert left == ["in order"]
    assert actor.peek() == inf


def test_a_request_that_is_withdrawn_leaves_all_in_order(actor: Actor) -> None:
    left: list[str] = []

    def dialogue() -> Dialogue[None]:
        try:
            yield Confirmation("?")
        finally:
            left.append("in order")

    asking, waiting = actor.submit(dialogue()), actor.submit(noting(left, "never"))
    actor.step()
    for ticket in (asking, waiting):
        ticket.withdraw()
    stepped(actor)
    assert left == ["in order"]
    for ticket in (asking, waiting):
        with pytest.raises(RequestRefused):
            ticket.result()


# --- programs -----------------------------------------------------------------------------------------------------


def test_lines_of_others_are_carried_out_while_a_program_runs(session: Session) -> None:
    session.load_text(SWING)
    actor = session.actor
    run = actor.submit(session.answers("EXECUTE swing"))
    for _ in range(50):
        actor.step()
    assert session.engine.now > 0.0
    where, motion = actor.submit(session.answers("WHERE")), actor.submit(session.answers("DRIVE 1, 5"))
    stop = actor.submit(session.answers("ABORT"), urgent=True)
    stepped(actor)
    assert stop.error(0.0) is None
    assert session.engine.now == session.engine.end
    assert [str(reply) for reply in run.take_said()][-1].count("(ABORTED)")
    for refused in (where, motion):
        assert isinstance(refused.error(0.0), RequestRefused)
    again = actor.submit(session.answers("WHERE"))
    stepped(actor)
    assert again.error(0.0) is None


def test_abort_comes_between_the_parts_of_a_chunk(session: Session) -> None:
    actor, joints = session.actor, session.engine.position().joints
    times = tuple(0.05 * k for k in range(1, 200))
    rows = tuple((joints[0] + 0.002 * k, *joints[1:]) for k in range(1, 200))
    chunk = actor.submit(act_on(session, FollowChunk(times, rows)))
    for _ in range(3):
        actor.step()
    assert 1 < len(session.engine.book.deltas) < 5  # the first parts are planned
    stop = actor.submit(session.answers("ABORT"), urgent=True)
    actor.step()
    assert session.engine.end < 1.0
    stepped(actor)
    assert stop.error(0.0) is None
    assert isinstance(chunk.error(0.0), MotionError)
    assert session.engine.end < 1.0


def test_a_motion_while_a_program_runs_is_refused_and_a_look_is_not(session: Session) -> None:
    session.load_text(SWING)
    actor = session.actor
    run = actor.submit(session.answers("EXECUTE swing"))
    actor.step()
    motion, where = actor.submit(session.answers("DRIVE 1, 5")), actor.submit(session.answers("WHERE"))
    for _ in range(20):
        actor.step()
    assert isinstance(motion.error(0.0), UsageError)
    assert len(where.take_said()) == 1
    run.withdraw()
    stepped(actor)
    assert session.engine.now <= session.engine.end


def test_a_line_of_the_prompt_is_over_before_the_next_one_begins(session: Session) -> None:
    actor = session.actor
    tickets = [actor.submit(session.answers(f"DRIVE {joint}, 5")) for joint in (1, 2, 3)]
    stepped(actor)
    assert [ticket.error(0.0) for ticket in tickets] == [None] * 3
    assert [record.text for record in session.engine.book.records()] == ["DRIVE 1, 5", "DRIVE 2, 5", "DRIVE 3, 5"]


def test_time_goes_on_in_real_time_though_nobody_asks(terminal: RecordingTerminal) -> None:
    wall = ManualWall()
    session = Session(terminal, clock=wall.clock())
    session.load_text('.PROGRAM tell\nTIMER 1 = 0\nWAIT TIMER(1) > 2\nTYPE "now"\n.END')
    session.perform("PCEXECUTE tell")
    actor, due = session.actor, session.actor.peek()
    assert session.engine.now <= due <= 2.0
    while terminal.typed == "":
        actor.step()
    assert wall.seconds == pytest.approx(1002.0, abs=0.1)


@pytest.mark.parametrize("stopped", [False, True])
def test_a_program_that_nobody_waits_for_stands_with_the_clock(terminal: RecordingTerminal, *, stopped: bool) -> None:
    """None of its steps is left out, and who stops it then need not wait for the arm."""
    session = Session(terminal, clock=ManualWall().clock())
    session.load_text(".PROGRAM swing\nDRIVE 1, 20\nBREAK\nDRIVE 1, -20\nBREAK\n.END")
    actor = session.actor

    def do(line: str) -> None:
        ticket = actor.submit(session.answers(line))
        while not ticket.done():
            actor.step()

    def moved() -> int:
        return sum(record.text.startswith("DRIVE") for record in session.engine.book.records())

    session.let_run(session.begin("swing"), lambda _result: None)
    watch = actor.submit(session.watch_over())
    while session.engine.now < 0.1:
        actor.step()
    do("CLOCK PAUSE")
    stepped(actor)
    assert (session.running, moved()) == (True, 1)
    if stopped:
        do("ABORT")
        stepped(actor)
        assert (watch.done(), session.running, moved()) == (True, False, 1)
    else:
        do("CLOCK GO")
        while not watch.done():
            actor.step()
        assert moved() == 2


# --- one thread -----------------------------------------------------------------------------------------------------


@pytest.fixture
def served(session: Session) -> Iterator[Session]:
    session.actor.serve()
    yield session
    session.actor.close()


def test_a_robot_that_is_served_answers_every_thread(served: Session) -> None:
    found: list[int] = []

    def ask() -> None:
        tickets = [served.actor.submit(served.answers("DRIVE 1, 1")) for _ in range(5)]
        for ticket in tickets:
            ticket.result(PATIENCE)
            found.append(len(ticket.take_said()))
        served.actor.call(lambda: served.engine.timeline.version).result(PATIENCE)

    threads = [Thread(target=ask) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(PATIENCE)
    assert len(found) == 20
    assert served.engine.timeline.version == served.engine.book.history.commands == 20


def test_one_thread_drives_at_a_time(session: Session) -> None:
    inside, go_on = Event(), Event()

    def hold() -> None:
        inside.set()
        go_on.wait(PATIENCE)

    ticket = session.actor.call(hold)
    driving = Thread(target=session.actor.step)
    driving.start()
    inside.wait(PATIENCE)
    with pytest.raises(RuntimeError, match="another thread"):
        session.actor.step()
    go_on.set()
    driving.join(PATIENCE)
    assert ticket.done()


def test_long_work_on_what_does_not_change_holds_nobody(served: Session) -> None:
    go_on = Event()
    long = served.actor.submit(beside(lambda: go_on.wait(PATIENCE)))
    broken = served.actor.submit(beside(lambda: 1 // 0))
    assert served.actor.call(lambda: 7).result(PATIENCE) == 7
    assert isinstance(broken.error(60.0), ZeroDivisionError)
    assert not long.done()
    go_on.set()
    assert long.result(PATIENCE) is True


def test_what_has_not_ended_when_a_robot_is_closed_is_refused(session: Session) -> None:
    session.actor.serve()
    asked = threading.Event()
    asking = session.actor.submit(sure(), outlet=lambda _ticket, _said: asked.set())
    assert asked.wait(PATIENCE)
    session.actor.close()
    for ticket in (asking, session.actor.call(lambda: 7)):
        with pytest.raises(RequestRefused, match="not driven any more"):
            ticket.result(0.0)


def test_a_line_ends_the_wait_for_the_time(terminal: RecordingTerminal) -> None:
    clock = WallClock(time.monotonic, time.sleep)
    session = Session(terminal, clock=clock)
    ticket = session.actor.call(lambda: 7)
    before = time.monotonic()
    clock.sleep(1000.0)
    assert time.monotonic() - before < 500.0
    session.actor.step()
    assert ticket.result(0.0) == 7


# --- the order of a change ------------------------------------------------------------------------------------------


def when_it_ends(ticket: Ticket[None], act: Callable[[], None]) -> None:
    end = ticket.end

    def ended(result: None, error: BaseException | None = None) -> None:
        end(result, error)
        act()

    ticket.end = ended  # type: ignore[method-assign]


def test_who_commanded_a_change_is_answered_before_others_hear_of_it(session: Session) -> None:
    order: list[str] = []
    events = session.engine.events.subscribe()
    events.take_all()
    ticket = session.actor.call(drive(session))
    when_it_ends(ticket, lambda: order.append(f"answered, {len(events.take_all())} heard"))
    stepped(session.actor)
    assert (order, len(events.take_all())) == (["answered, 0 heard"], 1)


class Slow(Paper):
    """What is written goes to the disk when it is settled; `broken`: that fails."""

    settled = 0
    broken = False

    def record(self, *given: object, **named: object) -> None:
        super().record(*given, **named)  # type: ignore[arg-type]
        self.unsettled = True

    def settle(self) -> None:
        if self.broken:
            raise FileError("the disk is broken")
        self.settled, self.unsettled = self.settled + 1, False


def test_changes_that_go_to_the_disk_together_are_answered_together(
    session: Session, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "GROUP_COMMIT_S", inf)  # however slow this computer is
    journal = session.engine.book.journal = Slow(session.engine.book)
    events = session.engine.events.subscribe()
    answered: list[int] = []
    for _ in range(5):
        ticket = session.actor.call(drive(session))
        when_it_ends(ticket, lambda: answered.append(journal.settled))
    stepped(session.actor)
    assert (journal.settled, answered, len(events.take_all())) == (1, [1] * 5, 6)


def test_who_is_answered_knows_what_the_disk_has_not_kept(session: Session) -> None:
    journal = session.engine.book.journal = Slow(session.engine.book)
    journal.broken = True
    ticket = session.actor.call(drive(session))
    stepped(session.actor)
    assert ["not on the disk" in str(said) for said in ticket.take_said()] == [True]
    assert ticket.done()


def drive(session: Session) -> Callable[[], None]:
    joints = session.engine.model.poses["ready"]
    return lambda: session.engine.redirect((joints[0] + 0.1, *joints[1:]))


def test_time_waits_for_who_hears_of_it_and_others_do_not(session: Session) -> None:
    session.load_text(SWING)
    actor, heard = session.actor, Event()
    session.driver.lags = lambda: not heard.is_set()
    running = actor.submit(session.answers("EXECUTE swing"))
    for _ in range(10):
        actor.step()
    assert session.engine.now == 0.0
    looking = actor.call(lambda: session.engine.now)
    for _ in range(2):
        actor.step()
    assert looking.result(0.0) == 0.0
    heard.set()
    for _ in range(10):
        actor.step()
    assert session.engine.now > 0.0
    heard.clear()
    stop = actor.call(session.stop, urgent=True)
    stepped(actor)
    stop.result(0.0)
    assert running.done()


def test_ctrl_c_ends_a_run_whose_time_waits_for_somebody(session: Session) -> None:
    session.load_text(SWING)
    actor = session.actor
    session.driver.lags = lambda: True
    running = actor.submit(session.answers("EXECUTE swing"))
    for _ in range(4):
        actor.step()
    session.driver.interrupt()
    stepped(actor)
    assert running.done()
    assert not session.running
