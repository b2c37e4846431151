"""What is read is what was sent, to the bit, in both forms; bytes of anybody else are refused with one error."""

from __future__ import annotations

from contextlib import suppress
from typing import Any, get_args

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from tests.examples import some
from tests.files.trajectories import planned
from tests.sample_values import values
from vrs_cli.engine.settings import Settings
from vrs_cli.errors import JointOutOfRange
from vrs_cli.net.messages import Asked, Delta, FromClient, FromServer, Line, Refused, Replaced, Told
from vrs_cli.values.questions import Question
from vrs_cli.values.replies import Reply
from vrs_cli.wire.codec import Encoding, Frame, Reader, UnknownType, encode
from vrs_cli.wire.messages import Refusal, SnapshotRecord
from vrs_cli.wire.records import Motions, RecordError, delta_record

FROM_CLIENT: Reader[FromClient] = Reader(FromClient)
FROM_SERVER: Reader[FromServer] = Reader(FromServer)
OF_EACH = some(60)  # messages of a kind
ALL = [(kind, FROM_CLIENT) for kind in get_args(FromClient)] + [(kind, FROM_SERVER) for kind in get_args(FromServer)]


@pytest.mark.parametrize(("kind", "reader"), ALL, ids=lambda kind: getattr(kind, "__name__", ""))
def test_what_is_read_is_what_was_sent(kind: type, reader: Reader[Any]) -> None:
    @settings(
        max_examples=OF_EACH, deadline=None, database=None, derandomize=True, suppress_health_check=list(HealthCheck)
    )
    @given(values(kind))
    def law(message: Any) -> None:
        for encoding in Encoding:
            frame = encode(message, encoding)
            again = reader.read(frame)
            assert again == message
            assert repr(again) == repr(message)  # which tells -0.0 from 0.0
            assert encode(again, encoding) == frame

    law()


@pytest.mark.parametrize("kind", get_args(Reply) + get_args(Question), ids=lambda kind: kind.__name__)
def test_every_reply_and_question_comes_as_it_was(kind: type) -> None:
    @settings(
        max_examples=OF_EACH, deadline=None, database=None, derandomize=True, suppress_health_check=list(HealthCheck)
    )
    @given(values(kind))
    def law(value: Any) -> None:
        message = Told(value) if isinstance(value, Reply) else Asked(1, value)
        for encoding in Encoding:
            again = FROM_SERVER.read(encode(message, encoding))
            assert repr(again) == repr(message)
            assert again == message

    law()


def test_an_error_keeps_its_numbers() -> None:
    error = JointOutOfRange("would be 9", "less", joint=3, value=9.0, lower=0.0, upper=1.0, place=(1.0, 2.0, 3.0))
    message = FROM_SERVER.read(encode(Refused(Refusal.of(error)), Encoding.JSON))
    assert isinstance(message, Refused)
    assert message.refusal == Refusal(
        -1023, "Joint 3 out of range", str(error), "would be 9", "less", 9.0, 0.0, 1.0, 3, (1.0, 2.0, 3.0)
    )


def test_a_message_as_it_is_written() -> None:
    assert encode(Line(3, "MOVE a"), Encoding.JSON) == '{"type":"line","id":3,"text":"MOVE a"}'
    frame = '{"type":"told","reply":{"kind":"Message","text":"hi","tone":"note"},"id":3,"seq":7}'
    told = FROM_SERVER.read(frame)
    assert isinstance(told, Told)
    assert encode(told, Encoding.JSON) == frame


def test_a_server_refuses_a_key_that_it_does_not_know_and_a_client_passes_over_it() -> None:
    with pytest.raises(RecordError, match="no message: Object contains unknown field `colour`"):
        FROM_CLIENT.read('{"type":"abort","id":1,"colour":"red"}')
    assert FROM_SERVER.read('{"type":"missed","count":1,"colour":"red"}')


@pytest.mark.parametrize("reader", [FROM_CLIENT, FROM_SERVER])
def test_a_type_of_a_later_version_is_told_from_garbage(reader: Reader[Any]) -> None:
    with pytest.raises(UnknownType, match="a message of the unknown type 'hologram'"):
        reader.read('{"type":"hologram","id":1}')


@pytest.mark.parametrize("frame", ["", "[" * 100_000, '{"type":7}', b"", b"\xff" * 9, b"\x91" * 100_000, "\ud800"])
def test_garbage_is_refused_in_one_way(frame: Frame) -> None:
    with pytest.raises(RecordError, match=r"^no message: "):
        FROM_CLIENT.read(frame)


@pytest.mark.parametrize("reply", ['{"kind":"Message","text":5}', '{"kind":"Message"}', '{"kind":"x"}', "[]", "null"])
def test_a_reply_that_is_not_of_its_kind_is_refused(reply: str) -> None:
    with pytest.raises(RecordError, match="no message"):
        FROM_SERVER.read(f'{{"type":"told","reply":{reply}}}')


def test_a_snapshot_has_a_segment_at_least() -> None:
    empty = SnapshotRecord(1, (), Settings())
    with pytest.raises(RecordError, match="length >= 1"):
        FROM_SERVER.read(encode(Replaced(empty), Encoding.JSON))


@pytest.mark.parametrize("encoding", Encoding)
@settings(max_examples=150, deadline=None, suppress_health_check=list(HealthCheck))
@given(junk=st.binary(max_size=60), place=st.floats(0.0, 1.0), cut=st.integers(0, 8))
def test_a_damaged_message_is_refused_or_another(encoding: Encoding, junk: bytes, place: float, cut: int) -> None:
    frame = encode(Delta(delta_record(planned(2)[1][1], Motions()), 0.0), encoding)
    whole = frame.encode() if isinstance(frame, str) else frame
    at = int(place * len(whole))
    for data in (whole[:at] + junk + whole[at + cut :], whole[:at]):
        with suppress(RecordError):
            FROM_SERVER.read(data.decode(errors="replace") if encoding is Encoding.JSON else data)


@settings(max_examples=300, deadline=None)
@given(frame=st.text() | st.binary())
def test_whatever_comes_there_is_one_error(frame: Frame) -> None:
    for reader in (FROM_CLIENT, FROM_SERVER):
        with pytest.raises(RecordError):
            reader.read(frame)
