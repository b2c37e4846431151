"""A trajectory as one HTML file that plays without a server and without the Internet.

The page is viser's own client with a recording of the scene inside it: what moves is sent again for each frame.
"""

from __future__ import annotations

from collections.abc import Iterator
from html import escape
from itertools import pairwise
from typing import BinaryIO

from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.trajectory.segment import Phase
from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.view3d.needs import PictureError
from vrs_cli.view3d.stage import FIELD, camera_for
from vrs_cli.view3d.studio import Caption, Studio, server

RATE = 30.0  # [1/s] frames while the robot moves
REST_RATE = 1.0  # [1/s] while it stands still: the caption goes on
MOST_FRAMES = 18_000  # 10 minutes at 30 frames a second: about 5 MB, and what a browser still holds with ease
HOLD = 1.0  # [s] the end is seen before a page begins again
ASPECT = 0.8  # of the picture, width to height: all of the arm is seen below a cell, and nearly all of it on a phone
TITLE = "<title>Viser</title>"  # of viser's client


def write_page(stream: BinaryIO, arm: RobotArm, timeline: Timeline, rate: float) -> None:
    """Write a page that plays a timeline, with so many frames a second. The same bytes for the same timeline.

    Raises PictureError for more frames than a page can hold.
    """
    stream.write(page(arm, timeline, rate).encode())


def usual_rate(timeline: Timeline) -> float:
    """30 frames a second, fewer where more than ten minutes move [1/s]."""
    moving = sum(last - first for first, last, moves in stretches(timeline) if moves)
    return min(RATE, MOST_FRAMES / max(moving, 1.0))


def page(arm: RobotArm, timeline: Timeline, rate: float) -> str:
    """The page that `write_page` writes."""
    times = list(frame_times(timeline, rate))
    if len(times) > 2 * MOST_FRAMES:
        raise PictureError(
            f"{len(times)} frames are more than a page holds",
            f"without --rate there are {usual_rate(timeline):.3g} a second",
        )
    with server() as viser, viser.atomic():  # nobody is woken for each message
        studio = Studio(viser.scene, arm, timeline, Caption(viser.scene, arm.model))
        studio.show(times[0])
        camera = camera_for(arm.model, ASPECT)
        viser.initial_camera.position, viser.initial_camera.look_at = camera
        viser.initial_camera.fov = FIELD
        recording = viser.get_scene_serializer()
        for before, t in pairwise(times):
            recording.insert_sleep(t - before)
            studio.show(t)
        recording.insert_sleep(HOLD)
        html = recording.as_html()
    return html.replace(TITLE, f"<title>{escape(arm.model.title)}</title>", 1)


Stretch = tuple[float, float, bool]  # from, to [s], whether the robot moves


def stretches(timeline: Timeline) -> list[Stretch]:
    """The times in which the robot moves, and in which it stands, in their order."""
    found: list[Stretch] = []
    for segment in timeline:
        for first, last, moves in (
            (found[-1][1] if found else timeline.start, segment.start, False),
            (segment.start, segment.finish, segment.phase is not Phase.REST),
        ):
            if found and found[-1][2] is moves:
                found[-1] = (found[-1][0], max(last, found[-1][1]), moves)
            elif last > first:
                found.append((first, last, moves))
    return found


def frame_times(timeline: Timeline, rate: float) -> Iterator[float]:
    """The times of the frames: `rate` times a second while the robot moves, and where it begins and ends to [s]."""
    yield timeline.start
    for first, last, moves in stretches(timeline):
        step = 1.0 / (rate if moves else REST_RATE)
        count = round((last - first) / step - 0.5)
        yield from (first + k * step for k in range(1, count + 1) if first + k * step < last)
        yield last
