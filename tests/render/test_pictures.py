"""Test pictures of a trajectory: the arm is visible and moves, and missing programs are named."""

from __future__ import annotations

import io
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
import pytest

import vrs_cli as vrs
from tests.page.browser import alone, needs_chromium, page_folder
from vrs_cli.kinematics.forms import arm_for
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.render import pictures
from vrs_cli.render.pictures import PICTURES, PictureError, caption, check_mp4, check_still
from vrs_cli.trajectory.timeline import Timeline

ARM = arm_for(load_robot("puma560"))
BEYOND = 10_000.0  # [Hz] more frames than a film has
JPEG_BEGIN = b"\xff\xd8\xff"


@pytest.fixture(scope="module")
def timeline() -> Timeline:
    page_folder()
    robot = vrs.Robot()
    robot.do("DRIVE 1, 90, 100")
    return robot.timeline


def pixels(written: bytes) -> list[np.ndarray]:
    from PIL import Image, ImageSequence

    frames = ImageSequence.Iterator(Image.open(io.BytesIO(written)))
    return [np.array(frame.convert("RGB")).astype(int) for frame in frames]


@pytest.mark.long
@needs_chromium
def test_a_still_has_the_arm_and_is_the_same_each_time(timeline: Timeline) -> None:
    taken = []
    with alone():
        for t in (0.0, 0.0, timeline.end):
            stream = io.BytesIO()
            PICTURES["png"].write(stream, ARM, timeline, t)
            taken.append(stream.getvalue())
    first, second, last = (pixels(one)[0] for one in taken)
    assert first.shape == (640, 960, 3)
    assert (first == second).all()
    cream = (first[:, :, 0] - first[:, :, 2] > 15) & (first[:, :, 0] > 200)
    assert cream.mean() > 0.02, "the arm"
    assert (np.abs(first - last).max(axis=2) > 30).mean() > 0.02


@needs_chromium
def test_a_moving_picture_moves(timeline: Timeline, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(pictures, "GIF_SIZE", (240, 160))
    stream = io.BytesIO()
    with alone():
        PICTURES["gif"].write(stream, ARM, timeline, 2.0 / (timeline.end - timeline.start))
    first, middle, last = pixels(stream.getvalue())
    assert first.shape == (160, 240, 3)
    for one, other in ((first, middle), (middle, last)):
        assert (np.abs(one - other).max(axis=2) > 30).mean() > 0.01


def test_a_caption_has_robot_time_and_command(timeline: Timeline) -> None:
    assert caption(ARM, timeline, 0.3999, "PUMA") == "PUMA   0.3 s   DRIVE 1, 90, 100"
    assert caption(ARM, timeline, timeline.end + 1.0, "PUMA").endswith(" s")


def test_a_film_of_too_many_frames_is_refused(timeline: Timeline) -> None:
    with pytest.raises(PictureError, match=r"more than a film has \(600\).*give --rate \d"):
        PICTURES["gif"].write(io.BytesIO(), ARM, timeline, BEYOND)


def test_a_film_that_ffmpeg_does_not_make_is_said_to_be_none(
    timeline: Timeline, monkeypatch: pytest.MonkeyPatch
) -> None:
    @contextmanager
    def frames(*_: object) -> Iterator[Iterator[bytes]]:
        yield iter([JPEG_BEGIN] * 3)

    monkeypatch.setattr(pictures, "_frames", frames)
    monkeypatch.setattr(pictures, "find_ffmpeg", lambda: "false")
    with pytest.raises(PictureError, match="ffmpeg makes no film"):
        PICTURES["mp4"].write(io.BytesIO(), ARM, timeline, 10.0)


@pytest.mark.usefixtures("timeline")
def test_without_a_browser_it_is_said_what_there_is(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(pictures, "USUAL_PATHS", ())
    monkeypatch.setattr(pictures.shutil, "which", lambda _: None)
    with pytest.raises(PictureError, match=r"Chromium, Chrome or Edge draws it, and there is none .*--to html"):
        check_still()


@pytest.mark.usefixtures("timeline")
def test_without_ffmpeg_there_is_the_gif(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(pictures.shutil, "which", lambda name: None if name == "ffmpeg" else name)
    with pytest.raises(PictureError, match=r"ffmpeg makes films, and there is none .*--to gif"):
        check_mp4()


def test_a_browser_that_shows_nothing_is_given_up(timeline: Timeline, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(pictures, "find_browser", lambda: "true")
    with pytest.raises(PictureError, match="true shows nothing"):
        PICTURES["png"].write(io.BytesIO(), ARM, timeline, 0.0)
