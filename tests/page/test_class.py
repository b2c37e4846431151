"""Test a class in real browsers: a student's page, and the wall of the teacher."""

from __future__ import annotations

import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from tests.live import until as wait_until
from tests.net.serving import Serving, serving
from tests.page.browser import SIZE, axe, changed, drawn, line, picture, until, window
from vrs_cli.net.class_board import ClassBoard
from vrs_cli.net.http import ServedPage
from vrs_cli.net.messages import Embody, Hello, Measured
from vrs_cli.net.tokens import OWN_ROBOTS, ClassFolder, add_tokens
from vrs_cli.teach.served_lessons import ServedLessons
from vrs_cli.values.measured import DivergenceAlarm, DivergenceCause

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

HOSTILE = "<img src=x onerror=alert(1)>"


@pytest.fixture
def folder(tmp_path: Path) -> ClassFolder:
    folder = ClassFolder(tmp_path / "9b")
    folder.make(["ada", "bob", "carl", *(f"student{number}" for number in range(27))])
    return folder


@pytest.fixture
def lesson_room(built: Path, folder: ClassFolder, tmp_path: Path) -> Iterator[Serving]:
    """Serve a class."""
    pages = ServedPage.read(built, cookies=True)
    with serving(tmp_path, (), tokens=folder.tokens, own=OWN_ROBOTS, pages=pages) as it:
        it.server.board = ClassBoard(folder, it.hub.clients, it.server.grants, it.hub.own_names, lambda: 1e9)
        yield it


@pytest.fixture
def ada(page: Page) -> Page:
    return page


@pytest.fixture
def tom(chromium: Browser, ada: Page) -> Iterator[Page]:  # noqa: ARG001 (who has the machine)
    with window(chromium) as page:
        yield page


def link(served: Serving, folder: ClassFolder, who: str) -> str:
    token = {**folder.students(), **folder.teachers()}[who]
    where = "wall" if who == "teacher" else f"view/{who}"
    return f"{served.address.replace('ws', 'http', 1)}/{where}#token={token}"


@pytest.mark.long
def test_a_class_from_a_link_to_a_collected_program(
    ada: Page, tom: Page, lesson_room: Serving, folder: ClassFolder, tmp_path: Path
) -> None:
    ada.goto(link(lesson_room, folder, "ada"))
    drawn(ada)
    assert "token" not in ada.url
    until(ada, "sessionStorage.getItem('token') === null")
    assert all(cookie["httpOnly"] and cookie["sameSite"] == "Strict" for cookie in ada.context.cookies())
    ada.reload()  # the cookie lets her in
    drawn(ada)

    tom.goto(link(lesson_room, folder, "teacher"))
    tom.get_by_role("article", name="ada").get_by_label("here", exact=True).wait_for()
    assert tom.get_by_role("article").count() == 30
    until(tom, "wall.pictures.drawn > 0")
    assert len({tuple(colour) for colour in picture(tom, ".tile-picture").reshape(-1, 3)}) > 20

    before = picture(tom, ".tile-picture")
    line(ada, "DRIVE 1, 60")
    wait_until(lambda: changed(before, picture(tom, ".tile-picture")) > 0.005)

    ada.get_by_role("button", name="Ask for help").click()
    tom.get_by_text("Asks for help:").wait_for()
    assert "1 asks for help" in tom.get_by_role("status").first.inner_text()
    tom.get_by_role("button", name="Answered").click()
    ada.get_by_role("button", name="Ask for help").wait_for()

    tom.get_by_label("Message to all students").fill(HOSTILE)
    tom.keyboard.press("Enter")
    ada.get_by_text(f"teacher: {HOSTILE}").wait_for()  # as text: nothing of it is carried out

    tom.get_by_role("button", name="Freeze").click()
    ada.get_by_text("Your teacher has stopped the class").wait_for()
    refused = ada.evaluate("app.connection.ask('line', { text: 'DRIVE 1, 10' })")
    assert "has stopped the class" in str(refused["refusal"])
    tom.get_by_role("button", name="Go on").click()
    until(ada, "document.querySelector('.class-note').hidden")

    line(ada, "x = 3")
    ada.get_by_role("button", name="Hand in").click()
    ada.get_by_text("Handed in. You may").wait_for()
    tom.get_by_role("article", name="ada").get_by_text("handed in").wait_for()
    with tom.expect_download() as download:
        tom.get_by_role("button", name="Collect").click()
    download.value.save_as(tmp_path / "all.zip")
    with zipfile.ZipFile(tmp_path / "all.zip") as file:
        assert file.namelist() == ["ada.v2"]
        assert b".REALS" in file.read("ada.v2")


