"""What is decoded is what was encoded, to the bit; bytes of anybody else are refused with one error."""

from __future__ import annotations

import json
from typing import Any

import msgspec
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from tests.files.trajectories import form, initial, planned
from tests.values import values
from vrs_cli import errors
from vrs_cli.dialogue.replies import Message, Tone
from vrs_cli.engine.settings import Settings
from vrs_cli.engine.snapshot import Snapshot
from vrs_cli.errors import JointOutOfRange, VrsError
from vrs_cli.language.text.parser import parse_prompt
from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.wire.messages import KINDS, VERSION, Encoding, Refusal, decode, encode
from vrs_cli.wire.records import RecordError


@pytest.mark.parametrize("encoding", Encoding)
@pytest.mark.parametrize("kind", KINDS.values(), ids=lambda kind: kind.__name__)
def test_what_is_decoded_is_what_was_encoded(kind: type, encoding: Encoding) -> None:
    @settings(max_examples=15, deadline=None, database=None, derandomize=True, suppress_health_check=list(HealthCheck))
    @given(values(kind))
    def law(value: Any) -> None:
        data = encode(value, encoding)
        again = decode(data, form(), encoding)
        assert again == value
        assert repr(again) == repr(value)  # which tells -0.0 from 0.0
        assert encode(again, encoding) == data

    law()


def through(value: Any, encoding: Encoding) -> Any:
    return decode(encode(value, encoding), form(), encoding)


@pytest.mark.parametrize("encoding", Encoding)
def test_a_snapshot_and_the_deltas_after_it_give_the_same_timeline_to_the_bit(encoding: Encoding) -> None:
    timeline, changes = Timeline([initial()]), planned(40, seed=3)[1]
    for delta in changes[:20]:
        timeline = timeline.apply(delta)
    mirror = through(Snapshot.of(timeline, Settings()), encoding).timeline()
    for delta in changes[20:]:
        timeline, mirror = timeline.apply(delta), mirror.apply(through(delta, encoding))
        assert mirror.version == timeline.version
    assert repr(tuple(mirror)) == repr(tuple(timeline))


@pytest.mark.parametrize("encoding", Encoding)
def test_a_window_of_a_snapshot_too(encoding: Encoding) -> None:
    timeline = planned(30, seed=4)[0]
    whole = Snapshot.of(timeline, Settings())
    part = whole.window(timeline.end / 3, timeline.end / 2)
    assert 1 < len(part.segments) < len(whole.segments)
    assert repr(through(part, encoding)) == repr(part)


def test_a_message_as_it_is_written() -> None:
    data = encode(Message("Program completed", Tone.NOTE))
    assert data == b'{"v":1,"kind":"Message","body":{"kind":"Message","text":"Program completed","tone":"note"}}'


def test_an_error_keeps_its_numbers() -> None:
    error = JointOutOfRange("would be 9", "less", joint=3, value=9.0, lower=0.0, upper=1.0, place=(1.0, 2.0, 3.0))
    refusal = decode(encode(Refusal.of(error)), form())
    assert refusal == Refusal(
        -1023, "Joint 3 out of range", str(error), "would be 9", "less", 9.0, 0.0, 1.0, 3, (1.0, 2.0, 3.0)
    )


# --- bytes of others ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("encoding", Encoding)
def test_another_version_is_refused_in_one_clear_line(encoding: Encoding) -> None:
    pack = msgspec.json.encode if encoding is Encoding.JSON else msgspec.msgpack.encode
    with pytest.raises(RecordError, match=rf"^a message of version 7; this vrs \S+ reads version {VERSION}$"):
        decode(pack({"v": 7, "what": []}), form(), encoding)


def test_an_unknown_kind_is_refused() -> None:
    with pytest.raises(RecordError, match="unknown kind 'Massage'"):
        decode(b'{"v":1,"kind":"Massage","body":{}}', form())


@pytest.mark.parametrize("encoding", Encoding)
@settings(max_examples=150, deadline=None, suppress_health_check=list(HealthCheck))
@given(junk=st.binary(max_size=60), place=st.floats(0.0, 1.0), cut=st.integers(0, 8))
def test_hostile_bytes_give_one_error(encoding: Encoding, junk: bytes, place: float, cut: int) -> None:
    whole = encode(planned(2)[1][1], encoding)
    at = int(place * len(whole))
    for data in (junk, whole[:at] + junk + whole[at + cut :], whole[:at]):
        try:
            value = decode(data, form(), encoding)
        except RecordError:
            continue
        assert type(value).__name__ in KINDS


@pytest.mark.parametrize(
    "body",
    [
        {"kind": "Message", "text": 5},
        {"kind": "Message", "tone": "note"},
        {"kind": "Message", "text": "x", "tone": "loud"},
        [],
        None,
    ],
)
def test_a_body_that_is_not_of_its_kind_is_refused(body: object) -> None:
    with pytest.raises(RecordError, match="no message"):
        decode(json.dumps({"v": 1, "kind": "Message", "body": body}).encode(), form())


def test_nesting_without_end_is_refused() -> None:
    with pytest.raises(RecordError):
        decode(b'{"v":1,"kind":"Message","body":' + b"[" * 100_000, form())


def classes_of_errors() -> list[type[VrsError]]:
    return [kind for kind in vars(errors).values() if isinstance(kind, type) and issubclass(kind, VrsError)]


def test_codes_tell_errors_apart() -> None:
    told = [kind.code for kind in classes_of_errors() if "code" in vars(kind)]
    assert len(told) == len(set(told))


@pytest.mark.parametrize("kind", classes_of_errors(), ids=lambda kind: kind.__name__)
def test_a_refusal_is_its_error_again(kind: type[VrsError]) -> None:
    error = kind("the detail", "a hint", value=1.5, lower=-0.0, joint=2, place=(1.0, 2.0, 3.0))
    again = through(Refusal.of(error), Encoding.MSGPACK).error()
    assert str(again) == str(error)
    assert (again.code, again.title, again.numbers) == (error.code, error.title, error.numbers)
    assert "code" not in vars(kind) or type(again) is kind


def test_a_line_that_is_refused_keeps_its_words() -> None:
    with pytest.raises(VrsError) as caught:
        parse_prompt("MOVEE a", ())
    again = Refusal.of(caught.value).error()
    assert str(again) == str(caught.value)
    assert again.title == caught.value.title
