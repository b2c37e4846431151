"""A refusal that went through bytes is the error that it was, with its class, message and numbers."""

from __future__ import annotations

import pytest

from vrs_cli import errors
from vrs_cli.errors import VrsError
from vrs_cli.language.text.parser import parse_prompt
from vrs_cli.net.messages import FromServer, Refused
from vrs_cli.wire.codec import Encoding, Reader, encode
from vrs_cli.wire.messages import Refusal

READER: Reader[FromServer] = Reader(FromServer)


def through(refusal: Refusal) -> Refusal:
    message = READER.read(encode(Refused(refusal), Encoding.MSGPACK))
    assert isinstance(message, Refused)
    return message.refusal


def classes_of_errors() -> list[type[VrsError]]:
    return [kind for kind in vars(errors).values() if isinstance(kind, type) and issubclass(kind, VrsError)]


def test_codes_tell_errors_apart() -> None:
    told = [kind.code for kind in classes_of_errors() if "code" in vars(kind)]
    assert len(told) == len(set(told))


@pytest.mark.parametrize("kind", classes_of_errors(), ids=lambda kind: kind.__name__)
def test_a_refusal_is_its_error_again(kind: type[VrsError]) -> None:
    error = kind("the detail", "a hint", value=1.5, lower=-0.0, joint=2, place=(1.0, 2.0, 3.0))
    again = through(Refusal.of(error)).error()
    assert str(again) == str(error)
    assert (again.code, again.title, again.numbers) == (error.code, error.title, error.numbers)
    assert "code" not in vars(kind) or type(again) is kind


def test_a_line_that_is_refused_keeps_its_words() -> None:
    with pytest.raises(VrsError) as caught:
        parse_prompt("MOVEE a", ())
    again = Refusal.of(caught.value).error()
    assert str(again) == str(caught.value)
    assert again.title == caught.value.title
