"""A trajectory as it looks, in files: formats beside those of `files/exports.py`."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import BinaryIO

from vrs_cli.files.exports import Exporter
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.view3d.needs import check_mp4, check_still, check_view
from vrs_cli.world.world import World

FILM_RATE = 10.0  # [1/s] frames


def _write_page(stream: BinaryIO, arm: RobotArm, timeline: Timeline, rate: float, world: World | None = None) -> None:
    from vrs_cli.view3d.studio import page

    stream.write(page(arm, timeline, rate, world).encode())


def _page_rate(timeline: Timeline) -> float:
    from vrs_cli.view3d.studio import usual_rate

    return usual_rate(timeline)


def _photographed(name: str) -> Callable[..., None]:
    """Return a function that writes a picture: one of `still`, by its name."""

    def write(stream: BinaryIO, arm: RobotArm, timeline: Timeline, number: float, world: World | None = None) -> None:
        from vrs_cli.view3d import still

        getattr(still, name)(stream, arm, timeline, number, world)

    return write


PICTURES: Mapping[str, Exporter] = {
    exporter.name: exporter
    for exporter in (
        Exporter(
            "html",
            ".html",
            "a page that plays in a browser, offline",
            _write_page,
            check_view,
            _page_rate,
            shows_cell=True,
        ),
        Exporter(
            "png",
            ".png",
            "a picture of one moment",
            _photographed("write_still"),
            check_still,
            lambda timeline: timeline.end,
            True,
            shows_cell=True,
        ),
        Exporter(
            "gif",
            ".gif",
            "a moving picture",
            _photographed("write_gif"),
            check_still,
            lambda _: FILM_RATE,
            shows_cell=True,
        ),
        Exporter(
            "mp4",
            ".mp4",
            "a film, by ffmpeg",
            _photographed("write_mp4"),
            check_mp4,
            lambda _: FILM_RATE,
            shows_cell=True,
        ),
    )
}
