"""Print a JSON Schema of all messages, made from their types: `python3 -m vrs_cli.net.schema`."""

from __future__ import annotations

import sys

from vrs_cli.net.messages import VERSION, FromClient, FromServer
from vrs_cli.wire.codec import schema_text


def text() -> str:
    """Return the content of `docs/protocol.schema.json`."""
    return schema_text(f"vrs protocol, version {VERSION}", client=FromClient, server=FromServer)


if __name__ == "__main__":
    sys.stdout.write(text())
