"""A trajectory as it looks, in files: formats beside those of `files/exports.py`. The page draws all of them."""

from __future__ import annotations

import json
import shutil
import subprocess
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from importlib.util import find_spec
from io import BytesIO
from math import ceil, floor
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import BinaryIO

from vrs_cli.engine.position import position_at
from vrs_cli.extras import how_to_install
from vrs_cli.files.exports import Exporter
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.language.run.signals import Cell
from vrs_cli.net.recorded_page import recorded_page
from vrs_cli.render.browser import BrowserPage, PictureError, browser_page, find_browser
from vrs_cli.render.page_export import check_page, page
from vrs_cli.render.progress import RunProgress
from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.world.world import World

SIZE, FILM_SIZE, GIF_SIZE = (960, 640), (1280, 720), (640, 420)  # [px]
FINE, FAST = 1, 3  # quality of the page: with shadows; without
RATE = 10.0  # [1/s] frames of a film
MOST_FRAMES = 600  # of a film: each takes a tenth of a second to a second to draw
TENTHS = 10  # of a second in a caption: finer figures are not read while they change
JPEG = {"quality": 92, "optimizeForSpeed": True}
H264 = ("-c:v", "libx264", "-preset", "fast", "-pix_fmt", "yuv420p", "-fflags", "+bitexact", "-movflags", "+faststart")
GIF_COLOURS = 256
READY = "new Promise((done) => { const look = () => (window.ready ? ready.then(done) : setTimeout(look, 20)); look() })"


def write_page(
    stream: BinaryIO, arm: RobotArm, timeline: Timeline, rate: float, world: World | None = None, title: str = ""
) -> None:
    """Write an HTML file that plays a timeline, `rate` seconds of it in one second."""
    stream.write(page(recorded_page(arm, timeline, title=title, rate=rate, cell=_cell(world))).encode())


def write_still(
    stream: BinaryIO, arm: RobotArm, timeline: Timeline, t: float, world: World | None = None, title: str = ""
) -> None:
    """Write a PNG of the moment t [s], with robot and time. Raises PictureError where there is no browser."""
    with _shown(arm, timeline, SIZE, FINE, world) as seen:
        seen.evaluate(_taken(arm, timeline, t, title or arm.model.title))
        stream.write(seen.picture("png"))


def write_gif(
    stream: BinaryIO, arm: RobotArm, timeline: Timeline, rate: float, world: World | None = None, title: str = ""
) -> None:
    """Write a moving picture with so many frames a second, without an end. Raises PictureError."""
    from PIL import Image

    def in_few_colours(frame: bytes) -> Image.Image:
        """An octree keeps the colours of thin lines, which the median cut gives to large surfaces."""
        picture = Image.open(BytesIO(frame)).convert("RGB")
        return picture.quantize(GIF_COLOURS, Image.Quantize.FASTOCTREE, dither=Image.Dither.NONE)

    with _frames(arm, timeline, rate, GIF_SIZE, world, title, "png") as frames:
        first, *others = map(in_few_colours, frames)
    first.save(stream, "gif", save_all=True, append_images=others, duration=round(1000.0 / rate), loop=0)


def write_mp4(
    stream: BinaryIO, arm: RobotArm, timeline: Timeline, rate: float, world: World | None = None, title: str = ""
) -> None:
    """Write a film with so many frames a second, by the ffmpeg of this machine. Raises PictureError."""
    come = ("-f", "image2pipe", "-c:v", "mjpeg", "-framerate", f"{rate:.6g}", "-i", "-")
    with TemporaryDirectory() as folder, _frames(arm, timeline, rate, FILM_SIZE, world, title, "jpeg") as frames:
        made = Path(folder) / "film.mp4"
        command = (find_ffmpeg(), "-loglevel", "error", *come, *H264, str(made))
        with subprocess.Popen(command, stdin=subprocess.PIPE, stderr=subprocess.PIPE) as running:
            assert running.stdin is not None, "it is piped"
            with suppress(BrokenPipeError):  # it says why it ended
                for frame in frames:
                    running.stdin.write(frame)
            _, said = running.communicate()
        if running.returncode:
            raise PictureError("ffmpeg makes no film", said.decode(errors="replace").strip())
        stream.write(made.read_bytes())


