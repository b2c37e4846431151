"""Roles and lines beside a program, the lease, and the times of a user in those of the robot."""

from __future__ import annotations

from contextlib import suppress
from math import inf, nan

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.engine.wall import ManualWall
from tests.examples import examples
from tests.interfaces.terminals import RecordingTerminal
from tests.laws.test_motion_laws import MODEL, joint_targets
from vrs_cli.engine.engine import Engine
from vrs_cli.engine.position import position_at
from vrs_cli.errors import LeaseHeld, RoleWanted, TooLate, VrsError
from vrs_cli.interfaces.session.session import Session
from vrs_cli.interfaces.users import Granted, HolderTimes, Lost, Notice, Requested, RobotLease, check_may, need_of
from vrs_cli.language.text.ast import ProgramHeader
from vrs_cli.language.text.parser import parse_prompt
from vrs_cli.language.words.instructions import INSTRUCTIONS
from vrs_cli.language.words.monitor import COMMANDS
from vrs_cli.language.words.word import Role, Route
from vrs_cli.net.delay_line import DelayLine, Gamma
from vrs_cli.trajectory.instant import TICK, on_grid
from vrs_cli.values.commands import JointTarget, Move, SetParameter, Stamp


def check(line: str, role: Role) -> None:
    statement = parse_prompt(line, frozenset())
    assert statement is not None
    assert not isinstance(statement, ProgramHeader)
    check_may(*need_of(statement), role)


@pytest.mark.parametrize("line", ["WHERE", "WHERE AT 3", "LISTL", "HELP", "TYPE 1", "1 + 2", "DO TYPE 1", "PLOT"])
def test_an_observer_sees(line: str) -> None:
    check(line, Role.OBSERVER)


@pytest.mark.parametrize(
    ("line", "word", "role"),
    [
        ("MOVE part", "MOVE", "a designer"),
        ("DO MOVE part", "MOVE", "a designer"),
        ("ABORT", "ABORT", "a designer"),
        ("SPEED 50", "SPEED", "a designer"),
        ("ENABLE CP", "ENABLE", "a supervisor"),
        ("EXECUTE pick", "EXECUTE", "a supervisor"),
        ("x = 3", "a change of a variable", "a supervisor"),
    ],
)
def test_an_observer_is_refused_by_name(line: str, word: str, role: str) -> None:
    with pytest.raises(RoleWanted, match=rf"\*Not in your role\* {word}.* is for {role} \(you are an observer\)"):
        check(line, Role.OBSERVER)


def test_a_designer_moves_and_does_not_see() -> None:
    for line in ("MOVES part AT 2", "READY", "OPENI", "JOG Z, 10", "DELAY 1", "ABORT", "SPEED 50", "DO SPEED 30"):
        check(line, Role.DESIGNER)
    with pytest.raises(RoleWanted, match="WHERE is for an observer"):
        check("WHERE", Role.DESIGNER)


def test_a_supervisor_does_all_of_it() -> None:
    assert Role.OBSERVER in Role.SUPERVISOR
    assert Role.DESIGNER in Role.SUPERVISOR
    assert (Role.OBSERVER | Role.DESIGNER) != Role.SUPERVISOR
    for line in ("WHERE", "MOVE part", "ABORT"):
        check(line, Role.SUPERVISOR)


def test_a_session_refuses_what_is_not_for_the_role() -> None:
    session = Session(RecordingTerminal())
    session.user_state.role = Role.OBSERVER
    session.perform("WHERE")
    with pytest.raises(RoleWanted, match="READY is for a designer"):
        session.perform("READY")
    session.user_state.role = Role.DESIGNER
    session.perform("READY")
    with pytest.raises(RoleWanted, match="EXECUTE is for a supervisor"):
        session.perform("EXECUTE pick")


def test_every_motion_is_a_designers() -> None:
    for row in INSTRUCTIONS.values():
        assert (row.route is not Route.MOTION) or row.role is Role.DESIGNER
    assert COMMANDS["UNDO"].role is Role.SUPERVISOR


