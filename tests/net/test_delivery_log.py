"""Replies as users get them: the parts of a long one are the reply, and nobody is told where the files lie."""

from __future__ import annotations

from pathlib import Path

from hypothesis import given
from hypothesis import strategies as st
from msgspec.structs import replace

from tests.net.serving import serving
from vrs_cli.net.delivery_log import MAX_PART_ROWS, is_long, join_parts, may_hold, parts_of, prefixes_of, without
from vrs_cli.net.messages import Clock, Done, Get, Hello, Names, Put, Refused, Screen, Told, Welcome
from vrs_cli.net.protocol import ClientConnection
from vrs_cli.render.colours import Ink
from vrs_cli.render.text import styled_lines
from vrs_cli.values.replies import FileText, RealTable, Reply, SegmentRow, TimelineTable
from vrs_cli.values.results import Message
from vrs_cli.wire.codec import Encoding, encode

COUNTS = st.sampled_from([0, 1, MAX_PART_ROWS - 1, MAX_PART_ROWS, MAX_PART_ROWS + 1, 3 * MAX_PART_ROWS + 7])


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
    assert join_parts(parts) == told


@given(REPLIES, COUNTS)
def test_the_parts_of_a_reply_have_all_its_lines(reply: Reply, count: int) -> None:
    lines = tuple(((f"{k}", "number"),) for k in range(count))
    parts = list(parts_of(Told(reply, 3), iter(lines)))
    assert [part.goes_on for part in parts] == [True] * (len(parts) - 1) + [False] * bool(parts)
    assert all(len(part.lines) <= MAX_PART_ROWS for part in parts)
    if parts:
        assert join_parts(parts) == Told(reply, 3, lines=lines)


def test_a_client_that_draws_no_replies_hears_their_lines(tmp_path: Path) -> None:
    lines = ("WHERE", "LIST none", "SIGNAL 9999", "HELP MOVES", "TIMELINE", "SHOW")
    hello = Hello((1,), rendered=60)
    with serving(tmp_path, styled=styled_lines) as server, server.call(hello=hello) as drawn, server.call() as plain:
        for line in lines:
            drawn.line(line)
            plain.line(line)
        told = [one for one in drawn.heard if isinstance(one, Told)]
        assert len(told) >= len(lines)
        for one in told:
            assert one.lines == tuple(styled_lines(one.reply, 60))
            assert {style for line in one.lines for _, style in line} <= {ink.value for ink in Ink}
        assert not any(one.lines for one in plain.heard if isinstance(one, Told))


def test_lines_of_replies_follow_the_screen_of_a_client(tmp_path: Path) -> None:
    with serving(tmp_path, styled=styled_lines) as server, server.call(hello=Hello((1,), rendered=40)) as drawn:
        drawn.line("WHERE")
        drawn.protocol.send(Screen(100))
        drawn.line("WHERE")
        narrow, wide = [one for one in drawn.heard if isinstance(one, Told)]
        assert narrow.lines == tuple(styled_lines(narrow.reply, 40))
        assert wide.lines == tuple(styled_lines(wide.reply, 100))
        assert len(wide.lines) < len(narrow.lines)


def test_lines_of_a_reply_hold_no_escape_sequences() -> None:
    text = "".join(text for line in styled_lines(Message("a\x1b[31mred\x9b1m"), 80) for text, _ in line)
    assert not {"\x1b", "\x9b"} & set(text)


def test_a_client_hears_the_whole_reply_once() -> None:
    told = Told(FileText(tuple(map(str, range(5 * MAX_PART_ROWS)))), 3)
    client = ClientConnection(Hello((1,)))
    client.begin()
    welcome = Welcome(1, "key", "cell1", "life", "supervisor", "ada", Clock(0.0), {})
    client.receive(encode(welcome, Encoding.JSON))
    heard = []
    for seq, part in enumerate(parts_of(told), 1):
        heard += client.receive(encode(replace(part, seq=seq), Encoding.JSON))
    assert [replace(one, seq=0) for one in heard] == [told]


# --- names of files ---


def test_the_names_of_files_are_those_that_were_given(tmp_path: Path) -> None:
    prefixes = prefixes_of((tmp_path, tmp_path / "in", None))
    told = Told(Message(f"{tmp_path}/in/a.v2 and {tmp_path}/b.v2"), 3)
    assert without(prefixes, told) == Told(Message("a.v2 and b.v2"), 3)
    same = Told(Message("nothing"))
    assert without(prefixes, same) is same


def test_what_a_server_answers_of_files(tmp_path: Path) -> None:
    with serving(tmp_path) as server, server.call() as ada:
        for line in ("LOAD none", "STORE all", "LOAD all", "FDIRECTORY", "COMMANDS none", "STATUS", "LOAD ../x"):
            ada.line(line)
        ada.ask(lambda id: Get(id, "none.txt"))
        ada.ask(lambda id: Put(id, "a/b", b""))
        ada.ask(Names)
        for message in ada.heard:
            assert str(tmp_path) not in str(message), message
        assert any(isinstance(one, Refused) for one in ada.heard)
        assert any(isinstance(one, Done) and not one.ok for one in ada.heard)


def test_a_value_without_a_prefix_is_told_from_one_with_it() -> None:
    prefixes = prefixes_of((Path("/srv/röbot"),))
    assert may_hold(prefixes, Message("/srv/röbot/a.v2 is there"))
    assert not may_hold(prefixes, Message("a.v2 is there"))
    assert may_hold(prefixes, Message("no text: \udcff")), "what cannot be encoded is looked at in full"