@pytest.mark.long
def test_who_leaves_needs_the_link_again_and_stays_grey_on_the_wall(
    ada: Page, chromium: Browser, lesson_room: Serving, folder: ClassFolder
) -> None:
    """The wall of thirty is on a phone: it is many times as high as the window."""
    ada.goto(link(lesson_room, folder, "ada"))
    drawn(ada)
    until(ada, "sessionStorage.getItem('token') === null")
    ada.get_by_role("button", name="Leave").click()
    ada.get_by_text("open the link that you were given").wait_for()
    assert ada.context.cookies() == []
    with window(chromium, size=(390, 844), has_touch=True, is_mobile=True) as tom:
        tom.goto(link(lesson_room, folder, "teacher"))
        tile = tom.get_by_role("article", name="ada")
        tile.get_by_text("is not here").wait_for()
        until(tom, "wall.pictures.drawn > 0 && document.querySelector('.tile.away')")
        assert len({tuple(colour) for colour in picture(tom, ".tile-picture").reshape(-1, 3)}) > 20, "it is drawn"
        assert axe(tom) == []


@pytest.mark.long
def test_the_body_of_a_student_s_robot_is_on_the_wall(
    ada: Page, tom: Page, lesson_room: Serving, folder: ClassFolder
) -> None:
    """Joint 1 of the body is 60 degrees away."""
    token = add_tokens(folder.tokens, ["arm"], "body", ["ada"])["arm"]
    wait_until(lambda: any(grant.body for grant in lesson_room.server.grants()))
    ada.goto(link(lesson_room, folder, "ada"))
    drawn(ada)
    tom.goto(link(lesson_room, folder, "teacher"))
    until(tom, "wall.pictures.drawn > 0")
    before = picture(tom, ".tile-picture")
    with lesson_room.call("", Hello((1,), token=token)) as arm:
        session = lesson_room.hub.rooms["ada"].session
        arm.ask(Embody)
        away = (1.0, *session.engine.model.poses["ready"][1:])
        arm.protocol.send(Measured(first=0, times=(0.0,), joints=(away,), sent=0.0))
        arm.flush()
        tom.get_by_role("article", name="ada").get_by_text("arm is the body").wait_for()
        ada.locator("section.body").get_by_text("arm follows").wait_for()
        wait_until(lambda: changed(before, picture(tom, ".tile-picture")) > 0.005)
        session.body.tell(DivergenceAlarm(1.0, 1, 0.5, 0.2, DivergenceCause.BLOCKED, "joint 1 stands still", 0.2))
        tom.get_by_text("arm: alarm at 1.0 s, likely cause: blocked joint").wait_for()
    assert tom.get_by_role("article").count() == 30


def test_a_lesson_leads_through_its_steps(ada: Page, lesson_room: Serving, folder: ClassFolder) -> None:
    board, hub = lesson_room.server.board, lesson_room.hub
    assert board is not None
    lessons = ServedLessons(folder.lessons, lesson_room.server.begin_anew, lesson_room.told.append)
    board.lessons, hub.planned = lessons, lessons.plan
    lesson_room.server.opened.append(lessons.start_at)
    ada.goto(link(lesson_room, folder, "ada"))
    ada.get_by_role("link", name="Lessons").click()
    ada.get_by_role("heading", name="Turn the waist").wait_for()
    drawn(ada)
    ada.get_by_role("button", name="Hint").click()
    ada.get_by_text("So far").wait_for()
    line(ada, "DRIVE 1, 30")
    ada.get_by_role("heading", name="First motion: step 2 of 6").wait_for()
    line(ada, "LESSON 9")
    ada.get_by_role("heading", name="Palletising with FRAME: step 1").wait_for()
    assert lesson_room.told == []
    ada.set_viewport_size({"width": 900, "height": 700})
    faults = axe(ada)
    ada.set_viewport_size({"width": SIZE[0], "height": SIZE[1]})
    assert faults == []
