"""The file of `--save`: it grows while the robot moves, so that it is there however that ends."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from vrs_cli.engine.engine import Engine


@contextmanager
def journal(path: str | None, engine: Engine, *, durable: bool) -> Iterator[None]:
    """Write every change of the timeline to a file, if one is named. `durable`: each is on the disk at once."""
    if path is None:
        yield
        return
    from vrs_cli.files.trajectory_file import TrajectoryWriter

    with TrajectoryWriter(path, engine.model, engine.initial, durable=durable) as writer:
        engine.listeners.append(lambda delta, _timeline: writer.append(delta))
        yield
