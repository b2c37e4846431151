"""Make the pictures of the documentation that show the robot itself: a browser of this machine draws them.

    python -m docs.make_scenes [NAME ...]

pick.webp is an arm that does what pick_and_place.v2 says, drive.webp one beside the prompt that moves it, window.webp a
page of `vrs view`, puma.webp the joints of the PUMA 560, oat.webp the angles O, A and T, configurations.webp one place
reached in four ways, ways.webp a cut, and a line that is refused. Needs Pillow and Chromium; window.webp also
Playwright.
"""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from io import BytesIO
from itertools import groupby
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

import vrs_cli as vrs
from vrs_cli.engine.position import position_at
from vrs_cli.files.cell_file import read_cell
from vrs_cli.interfaces.monitor.explaining import sketch
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.forms import arm_for
from vrs_cli.kinematics.joints import Joints
from vrs_cli.kinematics.model import joint_axes, link_frames
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.kinematics.transform import Vector
from vrs_cli.language.run.signals import Cell
from vrs_cli.net.page_data import recorded_page
from vrs_cli.render.pictures import FINE, READY, BrowserPage, browser_page, page
from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.wire.codec import table_of

ROOT = Path(__file__).parent.parent
IMAGES = ROOT / "docs" / "images"
MONO = "DejaVuSansMono.ttf"
DARK, PAPER, INK, BLUE, ORANGE = (30, 34, 40), (222, 226, 230), (40, 46, 54), (36, 96, 190), (214, 110, 40)
PANEL = (440, 440)  # [px] of each picture in a row of several
FIELD = 0.66  # [rad] of view of the page, from top to bottom

Points = NDArray[np.float64]


class Place:
    """A picture of the page with one arm, seen from where one likes."""

    def __init__(self, seen: BrowserPage, size: tuple[int, int], arm: RobotArm) -> None:
        self.arm, self.size, self._page = arm, size, seen
        self.eye: Vector = (2.0, 1.4, 0.9)
        self.aim: Vector = (0.0, 0.05, 0.0)

    def look(self, eye: Vector, aim: Vector) -> None:
        self.eye, self.aim = eye, aim
        self.do(f"scene.stage.camera.position.set(...{json.dumps(eye)})")
        self.do(f"scene.stage.controls.target.set(...{json.dumps(aim)}), scene.stage.controls.update()")

    def show(self, *layers: str) -> None:
        """Show these layers and no others."""
        self.do(f"for (const layer of scene.layers) layer.set({json.dumps(layers)}.includes(layer.name))")

    def do(self, statement: str) -> None:
        self._page.evaluate(f"{{ {statement}; scene.stage.change(true) }}")

    def picture(self, t: float) -> Image.Image:
        """The moment t [s]."""
        self._page.evaluate(f"take({t!r}, '')")
        return Image.open(BytesIO(self._page.picture("png"))).convert("RGB")

    def seen(self, point: Sequence[float]) -> tuple[float, float]:
        """Where a point of the scene [m] is in the picture [px]."""
        forward = np.array(self.aim) - self.eye
        forward /= np.linalg.norm(forward)
        right = np.cross(forward, (0.0, 0.0, 1.0))
        right /= np.linalg.norm(right)
        x, y, depth = np.array((right, np.cross(right, forward), forward)) @ (np.array(point) - self.eye)
        scale = 0.5 * self.size[1] / np.tan(0.5 * FIELD) / depth
        return 0.5 * self.size[0] + scale * x, 0.5 * self.size[1] - scale * y


@contextmanager
def shown(size: tuple[int, int], timeline: Timeline, cell: Cell | None = None) -> Iterator[Place]:
    """A PUMA 560 that moves."""
    arm = arm_for(load_robot("puma560"))
    with _opened(size, arm, recorded_page(arm, timeline, cell=cell, picture=FINE)) as place:
        yield place


@contextmanager
def posed(size: tuple[int, int], poses: Sequence[Joints]) -> Iterator[Place]:
    """A PUMA 560 that stands at joints [rad] from 0 s on, at the next ones from 1 s on, and so on, out of range too."""
    arm = arm_for(load_robot("puma560"))
    data = recorded_page(arm, vrs.Robot().timeline, picture=FINE)
    (first, *_) = data["snapshot"]["segments"]
    data["snapshot"]["segments"] = [
        {**first, "start": float(k), "finish": k + 1.0, "joints": [[x] for x in q]} for k, q in enumerate(poses)
    ]
    with _opened(size, arm, data) as place:
        place.show()
        yield place


