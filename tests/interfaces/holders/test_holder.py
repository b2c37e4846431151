"""Each holder has a desk of its own at one robot."""

from __future__ import annotations

import pytest

from tests.interfaces.actor.test_actor import SWING, stepped
from tests.interfaces.holders.holder import Holder
from vrs_cli.errors import RequestRefused, VrsError
from vrs_cli.interfaces.dialogue import Ticket
from vrs_cli.interfaces.session.acts import act_on
from vrs_cli.interfaces.session.session import Session
from vrs_cli.interfaces.users import RobotLease
from vrs_cli.language.words.word import Role
from vrs_cli.values.acts import Go, Goal, ListCommands
from vrs_cli.values.commands import JointTarget
from vrs_cli.values.questions import LineWanted


def done(session: Session, holder: Holder, line: str) -> list[str]:
    ticket = holder.ask(line)
    stepped(session.actor)
    assert ticket.error(0.0) is None
    return [str(said) for said in ticket.take_said()]


def test_an_editor_is_open_at_one_user_state(session: Session) -> None:
    a, b = Holder(session), Holder(session)
    done(session, a, "EDIT mine")
    done(session, b, "x = 7")
    done(session, a, "TYPE 1")
    done(session, a, "ABORT")  # a step of the program
    done(session, a, "E")
    assert [step.statement.word for step in session.programs["mine"].program.steps] == ["TYPE", "ABORT"]  # type: ignore[union-attr]
    assert session.user_state.editor is None


def test_a_bare_do_repeats_what_its_holder_did(session: Session) -> None:
    a, b = Holder(session), Holder(session)
    done(session, a, "DO DRIVE 1, 1")
    done(session, b, "DO DRIVE 2, 1")
    done(session, a, "DO")
    assert [record.text for record in session.engine.book.records()][-1] == "DRIVE 1, 1"


def test_abort_of_one_ends_what_others_have_begun_and_refuses_what_waits(session: Session) -> None:
    session.load_text(SWING)
    a, b, c = Holder(session), Holder(session), Holder(session)
    line = a.ask("CALL swing")
    for _ in range(30):
        session.actor.step()
    waits = b.ask("DRIVE 1, 5")
    stop = c.ask("abo")
    stepped(session.actor)
    assert stop.error(0.0) is None
    for ticket in (line, waits):
        with pytest.raises(RequestRefused):
            ticket.result(0.0)
    assert session.engine.now == session.engine.end


def test_the_emergency_stop_ends_every_task(session: Session) -> None:
    session.load_text(SWING)
    a, b = Holder(session), Holder(session)
    done(session, a, "PCEXECUTE swing")
    run = a.ask("EXECUTE swing")
    for _ in range(30):
        session.actor.step()
    ticket = b.stop()
    stepped(session.actor)
    assert ticket.error(0.0) is None
    assert (list(session.tasks.running), run.done()) == ([], True)


def test_what_a_holder_has_asked_for_is_left_when_it_leaves(session: Session) -> None:
    session.load_text(SWING)
    a, b = Holder(session), Holder(session)
    run, later = a.ask("EXECUTE swing"), a.ask("DRIVE 1, 5")
    for _ in range(30):
        session.actor.step()
    a.leave()
    done(session, b, "WHERE")
    assert isinstance(run.error(0.0), VrsError)
    assert later.done()
    assert session.engine.now <= session.engine.end


def test_readers_never_wait(session: Session) -> None:
    a = Holder(session)
    a.ask("DRIVE 1, 5")
    before = a.timeline
    assert (a.now, before.version) == (0.0, 0)
    stepped(session.actor)
    assert (a.timeline.version, before.version, a.now) == (1, 0, a.timeline.end)
    assert a.arm is session.engine.arm


def test_each_holder_is_on_the_branch_that_it_tries(session: Session) -> None:
    a, b = Holder(session), Holder(session)
    done(session, a, "BRANCH trial")
    done(session, a, "DRIVE 1, 5")
    done(session, b, "DRIVE 2, 5")
    done(session, a, "DRIVE 3, 5")
    assert [record.text for record in session.engine.book.records()] == ["DRIVE 1, 5", "DRIVE 3, 5"]
    done(session, b, "WHERE")
    assert [record.text for record in session.engine.book.records()] == ["DRIVE 2, 5"]
    a.leave()
    stepped(session.actor)
    assert done(session, b, "BRANCH trial")
    assert [record.text for record in session.engine.book.records()] == ["DRIVE 2, 5"]


def test_who_stops_the_robot_stops_it_where_it_is(session: Session) -> None:
    session.load_text(SWING)
    a, b = Holder(session), Holder(session)
    done(session, a, "BRANCH trial")
    run = a.ask("EXECUTE swing")
    for _ in range(30):
        session.actor.step()
    done(session, b, "ABORT")
    assert run.done()
    done(session, b, "WHERE")
    assert session.engine.timeline.version == 0


ASKS = '.PROGRAM asks\nTIMER 1 = 0\nWAIT TIMER(1) > 1\nPROMPT "How many? ", n\n.END\n'


def test_what_a_program_asks_is_asked_of_who_drives_it(session: Session) -> None:
    session.load_text(ASKS)
    a, b = Holder(session), Holder(session)
    done(session, a, "EXECUTE 3 asks")
    assert done(session, b, "DRIVE 1, 90, 10") == []
    ticket = a.ask("x = 2")
    stepped(session.actor)
    heard = [said for said in ticket.take_said() if isinstance(said, LineWanted)]
    assert [question.text for question in heard] == ["How many? "]
    ticket.answer(heard[0].id, "5")
    stepped(session.actor)
    assert ticket.error(0.0) is None
    assert session.environment.value(("n", None)) == 5.0


