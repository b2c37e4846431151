"""What is seen around the robot, over the wire as a page has it."""

from __future__ import annotations

from tests.view3d.test_panel import Sat, ada, window
from vrs_cli.view3d.app import App

__all__ = ["ada"]


def labels(sat: Sat) -> dict[str, str]:
    """The texts in the scene, by node."""
    return {one["name"]: one["props"]["text"] for one in sat.page.of("LabelMessage")}


def test_a_refused_line_is_a_picture_and_so_is_why(app: App, ada: Sat) -> None:
    window(app)
    ada.type("MOVES TRANS(1500, 150, -100, 90, 90, 0)")
    ada.until(lambda: "/why/reason" in labels(ada))
    assert labels(ada)["/why/reason"].startswith("TRANS(1500, 150, -100, 90, 90, 0):")
    assert any(one["name"] == "/why/refused" for one in ada.page.of("LineSegmentsMessage"))
    ada.type("WHY #PPOINT(0, -80, 90, 0, 20, 0)")
    ada.until(lambda: labels(ada)["/why/reason"].startswith("#PPOINT(0, -80, 90, 0, 20, 0)"))


def test_what_is_explained_is_a_picture(app: App, ada: Sat) -> None:
    window(app)
    ada.type("EXPLAIN DRIVE 1, 40")
    ada.until(lambda: labels(ada).get("/why/reason", "").endswith(" s, 105 mm"))
    assert labels(ada)["/why/reason"].startswith("DRIVE 1, 40: ")  # then its times, by the robot's clock
    ada.sees("Binds: velocity of JT1")
    ada.type("EXPLAIN MOVES TRANS(1500, 150, -100, 90, 90, 0)")
    ada.until(lambda: labels(ada)["/why/reason"].startswith("TRANS(1500, 150, -100, 90, 90, 0):"))
    assert any(one["name"] == "/why/refused" for one in ada.page.of("LineSegmentsMessage"))


def test_what_moves_no_arm_has_no_picture(ada: Sat) -> None:
    ada.type("MOVES nowhere")
    ada.sees("Undefined value")
    ada.type("DRIVE 1, 1000")
    ada.sees("out of range")
    ada.page.quiet(0.3)
    assert not any(name.startswith("/why") for name in labels(ada))


def test_places_and_commands_have_names(ada: Sat) -> None:
    ada.type("SET part = TRANS(500,150,-100,90,90,0)")
    ada.until(lambda: "part" in labels(ada).values())
    ada.type("DRIVE 1, 20")
    ada.until(lambda: any(one["name"] == "/path/marks" for one in ada.page.of("PointCloudMessage")))
    assert not any(name.startswith("/path/commands") for name in labels(ada))
    ada.page.set(ada.now("GuiCheckboxMessage", label="Commands")["uuid"], True)
    ada.until(lambda: labels(ada).get("/path/commands/0") == "DRIVE 1, 20")
