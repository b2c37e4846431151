"""Whatever a client behind a line claims, nothing before the robot's clock at arrival changes."""

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
from vrs_cli.errors import TooLate, VrsError
from vrs_cli.interfaces.session.session import Session
from vrs_cli.interfaces.tasks.holder_times import HolderTimes
from vrs_cli.net.delay_line import DelayLine, Gamma
from vrs_cli.trajectory.instant import TICK, on_grid
from vrs_cli.values.commands import JointTarget, Move, SetParameter, Stamp

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
