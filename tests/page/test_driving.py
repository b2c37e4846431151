"""Test driving from the page: typing, editing, running, moving by hand, dragging and stopping."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from signal import SIGKILL
from typing import TYPE_CHECKING, Any

import pytest

from tests.live import until as until_here
from tests.net.serving import Serving, serving
from tests.page.browser import CHROMIUM, FLAGS, address, drawn, open_robot, until, window
from vrs_cli.net.http import ServedPage
from vrs_cli.net.tokens import add_tokens
from vrs_cli.render.text import styled_lines

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

DEMO = ".PROGRAM demo\nFOR i = 1 TO 3\nTYPE i\nDRIVE 1, 10\nDRIVE 1, -10\nBREAK\nEND\n.END"
HOSTILE = '<img src=x onerror="document.title=1">'
DIAGNOSES = """(() => {
    window.diagnoses = 0;
    const mistake = document.querySelector('.prompt-mistake');
    new MutationObserver(() => mistake.hidden || diagnoses++).observe(mistake, { childList: true, attributes: true });
})()"""
SLIDE = "(one, to) => { one.value = to; one.dispatchEvent(new Event('input')); }"
TEXT_OF = "document.querySelector('{}')?.textContent"


class Driver:
    """A user at a page."""

    def __init__(self, page: Page) -> None:
        self.page = page
        self.field = page.locator("[data-slot=prompt] .cm-content")

    def type(self, text: str) -> None:
        """Type a text and Enter."""
        self.field.click()
        self.page.keyboard.insert_text(text)
        self.page.keyboard.press("Enter")

    def sees(self, text: str, where: str = "[data-slot=output]") -> None:
        until(self.page, f"{TEXT_OF.format(where)}?.includes(x)", text)

    def holds(self, text: str) -> None:
        """Wait until the field has a text."""
        until(self.page, f"{TEXT_OF.format('[data-slot=prompt] .cm-line')} === x", text)

    def edits(self, text: str) -> None:
        """Wait until the editor has a line with a text."""
        until(
            self.page, "[...document.querySelectorAll('.editor .cm-line')].some((one) => one.textContent === x)", text
        )

    def press(self, name: str) -> None:
        self.page.get_by_role("button", name=name, exact=True).first.click()

    def tab(self, name: str) -> None:
        self.page.locator(f"#to-{name}").click()

    def joint(self, number: int, at: float, within: float = 0.1) -> None:
        """Wait until the joint rests at a value [deg]."""
        q = f"app.source.timeline.segments.at(-1).joints?.[{number - 1}].reduce((r, a, i) => r + a * (\
app.source.timeline.segments.at(-1).finish - app.source.timeline.segments.at(-1).start) ** i, 0) * 180 / Math.PI"
        until(self.page, f"Math.abs({q} - x) < {within}", at)


@pytest.fixture
def served(built: Path, tmp_path: Path) -> Iterator[Serving]:
    """Serve one robot in real time with the page."""
    with serving(tmp_path, pages=ServedPage.read(built), realtime=1.0, styled=styled_lines) as it:
        yield it


@pytest.fixture
def ada(shown: Page) -> Driver:
    until(shown, "app.surveyed !== null")
    return Driver(shown)


def test_lines_are_typed_mended_completed_and_brought_back(ada: Driver) -> None:
    ada.type("TYPE 6*7")
    ada.sees(" 42")
    ada.type("MOVEE a")
    ada.sees("did you mean MOVE?", ".prompt-mistake")
    ada.holds("MOVEE a")
    until(ada.page, f"{TEXT_OF.format('.prompt-line .cm-lintRange-error')} === 'MOVEE'")
    assert "MOVEE" not in ada.page.locator(".transcript").inner_text(), "it was not sent"
    ada.page.keyboard.press("Control+a")
    ada.page.evaluate(DIAGNOSES)
    ada.type("MOVEE")  # all of it is the word that was typed last
    until(ada.page, "diagnoses >= 2")  # as it was sent, and a while after it was put back
    ada.sees("did you mean MOVE?", ".prompt-mistake")
    assert ada.page.locator(".prompt-mistake").is_visible(), "it stays"
    ada.page.keyboard.press("Control+a")
    ada.page.keyboard.type("DEPA")
    until(ada.page, "document.querySelector('.cm-tooltip-autocomplete li')?.textContent.startsWith('DEPART')")
    ada.page.keyboard.press("Tab")
    ada.holds("DEPART")
    ada.page.keyboard.press("Control+a")
    ada.page.keyboard.press("Delete")
    ada.page.keyboard.press("ArrowUp")
    ada.holds("TYPE 6*7")
    ada.page.reload()
    drawn(ada.page)
    ada.sees(" 42")
    ada.field.click()
    ada.page.keyboard.press("Control+r")
    ada.page.keyboard.type("6*")
    until(ada.page, "document.querySelector('.cm-tooltip-autocomplete li')?.textContent === 'TYPE 6*7'")


@pytest.mark.long
def test_a_program_is_pasted_stepped_edited_and_kept(ada: Driver) -> None:
    page = ada.page
    ada.type(DEMO)
    ada.tab("Programs")
    ada.edits("        DRIVE 1, 10")
    page.locator(".cm-lineNumbers .cm-gutterElement", has_text="4").click()
    until(
        page, "document.querySelectorAll('.cm-breakpoints .cm-gutterElement .breakpoint').length === 2"
    )  # one is unseen
    ada.press("Run")
    until(page, f"{TEXT_OF.format('.editor .step-stands')}?.trim() === 'DRIVE 1, -10'")
    ada.press("Step")
    until(page, f"{TEXT_OF.format('.editor .step-stands')}?.trim() === 'BREAK'")
    ada.press("Abort")
    ada.sees("(ABORTED)")
    page.locator(".editor .cm-line").nth(3).click()
    page.keyboard.press("End")
    page.keyboard.press("Enter")
    page.keyboard.type("MOVEE")
    ada.sees("Step 4: Unknown instruction: MOVEE", ".editor-message")
    until(page, "document.querySelector('.cm-lintRange-error') !== null")
    page.reload()
    drawn(page)
    ada.edits("        MOVEE")
    page.locator(".editor .cm-line").nth(4).click()
    page.keyboard.press("Home")
    page.keyboard.press("Shift+End")
    page.keyboard.type('TYPE "changed"')
    page.keyboard.press("Control+s")
    ada.sees("Program demo: 7 steps")
    ada.edits('        TYPE "changed"')


@pytest.mark.long
def test_questions_are_answered_by_buttons_and_in_a_field(ada: Driver) -> None:
    ada.type('.PROGRAM ask\nPROMPT "How many? ", n\nTYPE "got", n\n.END')
    ada.sees("Program ask: 2 steps")
    ada.type("EXECUTE ask")
    ada.sees("How many?", "[data-slot=questions]")
    ada.page.keyboard.type("7")
    ada.page.keyboard.press("Enter")
    ada.sees("got 7")
    ada.type("ZERO")
    ada.sees("Are you sure", "[data-slot=questions]")
    ada.press("No")
    ada.sees("Nothing is deleted")
    until(ada.page, "!document.querySelector('.question')")


def test_hostile_text_stays_text_and_long_output_fast(ada: Driver) -> None:
    page = ada.page
    ada.type('TYPE "<img src=x onerror=document.title=1>"')
    ada.sees("<img src=x onerror=")
    assert page.locator(".transcript img").count() == 0
    page.evaluate(
        "text => { commands.transcript.say([[[text, text]]]); commands.note(text); commands.type(text) }", HOSTILE
    )
    seconds = page.evaluate("""() => {
        const begun = performance.now();
        for (let i = 0; i < 100000; i++) commands.transcript.type(`line ${i} `.repeat(3), true);
        commands.transcript.type('z'.repeat(1e6), true);
        return (performance.now() - begun) / 1000;
    }""")
    assert seconds < 5.0
    until(page, "document.querySelectorAll('.transcript > div').length <= 2000")
    ada.sees("line 99999")
    until(
        page,
        "(({ scrollTop, scrollHeight, clientHeight }) => scrollTop + clientHeight > scrollHeight - 5)"
        "(document.querySelector('[data-slot=output]'))",
    )
    assert page.locator(".transcript img").count() == 0
    assert page.title() == "cell1"


def test_the_arm_is_slid_stepped_held_and_stopped(ada: Driver) -> None:
    page = ada.page
    ada.tab("Move")
    slider = page.locator(".slider-row input[type=range]").nth(1)
    slider.evaluate(SLIDE, 20)
    ada.sees("JOG 1, 20")
    ada.joint(1, 20.0)
    ada.press("Joints")
    ada.press("plus joint 1")
    ada.sees("JOG 1, 10")
    ada.joint(1, 30.0)
    ends = "app.source.timeline.end"
    minus = page.get_by_role("button", name="minus joint 1", exact=True)
    minus.focus()
    before = page.evaluate(ends)
    page.keyboard.down("Enter")
    until(page, f"{ends} > x", before)
    page.keyboard.press("Control+.")
    ada.sees("STOPPED", "[data-slot=stop]")
    ada.sees("let the button go")
    stands = page.evaluate(ends)
    page.keyboard.up("Enter")
    until(page, "app.connection.now() > x", stands + 0.5)
    assert page.evaluate(ends) == stands, "nothing moves it after STOP until the button is pressed anew"
    ada.press("Undo")
    ada.sees("UNDO")


@pytest.mark.parametrize("stop", ["STOP", "ABORT"])
def test_a_slider_that_does_not_rest_yet_moves_nothing_after_a_stop(ada: Driver, stop: str) -> None:
    page, ends = ada.page, "app.source.timeline.end"
    ada.tab("Move")
    slider = page.locator(".slider-row input[type=range]").nth(1)
    stopping = "document.querySelector('.stop').click()" if stop == "STOP" else "commands.command('ABORT')"
    slider.evaluate(f"(one) => {{ ({SLIDE})(one, 20); {stopping}; }}")
    until(page, "app.connection.now() > x", page.evaluate("app.connection.now()") + 0.7)
    assert page.evaluate(ends) == 0.0
    slider.evaluate(SLIDE, 20)
    ada.joint(1, 20.0)


def test_a_slider_that_waits_for_the_jog_before_it_moves_nothing_after_an_abort_of_another(
    ada: Driver, chromium: Browser, served: Serving
) -> None:
    page, ends = ada.page, "app.source.timeline.end"
    with window(chromium) as other:
        open_robot(other, served)
        ada.tab("Move")
        ada.type("SPEED 5")
        ada.type("JOG 1, 90")
        until(page, f"{ends} > app.connection.now() + 2")
        page.evaluate("commands.waits = () => true")  # as long as the answer to JOG is on its way
        page.locator(".slider-row input[type=range]").nth(1).evaluate(SLIDE, 120)
        Driver(other).type("ABORT")
        until(page, "app.source.timeline.segments.at(-1).motion.text === 'BRAKE'")
        stands = page.evaluate(ends)
        page.evaluate("commands.waits = () => false")
        until(page, "app.connection.now() > x", stands + 0.7)
        assert page.evaluate(ends) == stands


def test_a_short_click_across_a_stop_moves_nothing(ada: Driver) -> None:
    """The button is pressed, somebody stops the robot, and the button is let go before it counts as held."""
    page, ends = ada.page, "app.source.timeline.end"
    ada.tab("Move")
    ada.press("Joints")
    plus = page.get_by_role("button", name="plus joint 1", exact=True)
    key = "one.dispatchEvent(new KeyboardEvent('{}', {{ key: 'Enter' }}))"
    stop = "commands.connection.tell('pulled', { state: { why: 'somebody has stopped the robot' } })"
    plus.evaluate(f"(one) => {{ {key.format('keydown')}; {stop}; {key.format('keyup')}; }}")
    until(page, "app.connection.now() > x", page.evaluate("app.connection.now()") + 0.7)
    assert page.evaluate(ends) == 0.0
    plus.evaluate(f"(one) => {{ {key.format('keydown')}; {key.format('keyup')}; }}")
    ada.joint(1, 10.0)


def test_a_slider_moves_nothing_after_an_abort_of_another_of_an_arm_at_rest(
    ada: Driver, chromium: Browser, served: Serving
) -> None:
    page = ada.page
    with window(chromium) as other:
        open_robot(other, served)
        ada.tab("Move")
        page.evaluate("commands.waits = () => true")  # as long as the answer to JOG is on its way
        page.evaluate("void app.connection.on('pulled', ({ state }) => { window.told = state.why })")
        page.locator(".slider-row input[type=range]").nth(1).evaluate(SLIDE, 120)
        Driver(other).type("ABORT")
        until(page, "window.told")
        page.evaluate("commands.waits = () => false")
        until(page, "app.connection.now() > x", page.evaluate("app.connection.now()") + 0.7)
        assert page.evaluate("app.source.timeline.end") == 0.0


@pytest.mark.long
def test_the_arm_stops_when_a_browser_is_killed_that_holds_jog(ada: Driver, chromium: Browser, served: Serving) -> None:
    """Each message of a held button commands 0.5 s; then the arm slows down. The lease is kept."""
    room = served.hub.rooms["cell1"]
    engine = room.session.engine
    killed = chromium.browser_type.launch(executable_path=CHROMIUM, args=list(FLAGS))
    processes = killed.new_browser_cdp_session().send("SystemInfo.getProcessInfo")["processInfo"]
    (process,) = [one["id"] for one in processes if one["type"] == "browser"]
    page = killed.new_page()
    open_robot(page, served)
    until(page, "app.surveyed !== null")
    eve = Driver(page)
    eve.tab("Move")
    eve.press("Joints")
    page.get_by_role("button", name="plus joint 1", exact=True).focus()
    page.keyboard.down("Enter")
    until(page, "app.source.timeline.end > 2")
    os.kill(process, SIGKILL)
    ahead = engine.timeline.end - engine.now
    until_here(lambda: len(served.server._links) == 1, "the server knows that one page is gone")
    stands = engine.timeline.end
    assert 0 < ahead < 1, "it was held, and is led no farther"
    assert room.driving.lease.holder == "browser-2"
    until(ada.page, "app.connection.now() > x", stands + 0.5)
    assert engine.timeline.end == stands
    ada.type("JOG 1, 5")
    ada.sees("browser-2 drives", "[data-slot=drives]")


def test_signals_are_lamps_and_switches(ada: Driver) -> None:
    ada.tab("Signals")
    ada.page.locator("[data-signal='1003']").click()
    until(ada.page, "document.querySelector(\"[data-signal='1003']\").ariaPressed === 'true'")
    ada.type("SIGNAL -1003, 42")
    until(ada.page, "document.querySelector(\"[data-signal='1003']\").ariaPressed === 'false'")
    until(ada.page, "document.querySelector(\"[data-signal='42']\")?.ariaPressed === 'true'")


@pytest.mark.long
def test_the_tool_is_dragged_and_recorded(ada: Driver) -> None:
    page = ada.page
    ada.type("READY")
    ada.tab("Drag")
    until(page, "scene.gizmo.enabled() && app.source.now() > app.source.timeline.end")
    ada.press("Record a program")
    result: dict[str, Any] = page.evaluate("""async () => {
        const { positions } = await app.connection.ask('positions', { times: [app.connection.now()] });
        const place = positions[0].T_world_tool;
        const delays = [];
        for (let i = 1; i <= 30; i++) {
            const wish = Float64Array.from(place);
            wish[11] -= 0.003 * i;
            const changed = new Promise((done) => { const end = app.connection.on('change', () => (end(), done())); });
            const begun = performance.now();
            scene.gizmo.onDrag(wish);
            await Promise.race([changed, new Promise((done) => setTimeout(done, 500))]);
            delays.push(performance.now() - begun);
        }
        scene.gizmo.onDrag(null);
        return { delays: delays.sort((a, b) => a - b) };
    }""")
    assert result["delays"][15] < 200.0, "half of the wishes have moved the arm by then [ms]"
    until(page, "app.source.now() > app.source.timeline.end")
    ada.press("End the program")
    ada.sees("part is in memory")


@pytest.mark.long
def test_two_pages_share_a_robot_by_the_lease(ada: Driver, chromium: Browser, served: Serving) -> None:
    ada.type("JOG 1, 5")
    ada.sees("You drive", "[data-slot=drives]")
    with window(chromium) as other:
        open_robot(other, served)
        bob = Driver(other)
        bob.sees("browser drives", "[data-slot=drives]")
        bob.press("Ask to drive")
        ada.sees("would like to drive")
        ada.press("Give to browser-2")
        bob.sees("You drive", "[data-slot=drives]")
        ada.sees("browser-2 drives", "[data-slot=drives]")
        ada.tab("Move")
        until(ada.page, "document.querySelector('.move').hidden")
    ada.sees("Nobody drives", "[data-slot=drives]")


@pytest.mark.long
def test_without_a_connection_what_is_typed_is_dropped_and_stop_says_so(ada: Driver, served: Serving) -> None:
    served.stop()
    served.stop = lambda: None  # it is stopped once
    ada.sees("no connection", "[data-slot=stop]")
    ada.type("JOG 1, 5")
    ada.sees("Not given, for there is no connection to the robot: JOG 1, 5")
    ada.press("STOP: no connection")
    ada.sees("NOT STOPPED", "[data-slot=stop]")
    ada.sees("did not reach the robot", "[data-slot=stop]")


@contextmanager
def guarded(folder: Path, built: Path, role: str) -> Iterator[tuple[Serving, str]]:
    file = folder / "tokens.toml"
    (token,) = add_tokens(file, ["eve"], role).values()
    with serving(folder, pages=ServedPage.read(built), tokens=file, realtime=1.0, styled=styled_lines) as it:
        yield it, f"{address(it)}#token={token}"


@pytest.mark.parametrize("role", ["observer", pytest.param("designer", marks=pytest.mark.long)])
def test_nothing_is_offered_that_a_role_forbids(page: Page, built: Path, tmp_path: Path, role: str) -> None:
    with guarded(tmp_path, built, role) as (_, url):
        page.goto(url)
        drawn(page)
        until(page, "app.surveyed !== null")
        labels = page.evaluate(
            "[...document.querySelectorAll('button')].filter((one) => !one.disabled && !one.hidden)"
            ".map((one) => one.textContent)"
        )
        told = json.dumps(labels)
        for forbidden in ("Run", "Save", "STOP", "Store all", "HERE"):
            assert forbidden not in labels, told
        assert ("Send" in labels) == (role == "designer")
        assert page.locator("#to-Move").is_visible() == (role == "designer")
        page.locator("#to-Signals").click()
        assert page.locator("[data-signal='1']").is_disabled()
