"""The page of all messages and the JSON Schema are what the types say, and what is sent is what the schema says."""

from __future__ import annotations

import json
import re
from collections import Counter
from typing import Any, get_args

import jsonschema
import pytest

from tests.docs.makers import DOCS, maker
from tests.examples import in_full
from tests.net.fuzz import corpus
from vrs_cli.net.delivery_log import USUAL
from vrs_cli.net.messages import FromClient, FromServer
from vrs_cli.net.protocol import CLIENT_BYTES, HELLO_BYTES, HELLO_SECONDS
from vrs_cli.net.server import BACKLOG

OF_EACH = 12 if in_full() else 1  # messages of a type
SCHEMA = json.loads((DOCS / "protocol.schema.json").read_text("utf-8"))


def test_the_page_and_the_schema_are_what_the_types_say() -> None:
    made = maker("make_protocol")
    assert (DOCS / "messages.md").read_text("utf-8") == made.page(), "run python docs/make_protocol.py"
    assert (DOCS / "protocol.schema.json").read_text("utf-8") == made.schema.text(), "run python docs/make_protocol.py"


@pytest.mark.parametrize(("side", "kinds"), [("client", FromClient), ("server", FromServer)])
def test_what_is_sent_is_what_the_schema_says(side: str, kinds: Any) -> None:
    look = jsonschema.Draft202012Validator({**SCHEMA, "anyOf": [{"$ref": f"#/$defs/{side}"}]})
    _, frames = corpus(kinds)
    checked = Counter[str]()
    for message in (json.loads(frame) for frame in frames if isinstance(frame, str)):
        checked[message["type"]] += 1
        if checked[message["type"]] <= OF_EACH:
            look.validate(message)
    assert set(checked) == {kind.__struct_config__.tag for kind in get_args(kinds)}
    assert not look.is_valid({"type": "hologram"})
    assert not look.is_valid({"type": "line", "id": -1, "text": "MOVE a"})
    assert not look.is_valid({"type": "told", "reply": {"kind": "Message"}})


def test_the_page_of_the_protocol_speaks_of_messages_that_there_are() -> None:
    text = (DOCS / "protocol.md").read_text("utf-8")
    types = {kind.__struct_config__.tag for kind in get_args(FromClient) + get_args(FromServer)}
    spoken = set(re.findall(r'"type":"(\w+)"', text))
    assert spoken <= types | {"preview", "ahead"}  # which a relay and its page say to each other
    assert {"hello", "welcome", "line", "done", "sample"} <= spoken


def test_the_bounds_are_those_of_the_protocol() -> None:
    text = (DOCS / "protocol.md").read_text("utf-8")
    for what, most in (
        ("the first message", f"{HELLO_BYTES // 1000} kB, within {HELLO_SECONDS:g} s"),
        ("a message of a client", f"{CLIENT_BYTES // 1_000_000} MB"),
        ("messages that a client may not have received yet", f"{USUAL.message_bytes // 10**6} MB, {USUAL.seconds:g} s"),
        ("bytes that wait for a socket", f"{BACKLOG // 1024} KiB"),
    ):
        assert f"| {what} | {most}" in text