def test_whoever_comes_next_is_asked_where_the_driver_has_gone(session: Session) -> None:
    session.load_text(ASKS)
    a, b = Holder(session), Holder(session)
    done(session, a, "EXECUTE 3 asks")
    a.leave()
    ticket = b.ask("DRIVE 1, 90, 10")
    stepped(session.actor)
    assert [said.text for said in ticket.take_said() if isinstance(said, LineWanted)] == ["How many? "]


def refusal(session: Session, ticket: Ticket[None]) -> str:
    stepped(session.actor)
    return str(ticket.error(0.0))


def test_without_a_lease_all_drive(session: Session) -> None:
    for name in ("ann", ""):
        assert done(session, Holder(session, name=name), "DRIVE 1, 5") == []


LEASED = "*Lease is not yours* ann drives (ask for the lease; in the shell: /ask)"
UP = Go(Goal.of(JointTarget((0.0, -1.0, 1.0, 0.0, 1.0, 0.0))))


@pytest.mark.parametrize(
    "line", ["DRIVE 1, 5", "DO DRIVE 1, 5", "EXECUTE swing", "UNDO", "x = 3", "SPEED 50", "DELETEP swing"]
)
def test_who_does_not_drive_is_told_who_does(session: Session, line: str) -> None:
    session.load_text(SWING)
    session.lease = RobotLease().acquire("ann", 0.0)[0]
    bob = Holder(session, name="bob")
    assert refusal(session, bob.ask(line)) == LEASED
    assert refusal(session, Holder(session, Role.DESIGNER, "bob").submit(act_on(session, UP))) == LEASED
    assert (session.engine.timeline.version, session.environment.value(("x", None))) == (0, None)


def test_who_does_not_drive_looks_and_stops(session: Session) -> None:
    session.load_text(SWING)
    session.lease = RobotLease().acquire("ann", 0.0)[0]
    ann, bob = Holder(session, name="ann"), Holder(session, name="bob")
    run, where = ann.ask("EXECUTE swing"), bob.ask("WHERE")
    for _ in range(30):
        session.actor.step()
    assert where.error(0.0) is None
    done(session, bob, "ABORT")
    assert run.done()


def test_the_lease_counts_when_the_line_begins(session: Session) -> None:
    lease, _ = RobotLease().acquire("ann", 0.0)
    session.lease = lease
    ann, bob = Holder(session, name="ann"), Holder(session, name="bob")
    before = ann.ask("DRIVE 1, 5")
    stepped(session.actor)
    after, his = ann.ask("DRIVE 1, 5"), bob.ask("DRIVE 2, 5")
    session.lease = lease.give("ann", "bob", 1.0)[0]
    stepped(session.actor)
    assert (before.error(0.0), his.error(0.0)) == (None, None)
    assert "bob drives" in str(after.error(0.0))


def test_what_a_program_asks_is_asked_of_who_has_the_lease(session: Session) -> None:
    session.load_text(ASKS)
    lease, _ = RobotLease().acquire("ann", 0.0)
    session.lease = lease
    ann, bob = Holder(session, name="ann"), Holder(session, name="bob")
    done(session, ann, "EXECUTE 3 asks")
    session.lease = lease.give("ann", "bob", 1.0)[0]
    ticket = bob.ask("DRIVE 1, 90, 10")
    stepped(session.actor)
    assert [said.text for said in ticket.take_said() if isinstance(said, LineWanted)] == ["How many? "]


def test_an_observer_commands_no_motion(session: Session) -> None:
    ticket = Holder(session, Role.OBSERVER).submit(act_on(session, UP))
    assert refusal(session, ticket) == "*Not in your role* MOVE is for a designer (you are an observer)"


def test_who_looks_sees_his_own_branch_while_a_program_runs_on_another(session: Session) -> None:
    session.load_text(SWING)
    a, b = Holder(session), Holder(session)
    done(session, b, "DRIVE 2, 30")
    done(session, a, "BRANCH trial")
    before, where = b.timeline, done(session, b, "WHERE")
    run = a.ask("EXECUTE swing")
    for _ in range(30):
        session.actor.step()
    tickets = [b.ask(line) for line in ("WHERE", "TIMELINE", "DRIVE 1, 5", "EXECUTE swing", "x = 3", "SIGNAL 1")]
    replies = b.submit(act_on(session, ListCommands()))
    while not (tickets[-1].done() and replies.done()):
        session.actor.step()
    assert list(map(str, tickets[0].take_said())) == where
    errors = [str(ticket.error(0.0)) for ticket in tickets]
    assert errors[2].endswith("DRIVE has to wait until the program stops (ABORT stops it)")
    assert errors[3].endswith("EXECUTE has to wait until the program on another branch stops (ABORT stops it)")
    assert [errors[0], errors[1], errors[4], errors[5]] == ["None"] * 4
    assert [record.text for record in replies.result(0.0).commands] == ["DRIVE 2, 30"]
    assert b.timeline is before
    assert len(a.timeline) > len(before)
    assert (run.done(), session.environment.value(("x", None))) == (False, 3.0)
    done(session, b, "ABORT")
    assert (run.done(), b.timeline is before) == (True, True)


def test_who_leaves_is_forgotten_though_a_program_runs_on_another_branch(session: Session) -> None:
    session.load_text(SWING)
    a, b = Holder(session), Holder(session)
    done(session, a, "BRANCH trial")
    a.ask("BRANCH main")
    b.ask("EXECUTE swing")
    a.ask("BRANCH trial")
    for _ in range(30):
        session.actor.step()
    a.leave()
    for _ in range(5):
        session.actor.step()
    assert session.branches.seen_by(a.user_state)[0] is session.engine.timeline