@contextmanager
def _frames(
    arm: RobotArm,
    timeline: Timeline,
    rate: float,
    size: tuple[int, int],
    world: World | None,
    title: str,
    form: str,
) -> Iterator[Iterator[bytes]]:
    """Pictures of the whole timeline as `png` or `jpeg`. Raises PictureError where there would be too many."""
    count = ceil((timeline.end - timeline.start) * rate)
    if count > MOST_FRAMES:
        raise PictureError(
            f"{count} frames are more than a film has ({MOST_FRAMES}), as each takes a moment to draw",
            f"give --rate {floor(10.0 * MOST_FRAMES / (timeline.end - timeline.start)) / 10.0:g}, or --to html",
        )
    name, options = title or arm.model.title, JPEG if form == "jpeg" else {}
    with _shown(arm, timeline, size, FAST, world) as seen, RunProgress("drawing", timeline.end) as progress:

        def taken(t: float) -> bytes:
            progress(t)
            seen.evaluate(_taken(arm, timeline, t, name))
            return seen.picture(form, **options)

        yield (taken(min(timeline.start + k / rate, timeline.end)) for k in range(count + 1))


@contextmanager
def _shown(
    arm: RobotArm, timeline: Timeline, size: tuple[int, int], quality: int, world: World | None
) -> Iterator[BrowserPage]:
    """Show the picture of the page in a browser. Raises PictureError."""
    with TemporaryDirectory() as folder, browser_page() as seen:
        file = Path(folder) / "page.html"
        file.write_text(page(recorded_page(arm, timeline, cell=_cell(world), picture=quality)), encoding="utf-8")
        seen.open(file.as_uri(), size)
        seen.evaluate(READY)
        yield seen


def _cell(world: World | None) -> Cell | None:
    return None if world is None else world.cell


def _taken(arm: RobotArm, timeline: Timeline, t: float, title: str) -> str:
    """Return the expression that shows a moment with its caption."""
    return f"take({t!r}, {json.dumps(caption(arm, timeline, t, title))})"


def caption(arm: RobotArm, timeline: Timeline, t: float, title: str) -> str:
    """Return `PUMA 560  3.2 s  MOVES part`, the command only while it moves the robot."""
    here = position_at(arm, timeline, t)
    shown = floor(t * TENTHS + 1e-6) / TENTHS
    return f"{title}   {shown:.1f} s   {here.text if here.moving else ''}".rstrip()


def check_still() -> None:
    """Raises UsageError where a browser or the page is missing."""
    check_page()
    find_browser()


def check_gif() -> None:
    """Raises UsageError where a browser, the page or Pillow is missing."""
    check_still()
    if find_spec("PIL") is None:
        raise PictureError("moving pictures need Pillow, which is not installed", how_to_install("pillow"))


def check_mp4() -> None:
    """Raises UsageError where a browser, the page or ffmpeg is missing."""
    check_still()
    find_ffmpeg()


def find_ffmpeg() -> str:
    """Raises PictureError where there is none."""
    found = shutil.which("ffmpeg")
    if found is None:
        raise PictureError("ffmpeg makes films, and there is none", "install it (apt-get install ffmpeg), or --to gif")
    return found


def _picture(
    name: str, summary: str, write: Callable[..., None], check: Callable[[], None], usual: Callable[[Timeline], float]
) -> Exporter:
    return Exporter(name, f".{name}", summary, write, check, usual, of_moment=name == "png", shows_cell=True)


PICTURES: Mapping[str, Exporter] = {
    exporter.name: exporter
    for exporter in (
        _picture("html", "a page that plays in a browser, offline", write_page, check_page, lambda _: 1.0),
        _picture("png", "a picture of one moment", write_still, check_still, lambda timeline: timeline.end),
        _picture("gif", "a moving picture", write_gif, check_gif, lambda _: RATE),
        _picture("mp4", "a film, by ffmpeg", write_mp4, check_mp4, lambda _: RATE),
    )
}
