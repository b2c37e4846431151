"""WHY as a picture."""

from __future__ import annotations

from math import dist

import numpy as np
import pytest
import viser

from tests.interfaces.monitor.test_showing import session
from tests.interfaces.terminals import RecordingTerminal
from tests.view3d.test_paths import seen
from vrs_cli.interfaces.session.session import Session
from vrs_cli.interfaces.session.sketches import place_of, stopping_place
from vrs_cli.values.replies import ReachReport
from vrs_cli.values.results import ChainReport, MotionReport
from vrs_cli.view3d.places import Reasons, dashes

BENT = ("MOVE #PPOINT(0,-45,180,0,45,0)",)


def why(of: Session, place: str) -> ReachReport:
    terminal = of.terminal
    assert isinstance(terminal, RecordingTerminal)
    of.perform(f"WHY {place}")
    report = terminal.replies[-1]
    assert isinstance(report, ReachReport)
    return report


def length(server: viser.ViserServer, name: str) -> float:
    node = server.scene.get_handle_by_name(f"/why/{name}")
    if not isinstance(node, viser.LineSegmentsHandle):
        return 0.0
    return float(np.linalg.norm(node.points[:, 1] - node.points[:, 0], axis=1).sum())


def test_a_line_that_fails_on_its_way_is_drawn_up_to_there(server: viser.ViserServer) -> None:
    of = session("MOVE TRANS(0, 450, -150, 90, 90, 0)")
    report = why(of, "TRANS(0, -450, -150, 90, 90, 0)")
    line = report.reach.line
    assert line.at is not None
    reasons = Reasons(server.scene, of.engine.model)
    reasons.explain(report)
    reasons.show(seen(of.engine, of.engine.now))
    assert length(server, "followed") == pytest.approx(line.at, abs=1e-4)
    assert length(server, "refused") == pytest.approx(0.5 * (line.length - line.at), abs=0.03)
    stop = server.scene.get_handle_by_name("/why/stop")
    assert stop is not None
    assert tuple(stop.position) == pytest.approx(stopping_place(report.reach), abs=1e-6)
    label = server.scene.get_handle_by_name("/why/reason")
    assert isinstance(label, viser.LabelHandle)
    assert label.text.replace("\n", " ") == f"{report.name}: {line.trouble}"[:200]


def test_a_place_out_of_reach_is_refused_from_the_start(server: viser.ViserServer) -> None:
    of = session(*BENT)
    report = why(of, "TRANS(1500, 150, -100, 90, 90, 0)")
    reasons = Reasons(server.scene, of.engine.model)
    reasons.explain(report)
    reasons.show(seen(of.engine, of.engine.now))
    assert report.reach.end == pytest.approx((1.5, 0.15, -0.1))
    assert dist(report.reach.begin, report.reach.end) == pytest.approx(report.reach.line.length)
    assert length(server, "followed") == pytest.approx(report.reach.line.at or 0.0, abs=1e-4)
    assert length(server, "refused") > 0.1


def test_a_line_that_can_be_is_whole(server: viser.ViserServer) -> None:
    of = session("BASE 0, 0, 200", *BENT)
    report = why(of, "SHIFT(HERE BY 0, 50, 0)")
    reasons = Reasons(server.scene, of.engine.model)
    reasons.explain(report)
    reasons.show(seen(of.engine, of.engine.now))
    assert length(server, "followed") == pytest.approx(0.05, abs=1e-5)
    assert length(server, "refused") == 0.0


def test_it_goes_when_the_robot_does_something_else(server: viser.ViserServer) -> None:
    of = session(*BENT)
    reasons = Reasons(server.scene, of.engine.model)
    reasons.explain(why(of, "TRANS(1500, 150, -100, 90, 90, 0)"))
    for _ in range(3):
        reasons.show(seen(of.engine, of.engine.now))
        assert server.scene.get_handle_by_name("/why/reason") is not None
    of.perform("DRIVE 1, 5")
    reasons.show(seen(of.engine, of.engine.now))
    assert server.scene.get_handle_by_name("/why/reason") is None


def test_dashes_fill_half_of_a_line() -> None:
    parts = dashes((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), 0.1)
    assert sum(dist(a, b) for a, b in parts) == pytest.approx(0.5)
    assert not dashes((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 0.1)


@pytest.mark.parametrize(
    ("line", "place"),
    [
        ("MOVES part", "part"),
        ("move part:TRANS(0, 0, 50) AT 3", "part:TRANS(0, 0, 50)"),
        ("DO MOVES #safe IN 2", "#safe"),
        ("APPROS part, 50", "part:TRANS(0, 0, -(50))"),
        ("MOVET a[2], 50", "a[2]"),
        ("DRIVE 1, 500", None),
        ("DEPART 50", None),
        ("MOVES", None),
        ("nonsense ((", None),
        ("", None),
    ],
)
def test_which_place_a_line_names(line: str, place: str | None) -> None:
    assert place_of(line) == place


def test_a_motion_that_is_explained_is_drawn_along_its_way(server: viser.ViserServer) -> None:
    of = session(*BENT)
    of.perform("EXPLAIN MOVES SHIFT(HERE BY 0, 200, 0)")
    terminal = of.terminal
    assert isinstance(terminal, RecordingTerminal)
    report = terminal.replies[-1]
    assert isinstance(report, MotionReport)
    reasons = Reasons(server.scene, of.engine.model)
    reasons.explain(report)
    reasons.show(seen(of.engine, of.engine.now))
    assert length(server, "followed") == pytest.approx(0.2, abs=1e-6)
    label = server.scene.get_handle_by_name("/why/reason")
    assert isinstance(label, viser.LabelHandle)
    assert "200 mm" in label.text.replace("\n", " ")
    of.perform("MOVES SHIFT(HERE BY 0, 200, 0)")
    reasons.show(seen(of.engine, of.engine.now))
    assert server.scene.get_handle_by_name("/why/reason") is None


def test_a_chain_is_drawn_as_its_frames(server: viser.ViserServer) -> None:
    of = session("POINT table = TRANS(100, 400, -300)", "POINT part = TRANS(50, 60, 70)")
    of.perform("EXPLAIN table:part")
    terminal = of.terminal
    assert isinstance(terminal, RecordingTerminal)
    report = terminal.replies[-1]
    assert isinstance(report, ChainReport)
    reasons = Reasons(server.scene, of.engine.model)
    reasons.explain(report)
    reasons.show(seen(of.engine, of.engine.now))
    frames = server.scene.get_handle_by_name("/why/frames")
    assert isinstance(frames, viser.BatchedAxesHandle)
    assert frames.batched_positions == pytest.approx(np.array([[0.1, 0.4, -0.3], [0.15, 0.46, -0.23]]))
