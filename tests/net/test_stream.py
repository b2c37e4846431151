"""Bytes that many share: whoever has got what came before in a context can take what follows, and nobody else."""

from __future__ import annotations

import zlib

import pytest

from vrs_cli.net.broadcast import letter
from vrs_cli.net.messages import Missed
from vrs_cli.net.stream import DeflateContext, DeflatedPlace, MessageForm, Packet

TAIL = b"\x00\x00\xff\xff"


def test_a_message_is_made_once_in_each_form() -> None:
    packet = letter(Missed(3))
    packets = [packet(form) for form in (MessageForm(True), MessageForm(False), MessageForm(True))]
    assert packets[0] is packets[2]
    assert packets[0].data == b'{"type":"missed","count":3}'


def test_messages_of_one_context_are_inflated_one_after_the_other() -> None:
    context, inflate = DeflateContext(), zlib.decompressobj(-15)
    texts = [b"joint 1 at %d degrees; " % number * 20 for number in range(5)]
    for text in texts:
        packet = context.deflate(Packet(text, True))
        assert packet.text
        assert len(packet.data) < len(text) / 4
        assert inflate.decompress(packet.data + TAIL) == text


def test_another_context_refers_to_nothing_before_it() -> None:
    inflate = zlib.decompressobj(-15)
    for context in (DeflateContext(), DeflateContext()):
        for text in (b"what was said before", b"what was said before, again"):
            assert inflate.decompress(context.deflate(Packet(text, True)).data + TAIL) == text


@pytest.mark.parametrize(
    ("place", "last", "follows"),
    [
        (None, None, True),
        (None, DeflatedPlace(1, 4), True),
        (DeflatedPlace(2, 0), None, True),
        (DeflatedPlace(2, 0), DeflatedPlace(1, 4), True),
        (DeflatedPlace(1, 5), DeflatedPlace(1, 4), True),
        (DeflatedPlace(1, 5), DeflatedPlace(1, 3), False),
        (DeflatedPlace(1, 5), DeflatedPlace(1, 5), False),
        (DeflatedPlace(2, 5), DeflatedPlace(1, 4), False),
        (DeflatedPlace(1, 5), None, False),
    ],
)
def test_what_follows(place: DeflatedPlace | None, last: DeflatedPlace | None, follows: bool) -> None:
    assert Packet(b"", True, place).follows(last) is follows
