"""The file of `--save`: it grows while the robot moves, so that it is there however that ends."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from vrs_cli.errors import FileError

if TYPE_CHECKING:
    from vrs_cli.engine.engine import Engine


@contextmanager
def journal(
    path: str | None, engine: Engine, tell: Callable[[str], None], *, durable: bool
) -> Iterator[Callable[[], bool]]:
    """Write every change of the timeline to a file, if one is named. `durable`: each is on the disk before it happens.
    What is yielded tells afterwards whether all is in the file that was asked for.

    Raises FileError where the file cannot be begun.
    """
    if path is None:
        yield lambda: True
        return
    from vrs_cli.files.continuing import keep_journal
    from vrs_cli.files.journal import take

    file = keep_journal(take(Path(path)), engine, tell, durable=durable)
    try:
        yield lambda: file.sound
    finally:
        try:
            file.close()
        except FileError as error:
            tell(str(error))
