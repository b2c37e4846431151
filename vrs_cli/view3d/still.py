"""Photographs of a scene: by the Chromium, Chrome or Edge of this machine, without a window and with software alone, so
that a picture is the same wherever it is taken.
"""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from math import ceil, floor
from pathlib import Path
from queue import Empty, Queue
from tempfile import TemporaryDirectory
from typing import BinaryIO

import numpy as np
import viser
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.render.progress import RunProgress
from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.view3d.figure import FIELD, camera_for
from vrs_cli.view3d.needs import PictureError, find_browser, find_ffmpeg
from vrs_cli.view3d.studio import Studio, caption, server
from vrs_cli.world.world import World

SIZE = (960, 640)  # of a picture [px]
FILM_SIZE = (640, 420)  # of one that moves
MOST_FRAMES = 600  # of a film: each takes a tenth of a second to a second to draw
GIF_COLOURS = 256
TRIES = 20  # of the first picture
LETTERS, INK = 17, (40, 46, 54)  # [px] the height of a caption, and its colour
PAUSE = 0.1  # [s] between two looks whether it has come
PATIENCE = 90.0  # [s] until a browser that shows nothing is given up: a slow machine draws the first picture in 10 s
FLAGS = (
    "--headless=new",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--disable-dev-shm-usage",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-extensions",
    "--no-first-run",
    "--host-resolver-rules=MAP * ~NOTFOUND, EXCLUDE 127.0.0.1",  # of its own accord it asks nobody either
)

Pixels = NDArray[np.uint8]  # (height, width, 3)


def write_still(stream: BinaryIO, arm: RobotArm, timeline: Timeline, t: float, world: World | None = None) -> None:
    """Write a PNG of the moment t [s]. Raises PictureError where there is no browser."""
    with photographing(SIZE) as (client, take):
        _aim(client, arm, SIZE)
        shown = Studio(client.scene, arm, timeline, world).show(t)
        Image.fromarray(captioned(take(), caption(shown))).save(stream, "png", optimize=True)


def _aim(client: viser.ClientHandle, arm: RobotArm, size: tuple[int, int]) -> None:
    """See all of the arm."""
    camera = camera_for(arm.model, size[0] / size[1])
    client.camera.position, client.camera.look_at, client.camera.fov = *camera, FIELD


def captioned(pixels: Pixels, text: str) -> Pixels:
    """The picture with a text at the upper left, where it covers nothing of the arm."""
    picture = Image.fromarray(pixels)
    font = ImageFont.load_default(LETTERS)
    ImageDraw.Draw(picture).text((LETTERS, LETTERS), text, INK, font)
    return np.array(picture)


def write_gif(stream: BinaryIO, arm: RobotArm, timeline: Timeline, rate: float, world: World | None = None) -> None:
    """Write a moving picture with so many frames a second, without an end. Raises PictureError."""
    with _frames(arm, timeline, rate, world) as frames:
        first, *others = map(in_few_colours, frames)
    pause = round(1000.0 / rate)
    first.save(stream, "gif", save_all=True, append_images=others, duration=pause, loop=0)


def in_few_colours(frame: Pixels) -> Image.Image:
    """Reduce a frame to the colours of a GIF. An octree keeps the colours of thin lines, which the median cut gives to
    large surfaces.
    """
    return Image.fromarray(frame).quantize(GIF_COLOURS, Image.Quantize.FASTOCTREE, dither=Image.Dither.NONE)


def write_mp4(stream: BinaryIO, arm: RobotArm, timeline: Timeline, rate: float, world: World | None = None) -> None:
    """Write a film with so many frames a second, by the ffmpeg of this machine. Raises PictureError."""
    width, height = FILM_SIZE
    picture = ("-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{width}x{height}", "-r", f"{rate:.6g}", "-i", "-")
    form = ("-c:v", "libx264", "-pix_fmt", "yuv420p", "-fflags", "+bitexact", "-movflags", "+faststart")
    with TemporaryDirectory() as folder, _frames(arm, timeline, rate, world) as frames:
        made = Path(folder) / "film.mp4"
        command = (find_ffmpeg(), "-loglevel", "error", *picture, *form, str(made))
        with subprocess.Popen(command, stdin=subprocess.PIPE, stderr=subprocess.PIPE) as running:
            assert running.stdin is not None, "it is piped"
            with suppress(BrokenPipeError):  # it says why it ended
                for frame in frames:
                    running.stdin.write(frame.tobytes())
            _, said = running.communicate()
        if running.returncode:
            raise PictureError("ffmpeg makes no film", said.decode(errors="replace").strip())
        stream.write(made.read_bytes())