@contextmanager
def _opened(size: tuple[int, int], arm: RobotArm, data: dict[str, Any]) -> Iterator[Place]:
    with TemporaryDirectory() as folder, browser_page() as seen:
        file = Path(folder) / "page.html"
        file.write_text(page(data), encoding="utf-8")
        seen.open(file.as_uri(), size)
        seen.evaluate(READY)
        yield Place(seen, size, arm)


def row(pictures: Sequence[Image.Image]) -> Image.Image:
    """Beside each other."""
    width, height = pictures[0].size
    whole = Image.new("RGB", (width * len(pictures), height))
    for k, picture in enumerate(pictures):
        whole.paste(picture, (k * width, 0))
    return whole


def titled(picture: Image.Image, title: str) -> Image.Image:
    """With a line of text above it."""
    whole = Image.new("RGB", (picture.width, picture.height + 28), "white")
    whole.paste(picture, (0, 28))
    ImageDraw.Draw(whole).text((10, 5), title, INK, ImageFont.truetype(MONO, 15))
    return whole


def save(picture: Image.Image, name: str) -> None:
    picture.save(IMAGES / f"{name}.webp", quality=82, method=6)


# --- the arm beside the prompt ---------------------------------------------------------------------------------------

LESSON = (
    "SET part = TRANS(0, 550, -250, 90, 90, 0)",
    "APPRO part, 150",
    "MOVES part",
    "CLOSEI",
    "DEPARTS 200",
    "MOVE #PPOINT(60, -110, 120, 0, 60, 0)",
    "READY",
)
RATE = 10.0  # [1/s]
PROMPT, SCENE = (400, 380), (440, 380)  # [px]
MOST_LINES = 12  # of the prompt that are seen


def drive() -> None:
    robot = vrs.Robot()
    begins = []
    for line in LESSON:
        begins.append(robot.now)
        robot.do(line)
    timeline, arm = robot.timeline, arm_for(load_robot("puma560"))
    times = np.append(np.arange(0.0, timeline.end, 1.0 / RATE), [timeline.end] * 10)
    with shown(SCENE, timeline) as place:
        place.show("path", "goal")
        place.look((2.75, 1.95, 0.85), (0.0, 0.12, 0.14))
        frames = []
        for t in times.tolist():
            said = [line for line, begin in zip(LESSON, begins, strict=True) if begin <= t]
            frames.append(row_of(prompt(said, position_at(arm, timeline, t).T_world_tool), place.picture(t)))
    film(frames, "drive")


def pick() -> None:
    film(acted("pick_and_place", (1.75, 2.05, 0.6), (0.05, 0.3, 0.08)), "pick")


def acted(name: str, eye: Vector, aim: Vector) -> list[Image.Image]:
    """The motions of a sample program beside the arm and the cell of the program, seen from `eye` to `aim` [m]."""
    robot = vrs.Robot()
    robot.run(ROOT / "programs" / f"{name}.v2")
    timeline, arm = robot.timeline, arm_for(load_robot("puma560"))
    begins = list[tuple[str, float]]()
    for _, segments in groupby(timeline, lambda segment: segment.motion.number):
        first = next(segments)
        if first.motion.text not in ("", "TOOL"):
            begins.append((first.motion.text, first.start))
    times = np.append(np.arange(0.0, timeline.end, 1.0 / RATE), [timeline.end] * 10)
    with shown(SCENE, timeline, read_cell(str(ROOT / "programs" / f"{name}.toml"))) as place:
        place.show("parts")
        place.look(eye, aim)
        frames = []
        for t in times.tolist():
            said = [line for line, begin in begins if begin <= t]
            frames.append(row_of(prompt(said, position_at(arm, timeline, t).T_world_tool), place.picture(t)))
    return frames


def film(frames: Sequence[Image.Image], name: str) -> None:
    """Save frames that follow each other as a moving picture."""
    frames[0].save(
        IMAGES / f"{name}.webp",
        save_all=True,
        append_images=frames[1:],
        duration=round(1000 / RATE),
        quality=60,
        method=4,
    )


def row_of(left: Image.Image, right: Image.Image) -> Image.Image:
    whole = Image.new("RGB", (left.width + right.width, left.height))
    whole.paste(left, (0, 0))
    whole.paste(right, (left.width, 0))
    return whole


