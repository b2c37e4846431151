"""Replies as plain text, for pipes and files: no colours, and the same for the same reply wherever it runs."""

from __future__ import annotations

from vrs_cli.render.blocks import PIPE, text_of
from vrs_cli.values.replies import Message, Reply


def plain_text(reply: Reply) -> str:
    """Return the text of a reply, each line ended; "" for a reply that says nothing."""
    if isinstance(reply, Message):  # how a run ends: most say nothing else, and the layouts take a while to load
        return "".join(f"{line.rstrip()}\n" for line in reply.text.split("\n"))
    from vrs_cli.render.layout import blocks

    return text_of(blocks(reply, PIPE))