@contextmanager
def _frames(arm: RobotArm, timeline: Timeline, rate: float, world: World | None) -> Iterator[Iterator[Pixels]]:
    """Pictures of the whole timeline. Raises PictureError where there would be too many."""
    count = ceil((timeline.end - timeline.start) * rate)
    if count > MOST_FRAMES:
        raise PictureError(
            f"{count} frames are more than a film has ({MOST_FRAMES}), as each takes a moment to draw",
            f"give --rate {floor(10.0 * MOST_FRAMES / (timeline.end - timeline.start)) / 10.0:g}, or --to html",
        )
    with photographing(FILM_SIZE) as (client, take), RunProgress("drawing", timeline.end) as progress:
        _aim(client, arm, FILM_SIZE)
        studio = Studio(client.scene, arm, timeline, world)
        if (label := client.scene.get_handle_by_name("/tool/name")) is not None:
            label.visible = False  # it would be a picture late

        def taken(t: float) -> Pixels:
            progress(t)
            shown = studio.show(t)
            return captioned(take(), caption(shown))

        yield (taken(min(timeline.start + k / rate, timeline.end)) for k in range(count + 1))


@contextmanager
def photographing(size: tuple[int, int]) -> Iterator[tuple[viser.ClientHandle, Callable[[], Pixels]]]:
    """A scene to fill, and what takes a picture of it. Raises PictureError."""
    browser = find_browser()
    arrived: Queue[viser.ClientHandle] = Queue()
    with server() as seen:
        seen.on_client_connect(arrived.put)
        with _looking(browser, f"http://127.0.0.1:{seen.get_port()}", size) as running:
            client = _awaited(arrived, running, browser)
            yield client, Camera(client, size).take


@contextmanager
def _looking(browser: str, url: str, size: tuple[int, int]) -> Iterator[subprocess.Popen[bytes]]:
    """The browser at a page, somewhat larger than the pictures, with a profile of its own."""
    width, height = size
    root = ("--no-sandbox",) * (sys.platform != "win32" and os.geteuid() == 0)  # Chromium gives root none
    with TemporaryDirectory(ignore_cleanup_errors=True) as profile:
        # wider than the picture in proportion, or the background does not reach its sides
        command = (browser, *FLAGS, *root, f"--window-size={width + 120},{height + 160}", f"--user-data-dir={profile}")
        none = subprocess.DEVNULL
        with subprocess.Popen([*command, url], stdin=none, stdout=none, stderr=none) as running:
            try:
                yield running
            finally:
                running.terminate()


def _awaited(arrived: Queue[viser.ClientHandle], running: subprocess.Popen[bytes], browser: str) -> viser.ClientHandle:
    """The browser as viser knows it. Raises PictureError where it does not come."""
    for _ in range(int(PATIENCE / PAUSE)):
        try:
            return arrived.get(timeout=PAUSE)
        except Empty:
            if running.poll() is not None:
                break
    raise PictureError(f"{browser} shows nothing", "does it run with --headless=new and --use-angle=swiftshader?")


class Camera:
    """Takes pictures of what a browser shows."""

    def __init__(self, client: viser.ClientHandle, size: tuple[int, int]) -> None:
        self._client, self._size, self._warm = client, size, False

    def take(self) -> Pixels:
        """The scene as it is now. The first picture is taken until it stays the same, and is not blank: a browser
        shows a new scene in parts. Raises PictureError.
        """
        taken = self._taken()
        for _ in range(0 if self._warm else TRIES):
            before, taken = taken, self._taken()
            if np.ptp(taken) and np.array_equal(before, taken):
                break
        self._warm = True
        return taken

    def _taken(self) -> Pixels:
        width, height = self._size
        try:
            drawn = self._client.get_render(height, width, transport_format="png", timeout=PATIENCE)
        except (TimeoutError, RuntimeError) as error:
            raise PictureError("the browser takes no picture", str(error)) from error
        opaque = drawn[:, :, 3:] / 255.0
        return np.round(drawn[:, :, :3] * opaque + 255.0 * (1.0 - opaque)).astype(np.uint8)
