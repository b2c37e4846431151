"""The view: what 50 pictures a second of a moving arm cost, and how soon the first one is there:
`python -m benchmarks view`.

The page is one in a headless Chromium, where there is one; it draws by software and takes the rest of the machine, so
that of motion only the time of the processor in this process is told. Where there is none, a socket that takes what it
is sent. The first picture is timed in a browser that is there already and has drawn something, as a user's has: its
first context for drawing takes software a second.
"""

from __future__ import annotations

import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from threading import Event, Thread

from tests.view3d.browser import chromium, missing
from tests.view3d.pages import Page
from vrs_cli.errors import VrsError
from vrs_cli.interfaces.dialogue import no_answer
from vrs_cli.interfaces.roles.supervisor import Supervisor
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.net.hosted import SHELL, Hosted
from vrs_cli.values.acts import Define
from vrs_cli.view3d.app import App
from vrs_cli.view3d.parts import Shown

SECONDS = 20.0  # of motion that are measured
SETTLED = 3.0  # [s] until the page has drawn what it was given at first
PROGRAM = """\
.PROGRAM spin()
DO
MOVE #PPOINT(60, -80, 80, 20, 40, 30)
MOVE #PPOINT(-60, -60, 60, -20, -40, -30)
UNTIL FALSE
.END
"""


def main() -> None:
    hosted = Hosted(load_robot("puma560"))
    try:
        _fifty(hosted)
    finally:
        hosted.close()
    _soon()


def _fifty(hosted: Hosted) -> None:
    """The share of a core, where the robot stands and where it moves."""
    app, pictures = App(hosted.hold), _Pictures()
    with _page(app.address) as kind:
        _until(lambda: app.windows)
        window = app.windows[0]
        window.parts.append(pictures)
        time.sleep(SETTLED)
        still, _ = _share(SECONDS / 4, pictures)
        program = Supervisor(hosted.hold(who=SHELL))
        program.act(Define(PROGRAM))
        Thread(target=_execute, args=(program,), daemon=True).start()
        time.sleep(SETTLED)
        moving, rate = _share(SECONDS, pictures)
        program.close()
    app.close()
    print(f"in {kind}; of a core, for the view, the robot and its server together:")
    print(f"  at rest {still:.1%}, while it moves {moving:.1%} (at most 15%), {rate:.1f} pictures a second")


def _execute(robot: Supervisor) -> None:
    """Until the robot is let go."""
    with suppress(VrsError):
        robot.say("EXECUTE spin", no_answer)


class _Pictures:
    """A part that counts."""

    count = 0

    def show(self, _shown: Shown) -> None:
        self.count += 1


def _share(seconds: float, pictures: _Pictures) -> tuple[float, float]:
    """Of a core, in this process; and pictures a second."""
    begun, worked, count = time.monotonic(), time.process_time(), pictures.count
    time.sleep(seconds)
    passed = time.monotonic() - begun
    return (time.process_time() - worked) / passed, (pictures.count - count) / passed


FIRST = """
(() => {
    let since = null;
    const look = () => {
        const seen = window.__viserMutable, drawing = window.__viserTestpoints?.rendererInfo.render;
        if (drawing && seen.nodeRefFromName["/robot/0/body0"]) since ??= drawing.frame;
        if (since === null || drawing.frame === since) return requestAnimationFrame(look);
        const gl = seen.canvas.getContext("webgl2");
        gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(4));
        window.vrsDrew = Date.now() / 1000;
    };
    look();
})();
"""  # when a frame with the robot in it is drawn to its last pixel
WARM = "data:text/html,<canvas id=c></canvas><script>c.getContext('webgl2').clear(0)</script>"


def _soon() -> None:
    """From the start of the command to an address, to a page that has the arm, and to a picture."""
    with _command() as (begun, address):
        told = time.time() - begun
        with Page(address) as page:
            page.until(lambda: page.of("SetPositionMessage"))
            sent = time.time() - begun
    print(f"its address is told after {told:.2f} s, the arm is sent after {sent:.2f} s")
    if missing() or "--socket" in sys.argv:
        return
    with chromium(calm=False) as browser:
        browser.open(WARM)
        browser.driver.execute_cdp_cmd("Page.addScriptToEvaluateOnNewDocument", {"source": FIRST})
        with _command() as (begun, address):
            browser.open(address)
            browser.until_page("window.vrsDrew")
            drawn = browser.run("return [vrsDrew, performance.timeOrigin / 1000]")
    print(f"the picture is there after {drawn[0] - begun:.2f} s (at most 3 s), {drawn[0] - drawn[1]:.2f} s in the page")


@contextmanager
def _command() -> Iterator[tuple[float, str]]:
    """`vrs view`: when it was begun [s], and its address."""
    begun = time.time()
    command = [sys.executable, "-m", "vrs_cli", "view", "--no-open"]
    process = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, text=True)
    try:
        assert process.stdout is not None
        yield begun, process.stdout.readline().split()[-1]
    finally:
        process.terminate()
        process.wait()


@contextmanager
def _page(address: str) -> Iterator[str]:
    """A browser with the page, and what it is called."""
    if missing() or "--socket" in sys.argv:
        with Page(address) as page:
            ended = Event()
            thread = Thread(target=lambda: [page.quiet(0.5) for _ in iter(ended.is_set, True)])
            thread.start()
            yield f"a page without a browser ({missing()})"
            ended.set()
            thread.join()
    else:
        with chromium() as browser:
            browser.open(address, "/robot", "/tool")
            yield "Chromium"


def _until(found: Callable[[], object]) -> None:
    while not found():
        time.sleep(0.01)


if __name__ == "__main__":
    main()
