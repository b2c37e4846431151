"""The way of the tool in a scene: where g leads it, in two colours, and nothing sent of what stays."""

from __future__ import annotations

from math import cos, sin

import numpy as np
import pytest
import viser

from tests.engine.test_tool_path import steered
from tests.interfaces.monitor.test_showing import session
from tests.view3d.test_figure import sent
from vrs_cli.engine.engine import Engine
from vrs_cli.engine.position import position_at
from vrs_cli.engine.tool_path import distance_from_line
from vrs_cli.interfaces.steering import Steering
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.kinematics.transform import position
from vrs_cli.view3d.parts import Shown
from vrs_cli.view3d.paths import BLENDS, ERROR, LABELS, MOST, PAST, PLANNED, UNDER_WAY, Path

LINES = ("DRIVE 3, 60 AT 0", "DRIVE 1, 90 AT 0.5", "DRIVE 2, 30 AT 1.6", "OPENI", "DRIVE 1, -60 AT 5")


def seen(engine: Engine, t: float, now: float | None = None) -> Shown:
    return Shown(engine.arm, engine.timeline, t, position_at(engine.arm, engine.timeline, t), t if now is None else now)


def moved() -> Engine:
    return session(*LINES).engine


def drawn(server: viser.ViserServer) -> list[tuple[np.ndarray, np.ndarray, tuple[int, int, int]]]:
    """All lines that have a length: from, to, colour."""
    found = []
    for name in ("/path/lines", "/path/now"):
        node = server.scene.get_handle_by_name(name)
        assert isinstance(node, viser.LineSegmentsHandle)
        for (a, b), colours in zip(node.points, node.colors, strict=True):
            if node.visible and not (a == b).all():
                found.append((a, b, tuple(int(x) for x in colours[0])))
    return found


@pytest.mark.parametrize("t", [-1.0, 0.2, 0.6, 1.0, 3.0, 5.3, 9.0])
def test_the_way_is_where_g_leads_and_parted_at_the_tip(server: viser.ViserServer, t: float) -> None:
    engine = moved()
    Path(server.scene, engine.model).show(seen(engine, t))
    lines = drawn(server)
    for colour, times in ((PAST, np.linspace(0.0, t, 300)), (PLANNED, np.linspace(t, engine.end, 300))):
        ours = [(a, b) for a, b, ink in lines if ink in (colour, BLENDS[colour])]
        for time in times[(times > 0.0) & (times <= engine.end)]:
            at = engine.position(float(time))
            if at.moving:
                p = position(at.T_world_tool)
                assert min(distance_from_line(p, tuple(a), tuple(b)) for a, b in ours) < ERROR + 1e-6


def test_blends_have_a_colour_of_their_own(server: viser.ViserServer) -> None:
    engine = moved()
    path = Path(server.scene, engine.model)
    for t, colour in ((-1.0, PLANNED), (9.0, PAST)):
        path.show(seen(engine, t))
        assert {ink for _, _, ink in drawn(server)} == {colour, BLENDS[colour]}


def test_what_has_no_points_is_not_drawn(server: viser.ViserServer) -> None:
    engine = Engine(load_robot("puma560"))
    Path(server.scene, engine.model).show(seen(engine, 0.0))
    node = server.scene.get_handle_by_name
    assert not any(node(f"/path/{name}").visible for name in ("lines", "now", "dots", "marks"))
    engine = moved()
    Path(server.scene, engine.model).show(seen(engine, 0.2))
    assert all(node(f"/path/{name}").visible for name in ("lines", "now", "dots", "marks"))


def test_nothing_is_sent_of_what_stays(server: viser.ViserServer, monkeypatch: pytest.MonkeyPatch) -> None:
    engine = moved()
    path = Path(server.scene, engine.model)
    path.show(seen(engine, 3.0))
    found = sent(server, monkeypatch)
    path.show(seen(engine, 3.0))
    path.show(seen(engine, 4.0))
    assert not found, "the arm stands"
    path.show(seen(engine, 5.2))
    found.clear()
    path.show(seen(engine, 5.22))
    assert {name for _, name in found} == {"/path/now"}, "within a segment only that one changes"


def test_a_change_far_away_is_drawn_when_it_is_seen(server: viser.ViserServer) -> None:
    engine = session(*LINES, "DRIVE 2, 10 AT 500").engine
    path = Path(server.scene, engine.model)
    path.show(seen(engine, 0.0))
    before = len(drawn(server))
    path.show(seen(engine, 480.0))
    assert 0 < len(drawn(server)) < before


def test_commands_are_marked_and_told_on_demand(server: viser.ViserServer) -> None:
    engine = moved()
    path = Path(server.scene, engine.model)
    path.show(seen(engine, 0.0))
    marks = server.scene.get_handle_by_name("/path/marks")
    assert isinstance(marks, viser.PointCloudHandle)
    begins = [position(engine.position(t).T_world_tool) for t in (0.0, 0.5, 1.6, 5.0)]
    assert marks.points == pytest.approx(np.array(begins), abs=1e-5)
    assert server.scene.get_handle_by_name("/path/commands/0") is None
    path.commands = True
    path.show(seen(engine, 0.0))
    labels = [server.scene.get_handle_by_name(f"/path/commands/{k}") for k in range(LABELS)]
    texts = [label.text for label in labels if isinstance(label, viser.LabelHandle)]
    assert "\n".join(texts).split("\n") == [line for line in LINES if line != "OPENI"]
    path.commands = False
    path.show(seen(engine, 0.0))
    assert server.scene.get_handle_by_name("/path/commands/0") is None


def test_a_long_steered_session_is_a_bounded_picture(server: viser.ViserServer) -> None:
    """At 50 Hz; the next target changes what is drawn at once and little is looked at again."""
    engine = steered(90.0)
    made = []
    wall = iter(float(k) for k in range(1000))
    path = Path(server.scene, engine.model, lambda: next(wall))
    path.show(seen(engine, engine.now))
    lines = server.scene.get_handle_by_name("/path/lines")
    assert isinstance(lines, viser.LineSegmentsHandle)
    assert len(lines.points) <= MOST
    forward = engine.arm.forward
    engine.arm.forward = lambda q: made.append(q) or forward(q)  # type: ignore[method-assign, func-returns-value]
    ready = engine.model.poses["ready"]
    Steering(engine).to((0.3 * sin(90.0), ready[1] + 0.3 * cos(90.0), *ready[2:]), engine.now + 0.02)
    path.show(seen(engine, engine.now))
    assert len(made) < 5000, "a block of segments, not all of the window"


@pytest.mark.parametrize("part", [0.2, 0.5, 0.9])
def test_of_a_segment_with_many_lines_only_those_around_the_tip_are_sent(
    server: viser.ViserServer, part: float
) -> None:
    engine = session("DRIVE 1, 150, 5", "DRIVE 1, -300, 5").engine
    t, path = part * engine.end, Path(server.scene, engine.model)
    path.show(seen(engine, t))
    now = server.scene.get_handle_by_name("/path/now")
    assert isinstance(now, viser.LineSegmentsHandle)
    assert len(now.points) == UNDER_WAY
    lines, tip = drawn(server), position(engine.position(t).T_world_tool)
    assert len(lines) > 2 * UNDER_WAY
    assert max(np.linalg.norm(b - a) for a, b, _ in lines) < 0.1, "no line leaves the arc"
    assert sum(tuple(np.float32(tip)) in (tuple(a), tuple(b)) for a, b, _ in lines) == 2
