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

All messages of [the protocol](protocol.md), from their types in `vrs_cli/wire/messages.py` and
`vrs_cli/net/messages.py`; a field in brackets may be left out. `protocol.schema.json` says the same, and what is inside
replies, questions and records, as a JSON Schema.
Made by `python docs/make_protocol.py`.
"""
COLUMNS = "| `type` | fields | sort | what it is |\n| --- | --- | --- | --- |"
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
