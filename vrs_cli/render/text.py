"""Return replies as text for outputs other than the shell's terminal: plain text for pipes and files, and styled text
for clients that draw it themselves."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from vrs_cli.render.plain import visible
from vrs_cli.values.results import Message

if TYPE_CHECKING:
    from vrs_cli.values.replies import Reply, StyledLine


def plain_text(reply: Reply) -> str:
    """Return the text of a reply, in which each line ends with a newline; "" for an empty reply."""
    # return early, because most runs show only such a message, and loading the layouts takes a while
    if isinstance(reply, Message):
        return "".join(f"{line.rstrip()}\n" for line in reply.text.split("\n"))
    from vrs_cli.render import blocks, layout

    return blocks.text_of(layout.blocks(reply, blocks.PIPE))


def styled_lines(reply: Reply, columns: int) -> Iterator[StyledLine]:
    """Yield the lines of a reply for a screen of `columns` characters, as pieces (text, name of an `Ink`). Tables that
    grow with time end after `SCREEN_ROWS` rows, as on a terminal."""
    from vrs_cli.render import blocks, layout

    page = blocks.Page(columns, blocks.SCREEN_ROWS, colours=True, unicode=True)
    for line in blocks.block_lines(layout.blocks(reply, page), columns):
        yield tuple((visible(text), ink.value) for text, ink in line.pieces)
