"""Long replies: the parts of one, put together, are the reply; and each is short."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st
from msgspec.structs import replace

from vrs_cli.net.messages import Clock, Hello, Told, Welcome
from vrs_cli.net.parts import MOST_ROWS, is_long, joined, parts_of
from vrs_cli.net.protocol import ClientConnection
from vrs_cli.values.replies import FileText, RealTable, Reply, SegmentRow, TimelineTable
from vrs_cli.wire.codec import Encoding, encode

COUNTS = st.sampled_from([0, 1, MOST_ROWS - 1, MOST_ROWS, MOST_ROWS + 1, 3 * MOST_ROWS + 7])


def _timeline(segments: int, stops: int) -> TimelineTable:
    rows = tuple(SegmentRow(k, "MOVE a", 1.0 * k, 1.0 + k, "cruise", "joint") for k in range(max(segments, stops)))
    return TimelineTable((), rows[:segments], rows[:stops], 0.0)


REPLIES = st.one_of(
    st.builds(lambda n: FileText(tuple(map(str, range(n)))), COUNTS),
    st.builds(lambda n: RealTable(tuple((f"x[{k}]", float(k)) for k in range(n)), truths=True), COUNTS),
    st.builds(_timeline, COUNTS, COUNTS),
)


@given(REPLIES, st.none() | st.integers(0, 9))
def test_the_parts_of_a_reply_are_the_reply(reply: Reply, id: int | None) -> None:
    told = Told(reply, id)
    if not is_long(reply):
        return
    parts = list(parts_of(told))
    assert [part.goes_on for part in parts] == [True] * (len(parts) - 1) + [False]
    assert not any(is_long(part.reply) for part in parts)
    assert joined(parts) == told


def test_a_client_hears_the_whole_reply_once() -> None:
    told = Told(FileText(tuple(map(str, range(5 * MOST_ROWS)))), 3)
    client = ClientConnection(Hello((1,)))
    client.begin()
    welcome = Welcome(1, "key", "cell1", "life", "supervisor", "ada", Clock(0.0), {})
    client.receive(encode(welcome, Encoding.JSON))
    heard = []
    for seq, part in enumerate(parts_of(told), 1):
        heard += client.receive(encode(replace(part, seq=seq), Encoding.JSON))
    assert [replace(one, seq=0) for one in heard] == [told]
