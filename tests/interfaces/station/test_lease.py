from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from vrs_cli.errors import LeaseHeld
from vrs_cli.interfaces.station.lease import Granted, Lost, Notice, Requested, RobotLease

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
