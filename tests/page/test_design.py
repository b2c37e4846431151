"""Test the layout of the page: readable in light and dark, without overflow at five sizes, usable by keys."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest

from tests.net.serving import Serving
from tests.page.browser import alone, axe, line, open_robot, until, window

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

SIZES = ((1400, 800), (1280, 720), (900, 700), (844, 390), (390, 844))  # [px]
LONG_NAME = "a-robot-with-the-longest-name-that-fits-"
CLOSED = "!document.querySelector('dialog[open]')"

# What leaves the window, or is wider than its own box, outside of what scrolls.
OVERFLOW = """() => [...document.querySelectorAll('body *')].filter((e) => {
    if (!e.checkVisibility() || e.closest('.unseen, svg, .cm-editor, [popover]')) return false;
    const box = e.getBoundingClientRect();
    if (!box.width || !box.height) return false;
    for (let up = e.parentElement; up && up !== document.body; up = up.parentElement)
        if (/auto|scroll|hidden/.test(getComputedStyle(up).overflow)) return false;
    const leaves = box.right > innerWidth + 1 || box.left < -1 || box.bottom > innerHeight + 1 || box.top < -1;
    const wide = e.clientWidth && e.scrollWidth > e.clientWidth + 1 && getComputedStyle(e).overflowX === 'visible';
    return leaves || wide;
}).map((e) => `${e.tagName}.${e.className}`)"""
# Numbers and times that are cut off.
CLIPPED = """() => [...document.querySelectorAll('.number')].filter((e) => {
    if (!e.checkVisibility() || !e.textContent || e.closest('.tab-panel')) return false;
    const box = e.getBoundingClientRect();
    for (let up = e.parentElement; up && up !== document.body; up = up.parentElement) {
        const around = up.getBoundingClientRect();
        const cut = box.right > around.right + 1 || box.left < around.left - 1;
        if (getComputedStyle(up).overflow !== 'visible' && around.width && cut) return true;
    }
    return e.scrollWidth > e.clientWidth + 1 && getComputedStyle(e).display !== 'inline';
}).map((e) => e.textContent)"""
SMALL = """least => [...document.querySelectorAll('button, summary, select, [role=slider], [type=range]')].filter(e => {
    const box = e.getBoundingClientRect();
    const small = box.width < least - 0.5 || box.height < least - 0.5;
    return e.checkVisibility() && box.width && small && !e.closest('.cm-editor');
}).map((e) => `${e.className} ${e.textContent} ${e.offsetWidth} x ${e.offsetHeight}`)"""
COMMANDS = """(app.source.timeline.segments.filter((s, i, all) => i && s.motion.number !== all[i - 1].motion.number)
    .map((s) => s.start).filter((start) => start > app.playback.begin))"""


BEGIN = """begin => {
    (window.reached ??= new Set()).add(document.querySelector(begin));
    document.body.tabIndex = -1;
    document.querySelector(begin).focus();
}"""
REACHED = """() => {
    const e = document.activeElement, ring = e.closest('.prompt-line, .editor') ?? e, box = e.getBoundingClientRect();
    reached.add(e);
    const seen = getComputedStyle(ring).outlineStyle !== 'none' && box.bottom > 0 && box.top < innerHeight;
    if (e === document.body) return 'end';
    return !seen ? `${e.tagName}.${e.className} has the focus unseen` : e.matches('.cm-content') ? 'field' : '';
}"""
UNREACHED = """[...document.querySelectorAll('button, input, select, a[href], [role=slider], [contenteditable=true]')]
    .filter((e) => e.checkVisibility() && !e.disabled && e.tabIndex >= 0 && !reached.has(e))
    .map((e) => `${e.tagName}.${e.className} ${e.ariaLabel ?? e.textContent}`)"""


def walk(page: Page, begin: str = "body") -> None:
    """Reach every control with Tab, and leave each; fields that use Tab are left with Escape. `begin`: controls before
    it were reached earlier.
    """
    page.evaluate(BEGIN, begin)
    at = ""
    for _ in range(150):
        if at == "field":
            page.keyboard.press("Escape")
        page.keyboard.press("Tab")
        at = page.evaluate(REACHED)
        if at not in ("", "field"):
            break
    assert at == "end", at or "Tab goes in a circle"
    assert page.evaluate(UNREACHED) == []


@pytest.mark.long
@pytest.mark.parametrize(("size", "scheme"), [((1280, 720), "light"), ((390, 844), "dark")])
def test_axe_finds_nothing(chromium: Browser, served: Serving, size: tuple[int, int], scheme: Any) -> None:
    """Check the accessibility of the page, at each tab, with an open menu, and in both themes."""
    with alone(), window(chromium, size=size, color_scheme=scheme, has_touch=size[0] < 700) as page:
        open_robot(page, served)
        line(page, "DRIVE 1, 30")
        line(page, "WHERE")
        assert axe(page) == []
        page.get_by_role("button", name="Show", exact=True).click()
        page.get_by_role("button", name="Dark" if scheme == "light" else "Light", exact=True).click()
        for box in page.locator(".show-menu input[type=checkbox]").all():
            box.check()
        assert axe(page) == []
        page.keyboard.press("Escape")
        for number, tab in enumerate(page.get_by_role("tab").all()):
            tab.click()
            assert axe(page, ".side") == [], tab.text_content()
            walk(page, "[role=tab][aria-selected=true]" if number else "body")


@pytest.mark.parametrize("phone", [False, pytest.param(True, marks=pytest.mark.long)], ids=["desktop", "phone"])
def test_nothing_overflows_and_targets_are_large_enough(chromium: Browser, served: Serving, *, phone: bool) -> None:
    """Resize a window from one size to the next."""
    first, *others = [size for size in SIZES if (min(size) < 500) == phone]
    with alone(), window(chromium, size=first, has_touch=phone, is_mobile=phone) as page:
        open_robot(page, served)
        page.evaluate("name => document.querySelector('h1').textContent = name", LONG_NAME)
        page.evaluate("for (const plot of document.querySelectorAll('.plot')) plot.hidden = false")
        line(page, "DRIVE 1, 30")
        until(page, "document.querySelector('.clock b').textContent !== ''")
        for size in (first, *others):
            page.set_viewport_size({"width": size[0], "height": size[1]})
            until(page, "innerWidth === x[0] && document.body.classList.contains('phone') === x[1]", [size[0], phone])
            assert page.evaluate(OVERFLOW) == [], size
            assert page.evaluate(CLIPPED) == [], size
            assert page.evaluate(SMALL, 44 if phone else 24) == [], size


@pytest.mark.long
def test_keys_rule_time(shown: Page) -> None:
    for to in (30, -30, 30):
        line(shown, f"DRIVE 1, {to}")
    shown.locator("canvas").first.click()

    def press(key: str, then: str) -> None:
        shown.keyboard.press(key)
        until(shown, then)

    press("Home", "app.playback.time === app.playback.begin && !app.playback.following")
    press("n", f"app.playback.time === {COMMANDS}[0]")
    press("n", f"app.playback.time === {COMMANDS}[1]")
    press("b", f"app.playback.time === {COMMANDS}[0]")
    before = shown.evaluate("app.playback.time")
    press("PageUp", f"app.playback.time === app.playback.begin || app.playback.time < {before - 9.99}")
    press("x", "app.playback.rate === 2")
    press("z", "app.playback.rate === 1")
    press("Space", "app.playback.playing")
    press("Space", "!app.playback.playing")
    press("l", "app.playback.loop")
    press("f", "app.playback.following")
    press("End", "!app.playback.following && app.playback.time > 0")
    press("v", "document.querySelector('.secondary').textContent.includes('60 s')")
    press("?", "document.querySelector('dialog[open]')?.textContent.includes('Page Up')")
    press("Escape", CLOSED)
    press("Control+k", "document.activeElement.getAttribute('role') === 'combobox'")
    shown.keyboard.type("theme dark")
    press("Enter", f"{CLOSED} && document.documentElement.dataset.theme === 'dark'")
    shown.reload()
    until(shown, "document.documentElement.dataset.theme === 'dark'")


@pytest.mark.long
def test_keys_do_nothing_while_a_line_is_typed(shown: Page) -> None:
    shown.evaluate("app.playback.follow()")
    shown.locator(".cm-content").first.click()
    shown.keyboard.type("z n l ?")
    assert shown.evaluate("[app.playback.rate, app.playback.loop, app.playback.following]") == [1, False, True]
    assert not shown.locator("dialog[open]").count()


@pytest.mark.long
def test_the_hint_is_pressed_and_gone_for_good(shown: Page) -> None:
    shown.get_by_role("button", name="DRIVE 1, 30, 50").click()
    until(shown, "!document.querySelector('.hint') && app.source.timeline.segments.length > 1")
    shown.reload()
    until(shown, "document.querySelector('.pose td')?.textContent")
    assert not shown.locator(".hint").count()


def test_the_picture_is_told_in_words_and_numbers(shown: Page) -> None:
    line(shown, "DRIVE 1, 30")
    shown.evaluate("app.playback.follow()")
    until(shown, "document.querySelector('.joint-pose td.number').textContent === '30.00'")
    shown.evaluate("app.playback.seek(app.playback.end)")
    until(shown, "/JT1 30.0 degrees/.test(document.querySelector('section.unseen').textContent)")
    cells = shown.locator(".pose td").all_text_contents()
    assert len(cells) > 12
    assert not any(
        float(cell) == 0 and cell.startswith("-") for cell in cells if cell.replace(".", "").strip("-").isdigit()
    )


@pytest.mark.long
def test_a_click_on_the_strip_seeks(shown: Page) -> None:
    line(shown, "DRIVE 1, 90, 10")
    until(shown, "app.source.timeline.end > 1")
    box = shown.locator(".strip").bounding_box()
    assert box is not None
    shown.mouse.click(box["x"] + box["width"] / 4, box["y"] + box["height"] / 2)
    until(shown, "!app.playback.following")
    assert shown.locator(".tip").is_visible()
    shown.locator(".strip").press("ArrowRight")
    at = shown.evaluate("app.playback.time")
    assert 0 < at < shown.evaluate("app.playback.end")
