"""Replies as plain text, for pipes and files: no colours, and the same for the same reply wherever it runs."""

from __future__ import annotations

from collections.abc import Iterable

from vrs_cli.render.blocks import PIPE, Block, Grid, grid_lines
from vrs_cli.values.replies import Message, Reply


def plain_text(reply: Reply) -> str:
    """The text of a reply, each line ended; an empty string for a reply that says nothing."""
    if isinstance(reply, Message):  # how a run ends: most say nothing else, and the layouts take a while to load
        return "".join(f"{line.rstrip()}\n" for line in reply.text.split("\n"))
    from vrs_cli.render.layout import blocks

    return text_of(blocks(reply, PIPE))


def text_of(shown: Iterable[Block]) -> str:
    """The text of blocks, each line ended."""
    lines = (line for block in shown for line in (grid_lines(block) if isinstance(block, Grid) else (block,)))
    return "".join(f"{line.text.rstrip()}\n" for line in lines)
