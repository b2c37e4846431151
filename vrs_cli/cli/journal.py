"""The file of `--save`: it grows while the robot moves, so that it is there however that ends."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from msgspec import Struct

from vrs_cli.errors import FileError

if TYPE_CHECKING:
    from vrs_cli.engine.engine import Engine


class Kept(Struct):
    """What became of a journal: `sound` where all is in the file that was asked for."""

    sound: bool = True


@contextmanager
def journal(path: str | None, engine: Engine, tell: Callable[[str], None], *, durable: bool) -> Iterator[Kept]:
    """Write every change of the timeline to a file, if one is named. `durable`: each is on the disk before it happens.

    Raises FileError where the file cannot be begun.
    """
    kept = Kept()
    if path is None:
        yield kept
        return
    from vrs_cli.files.continuing import keep_journal
    from vrs_cli.files.journal import taken

    file = keep_journal(taken(Path(path)), engine, tell, durable=durable)
    try:
        yield kept
    finally:
        try:
            file.close()
        except FileError as error:
            tell(str(error))
        kept.sound = file.sound


def told_by(prog: str, hide: Callable[[], None]) -> Callable[[str], None]:
    """What says on standard error what is wrong with a journal; `hide` takes a progress line away before."""

    def tell(text: str) -> None:
        hide()
        print(f"{prog}: {text}", file=sys.stderr)

    return tell