def prompt(said: Sequence[str], T: Sequence[float]) -> Image.Image:
    """The lines that were typed, and where the tool is."""
    picture = Image.new("RGB", PROMPT, DARK)
    drawing, font = ImageDraw.Draw(picture), ImageFont.truetype(MONO, 15)
    for k, line in enumerate((*said, "")[-MOST_LINES:]):
        drawing.text((16, 18 + 26 * k), ".", PAPER, font)
        drawing.text((25, 18 + 26 * k), line, (240, 190, 120) if line else PAPER, font)
    x, y, z = (1000.0 * T[k] for k in (3, 7, 11))
    drawing.text((16, PROMPT[1] - 36), f"x {x:7.1f}  y {y:7.1f}  z {z:7.1f} mm", (140, 190, 240), font)
    return picture


# --- the page --------------------------------------------------------------------------------------------------------

PAGE = (1400, 800)  # [px]
PROGRAM = ROOT / "programs" / "pick_and_place.v2"
STOPPED = 4.85  # [s] after it began, where it is shown: on its way back


def window() -> None:
    """`vrs view pick_and_place.v2`, while the arm is on its way."""
    from tests.page import browser

    command = [sys.executable, "-m", "vrs_cli", "view", "--no-open", str(PROGRAM)]
    with browser.alone(), browser.running_chromium() as chromium, browser.window(chromium, size=PAGE) as seen:
        running = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, text=True)
        try:
            assert running.stdout is not None
            seen.goto(running.stdout.readline().split()[-1])
            browser.drawn(seen)
            browser.until(seen, "document.body.innerText.includes('Program completed')")
            seen.evaluate("t => app.playback.seek(app.source.timeline.segments[1].start + t)", STOPPED)
            seen.evaluate("scene.stage.fix(0)")
            seen.wait_for_timeout(1000)  # the picture that stays is finer
            save(Image.open(BytesIO(seen.screenshot())).convert("RGB"), "window")
        finally:
            running.terminate()
            running.wait()


# --- the joints ------------------------------------------------------------------------------------------------------


SHIFTED = (0.34, 0.14, 0.14, -0.2, 0.0, 0.2)  # [m] along itself: where an axis is marked, beside others


def puma() -> None:
    ready, zero = load_robot("puma560").poses["ready"], (0.0,) * 6
    with posed(PANEL, (zero, ready)) as place:
        place.look((2.5, 2.25, 1.15), (0.0, 0.05, 0.3))
        pictures = [
            titled(axes(place, q, place.picture(k + 0.5)), title)
            for k, (q, title) in enumerate(((zero, "all joints 0"), (ready, "READY: 0, -90, 90, 0, 0, 0")))
        ]
    save(row(pictures), "puma")


def axes(place: Place, q: Joints, picture: Image.Image) -> Image.Image:
    """Draw the axis of each joint into a picture of the arm at these joints."""
    drawing, font = ImageDraw.Draw(picture), ImageFont.truetype(MONO, 15)
    model = place.arm.model
    zero, now = link_frames(model, (0.0,) * 6), link_frames(model, q)
    for k, axis in enumerate(joint_axes(model)):
        T = whole(now[k]) @ np.linalg.inv(whole(zero[k]))
        along = T[:3, :3] @ axis.direction
        foot = T[:3, :3] @ axis.point + T[:3, 3] + SHIFTED[k] * along
        tip = foot + 0.24 * along
        drawing.line([place.seen(foot), place.seen(tip)], ORANGE, 3)
        x, y = place.seen(tip)
        drawing.ellipse((x - 4, y - 4, x + 4, y + 4), ORANGE)
        drawing.text((x + 7, y - 9), f"JT{k + 1}", ORANGE, font, stroke_width=3, stroke_fill="white")
    frame(place, drawing, np.eye(4), "world")
    frame(place, drawing, whole(place.arm.forward(q)), "tool")
    return picture


def frame(place: Place, drawing: ImageDraw.ImageDraw, T: Points, name: str) -> None:
    """The axes of a frame, seen through the arm."""
    font, origin = ImageFont.truetype(MONO, 13), T[:3, 3]
    for k, (colour, letter) in enumerate((("red", "X"), ("green", "Y"), ("blue", f"{name} Z"))):
        tip = origin + 0.2 * T[:3, k]
        drawing.line([place.seen(origin), place.seen(tip)], colour, 2)
        x, y = place.seen(tip + 0.03 * T[:3, k])
        drawing.text((x + 5, y), letter, colour, font, "rm", stroke_width=2, stroke_fill="white")


