"""Pictures of a trajectory: the arm is in them, and moves."""

from __future__ import annotations

import io
from collections.abc import Iterator
from contextlib import nullcontext

import numpy as np
import pytest

import vrs_cli as product
from tests.view3d.browser import alone, changed, coloured, needs_browser
from vrs_cli.kinematics.forms import arm_for
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.view3d import needs, still
from vrs_cli.view3d.needs import PictureError, check_mp4, check_still
from vrs_cli.view3d.pictures import PICTURES

ARM = arm_for(load_robot("puma560"))
DARK = (44, 50, 58)  # about the colour of the foot and of the joints
BEYOND = 10_000.0  # [Hz] more frames than a film has


@pytest.fixture(scope="module")
def timeline() -> Timeline:
    robot = product.Robot()
    robot.do("DRIVE 1, 90, 100")
    return robot.timeline


@pytest.fixture
def small(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Software draws small pictures faster."""
    monkeypatch.setattr(still, "FILM_SIZE", (200, 140))
    monkeypatch.setattr(still, "PATIENCE", 300.0)
    with alone():
        yield


def frames(written: bytes) -> list[np.ndarray]:
    from PIL import Image, ImageSequence

    return [np.array(frame.convert("RGB")) for frame in ImageSequence.Iterator(Image.open(io.BytesIO(written)))]


@needs_browser
@pytest.mark.usefixtures("small")
def test_a_moving_picture_has_the_arm_and_moves(timeline: Timeline) -> None:
    stream = io.BytesIO()
    PICTURES["gif"].write(stream, ARM, timeline, 2.0 / (timeline.end - timeline.start))
    first, middle, last = frames(stream.getvalue())
    assert first.shape == (140, 200, 3)
    assert coloured(first, DARK) > 0.005
    assert changed(first, middle) > 0.02
    assert changed(middle, last) > 0.02


def test_a_moving_picture_keeps_the_colours_of_thin_lines() -> None:
    frame = np.empty((200, 200, 3), np.uint8)
    frame[:] = np.linspace(120, 250, 200)[:, None, None] - np.array((0, 4, 9)) + np.arange(200)[None, :, None] % 3
    lines = {60: (36, 96, 190), 90: (222, 120, 40), 120: (214, 40, 40)}
    for row, colour in lines.items():
        frame[row] = colour
    seen = np.array(still.in_few_colours(frame).convert("RGB")).astype(int)
    for row, colour in lines.items():
        assert np.abs(seen[row] - colour).max() < 30, colour


def test_a_film_of_too_many_frames_is_refused(timeline: Timeline) -> None:
    with pytest.raises(PictureError, match=r"more than a film has \(600\).*give --rate \d"):
        PICTURES["gif"].write(io.BytesIO(), ARM, timeline, BEYOND)


def test_a_film_that_ffmpeg_does_not_make_is_said_to_be_none(
    timeline: Timeline, monkeypatch: pytest.MonkeyPatch
) -> None:
    frames = [np.zeros((*still.FILM_SIZE[::-1], 3), np.uint8)] * 3
    monkeypatch.setattr(still, "_frames", lambda *_: nullcontext(iter(frames)))
    monkeypatch.setattr(still, "find_ffmpeg", lambda: "false")
    with pytest.raises(PictureError, match="ffmpeg makes no film"):
        PICTURES["mp4"].write(io.BytesIO(), ARM, timeline, 10.0)


def test_without_a_browser_it_is_said_what_there_is(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("viser")
    monkeypatch.setattr(needs, "ELSEWHERE", ())
    monkeypatch.setattr(needs.shutil, "which", lambda _: None)
    with pytest.raises(PictureError, match=r"Chromium, Chrome or Edge draws it, and there is none .*--to html"):
        check_still()


def test_without_ffmpeg_there_is_the_gif(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("viser")
    monkeypatch.setattr(needs.shutil, "which", lambda name: None if name == "ffmpeg" else name)
    with pytest.raises(PictureError, match=r"ffmpeg makes films, and there is none .*--to gif"):
        check_mp4()


def test_a_browser_that_shows_nothing_is_given_up(timeline: Timeline, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(still, "find_browser", lambda: "true")
    with pytest.raises(PictureError, match="true shows nothing"):
        PICTURES["png"].write(io.BytesIO(), ARM, timeline, 0.0)
