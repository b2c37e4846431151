"""Write docs/messages.md and docs/protocol.schema.json from the types of the messages.

python docs/make_protocol.py
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any, get_args

from msgspec import NODEFAULT
from msgspec.structs import FieldInfo, fields

from vrs_cli.net import schema
from vrs_cli.net.messages import Change, Command, FromClient, FromServer, Numbered, Request, Result

PAGE = Path(__file__).parent / "messages.md"
SCHEMA = Path(__file__).parent / "protocol.schema.json"
HEAD = """# Every message

`python docs/make_protocol.py` makes this page of all messages of [the protocol](protocol.md), from their types in
`vrs_cli/wire/messages.py` and `vrs_cli/net/messages.py`. `protocol.schema.json` is their JSON Schema; it also describes
replies, questions and records.

Fields in brackets are optional. The server executes a *command* once, and answers it by `done`; `until` is the latest
arrival of a command or an answer by the server's clock [s]. The *answer* to a *request* has the same `id`. A client
gets each message that is *numbered by `seq`* exactly once, even if the connection is lost meanwhile; `number`
counts the changes of a robot.
"""
COLUMNS = "| `type` | fields | sort | meaning |\n| --- | --- | --- | --- |"
SORTS = (
    (Command, "command"),
    (Request, "request"),
    (Numbered, "numbered by `seq`"),
    (Change, "numbered by `number`"),
    (Result, "answer"),
)


def page() -> str:
    """The whole page."""
    return "\n".join(
        (HEAD, *_table("From the client", get_args(FromClient)), *_table("From the server", get_args(FromServer)))
    )


def _table(title: str, kinds: tuple[Any, ...]) -> Iterator[str]:
    yield f"## {title}\n\n{COLUMNS}"
    for kind in kinds:
        told = " ".join((kind.__doc__ or "").split()).replace("|", "\\|")
        sort = next((name for above, name in SORTS if issubclass(kind, above)), "")
        yield f"| `{kind.__struct_config__.tag}` | {', '.join(map(_field, fields(kind)))} | {sort} | {told} |"
    yield ""


def _field(field: FieldInfo) -> str:
    optional = field.default is not NODEFAULT or field.default_factory is not NODEFAULT
    return f"[`{field.name}`]" if optional else f"`{field.name}`"


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
    SCHEMA.write_text(schema.text(), encoding="utf-8")