ANN = RobotLease().acquire("ann", 0.0)[0]  # until 10 s


def test_who_comes_first_drives() -> None:
    lease, told = RobotLease().acquire("ann", 0.0)
    assert told == (Granted("ann"),)
    assert lease.drives("ann")
    assert not lease.drives("bob")


def test_another_is_refused_while_it_lasts() -> None:
    with pytest.raises(LeaseHeld, match=r"ann drives .*it ends in 4.0 s without a heartbeat"):
        ANN.acquire("bob", 6.0)
    with pytest.raises(LeaseHeld, match="ann drives"):
        ANN.check("bob")


def test_it_is_taken_after_its_time_and_the_former_holder_is_told() -> None:
    lease, told = ANN.acquire("bob", 10.001)
    assert told == (Lost("ann", "bob"), Granted("bob"))
    with pytest.raises(LeaseHeld, match="bob drives"):
        lease.beat("ann", 10.5)


def test_a_heartbeat_keeps_it() -> None:
    assert not ANN.beat("ann", 9.0).is_free(19.0)
    assert ANN.beat("ann", 9.0).is_free(19.001)


def test_who_is_late_keeps_it_until_another_comes() -> None:
    assert ANN.beat("ann", 100.0).drives("ann")


def test_the_holder_is_asked_once_and_gives() -> None:
    lease, told = ANN.ask("bob", 1.0)
    assert told == (Requested("ann", "bob"),)
    assert lease.ask("bob", 2.0) == (lease, ())
    lease, told = lease.give("ann", "bob", 3.0)
    assert told == (Granted("bob"),)
    assert (lease.holder, lease.asking, lease.until) == ("bob", (), 13.0)


def test_only_the_holder_gives() -> None:
    with pytest.raises(LeaseHeld, match="ann drives"):
        ANN.give("bob", "bob", 1.0)
    with pytest.raises(LeaseHeld, match="nobody drives"):
        RobotLease().give("bob", "bob", 1.0)


def test_who_asks_for_what_nobody_holds_drives() -> None:
    assert RobotLease().ask("bob", 0.0) == RobotLease().acquire("bob", 0.0)


def test_who_leaves_gives_to_who_asked_first() -> None:
    lease = ANN.ask("bob", 1.0)[0].ask("cleo", 2.0)[0]
    lease, told = lease.leave("bob", 3.0)
    assert (told, lease.asking) == ((), ("cleo",))
    lease, told = lease.leave("ann", 4.0)
    assert (told, lease.holder) == ((Granted("cleo"),), "cleo")
    lease, told = lease.leave("cleo", 5.0)
    assert (told, lease.holder) == ((), "")


WHO = st.sampled_from(("ann", "bob", "cleo"))
ACTS = st.lists(st.tuples(st.sampled_from(("acquire", "ask", "beat", "leave")), WHO, st.floats(0.0, 8.0)), max_size=30)


@given(ACTS)
def test_laws(acts: list[tuple[str, str, float]]) -> None:
    """One drives at a time; the lease changes hands only by giving or after its time, and who loses it is told."""
    lease, now = RobotLease(), 0.0
    for act, who, passed in acts:
        now += passed
        before, told = lease, tuple[Notice, ...]()
        try:
            done = getattr(lease, act)(who, now)
            lease, told = done if isinstance(done, tuple) else (done, ())
        except LeaseHeld:
            assert not before.drives(who)
        assert lease.holder not in lease.asking
        assert len(set(lease.asking)) == len(lease.asking)
        assert lease.until >= before.until or lease.holder != before.holder
        if lease.holder != before.holder:
            assert before.is_free(now) or (act, who) == ("leave", before.holder)
            assert (Granted(lease.holder) in told) == bool(lease.holder)
            assert (Lost(before.holder, lease.holder) in told) == bool(before.holder and act != "leave")


ALLOWED = 0.5
anything = st.floats() | st.floats(-2.0, 12.0)
commands = st.tuples(st.floats(0.0, 1.0), anything, st.floats(-1.0, 2.0), joint_targets)