def whole(T: Sequence[float]) -> Points:
    return np.vstack([np.array(T).reshape(3, 4), (0.0, 0.0, 0.0, 1.0)])


# --- O, A and T ------------------------------------------------------------------------------------------------------

TURNED = ((90, 0, 0), (90, 90, 0), (135, 90, 0), (135, 120, 0), (135, 120, 45))
AT = (300.0, 500.0, 0.0)  # [mm]


def oat() -> None:
    robot = vrs.Robot()
    with posed((300, 320), [reached(robot, vrs.trans(*AT, o, a, t)) for o, a, t in TURNED]) as place:
        x, y, z = (0.001 * number for number in AT)
        place.show("frames")
        place.look((x + 0.75, y + 0.75, z + 0.35), (x - 0.02, y - 0.02, z + 0.02))
        pictures = [titled(place.picture(k + 0.5), f"O {o}, A {a}, T {t}") for k, (o, a, t) in enumerate(TURNED)]
    save(row(pictures), "oat")


def reached(robot: vrs.Robot, location: vrs.Location, words: str = "") -> Joints:
    """The joints [rad] of a way to a location in a configuration: a usable one where there is one."""
    ways = robot.ik(location)
    rows = list(zip(ways.configurations, ways.joints, ways.usable, strict=True))
    fitting = [(not use, k) for k, (name, _, use) in enumerate(rows) if words in name]
    return tuple(np.radians(rows[min(fitting)[1]][1]).tolist())


# --- configurations --------------------------------------------------------------------------------------------------


PART = vrs.trans(350, 450, 100, 90, 90, 0)


def configurations() -> None:
    robot, ways = vrs.Robot(), ("RIGHTY ABOVE", "RIGHTY BELOW", "LEFTY ABOVE", "LEFTY BELOW")
    with posed((320, 340), [reached(robot, PART, words) for words in ways]) as place:
        place.look((2.3, 1.5, 0.9), (0.1, 0.15, 0.05))
        pictures = []
        for k, words in enumerate(ways):
            rows = robot.ik(PART)
            usable = any(use for name, use in zip(rows.configurations, rows.usable, strict=True) if words in name)
            pictures.append(titled(place.picture(k + 0.5), words if usable else f"{words} (out of range)"))
    save(row(pictures), "configurations")


# --- a timeline with a blend and a cut, and a line that is refused ----------------------------------------------------

DEMO = """.PROGRAM demo()
    MOVE start
    MOVES mid
    MOVES finish
    MOVE #away AT 2.2
.END
.LOCATIONS
start     -300 450 -200 90 90 0
mid        200 450 -200 90 90 0
finish     200 650 100 90 90 0
#away      40 -60 120 0 45 0
.END
"""
LARGE = (640, 460)  # [px]


def ways() -> None:
    """The arm where the motion to `mid` is cut; and why a line through the robot is refused."""
    robot = vrs.Robot()
    robot.define(DEMO)
    robot.execute("demo")
    with shown(LARGE, robot.timeline) as place:
        place.show("path", "commands")
        place.look((1.58, 2.7, 0.84), (-0.05, 0.3, 0.06))
        cut = titled(place.picture(2.2), "MOVES mid is cut at 2.2 s by MOVE #away AT 2.2")
    start = vrs.Robot().move(vrs.trans(400, 450, -100, 90, 90, 0))
    (report,) = start.why(vrs.trans(-350, -450, -100, 90, 90, 0))
    with shown(LARGE, start.timeline) as place:
        place.show()
        place.look((1.9, -0.7, 1.5), (0.1, 0.12, 0.0))
        place.picture(start.end)
        place.do(f"scene.explain({json.dumps(table_of(sketch(report)))})")
        refused = titled(place.picture(start.end), "WHY: how far the straight line can be followed")
    save(row((cut, refused)), "ways")


SCENES = {scene.__name__: scene for scene in (pick, drive, window, puma, oat, configurations, ways)}


def main(names: Sequence[str]) -> int:
    for name in names or SCENES:
        SCENES[name]()
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