def seen(engine: Engine, times: list[float]) -> list[str]:
    found = (position_at(engine.arm, engine.timeline, t) for t in times)
    return [repr((it.joints, it.velocity, it.acceleration, it.T_world_tool, it.hand, it.moving)) for it in found]


@examples(200)
@given(
    st.integers(),
    st.sampled_from(["ABORT", "POSTPONE"]),
    st.floats(0.0, 1.0),
    st.lists(commands, min_size=1, max_size=12),
)
def test_nothing_before_arrival_changes_whatever_is_claimed(
    seed: int, policy: str, allowed: float, sent: list[tuple[float, float, float, JointTarget]]
) -> None:
    """`sent`: how long after the one before, the claim of t_iss, the lead of t_exec, the target."""
    wall, line, times = ManualWall(0.0), DelayLine(Gamma(0.2, 0.08), str(seed)), HolderTimes(allowed=allowed)
    engine, t = Engine(MODEL, clock=wall.clock()), 0.0
    engine.perform(SetParameter("CAUSALITY", policy))
    for pause, claim, lead, target in sent:
        t += pause
        wall.seconds = line.arrival(t)
        engine.clock.advance(engine.clock.reached)
        arrival, count = engine.now, len(engine.book.deltas)
        past = [arrival - TICK, *(arrival * k / 7 for k in range(7))]
        before, issued = seen(engine, past), times.issue_time(claim, arrival)
        with suppress(VrsError):
            engine.begin(Move(target, False, stamp=Stamp(t + lead)), program=False, issued=issued)
        assert seen(engine, past) == before
        for delta in engine.book.deltas[count:]:
            assert delta.cut >= on_grid(arrival), "the robot's clock at arrival is t_c"
            assert on_grid(arrival - allowed) <= delta.issued <= delta.executed
            assert delta.issued <= on_grid(arrival)


@pytest.mark.parametrize(
    ("claim", "issued"),
    [(None, 10.0), (9.8, 9.8), (11.0, 10.0), (3.0, 9.5), (inf, 10.0), (-inf, 9.5), (nan, 10.0), (10.0, 10.0)],
)
def test_a_claim_is_kept_as_far_as_it_can_be_true(claim: float | None, issued: float) -> None:
    assert HolderTimes(allowed=ALLOWED).issue_time(claim, 10.0) == issued


def test_who_commands_with_the_delay_as_offset_is_never_late() -> None:
    """t_exec = t_iss on a clock that is D_f behind: it arrives just then."""
    wall, times = ManualWall(0.0), HolderTimes(offset=-0.25)
    engine = Engine(MODEL, clock=wall.clock())
    ready, t_iss = MODEL.poses["ready"], 2.0
    wall.seconds = t_iss + 0.25
    engine.clock.advance(engine.clock.reached)
    with pytest.raises(TooLate):
        engine.begin(Move(JointTarget(ready), False, stamp=Stamp(t_iss)), program=False)
    engine.begin(Move(JointTarget(ready), False, stamp=Stamp(times.robot_time(t_iss))), program=False)
    assert engine.book.deltas[0].executed == engine.now


def test_lines_of_a_user_state_are_issued_and_executed_by_its_times() -> None:
    """The first request of a line is issued when it was given, later ones when they come; AT is by the desk's clock."""
    wall = ManualWall(0.0)
    session = Session(RecordingTerminal(), MODEL, clock=wall.clock())
    user_state = session.user_state
    wall.seconds = 5.0
    user_state.times, user_state.issued = HolderTimes(offset=-0.25), 4.75
    session.perform("MOVE #PPOINT(10, -90, 90, 0, 0, 0) AT 4.75")
    wall.seconds = 6.0
    session.perform("MOVE #PPOINT(20, -90, 90, 0, 0, 0) IN 0.5")
    times = [(it.issued, it.executed) for it in session.engine.book.records()]
    assert times == [(4.75, 5.0), (6.0, 6.5)]
