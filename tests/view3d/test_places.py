"""Named locations in a scene."""

from __future__ import annotations

import numpy as np
import pytest
import viser

from tests.interfaces.monitor.test_showing import session
from tests.view3d.test_figure import sent
from tests.view3d.test_paths import seen
from vrs_cli.interfaces.dialogue import at_once
from vrs_cli.interfaces.session.acts import survey
from vrs_cli.interfaces.session.session import Session
from vrs_cli.kinematics.transform import position
from vrs_cli.values.acts import Survey
from vrs_cli.view3d.parts import Shown
from vrs_cli.view3d.places import PlacesView


def surveyed(of: Session) -> Shown:
    return seen(of.engine, of.engine.now)._replace(surveyed=at_once(survey(of, Survey())))


def frames(server: viser.ViserServer) -> np.ndarray:
    node = server.scene.get_handle_by_name("/places/frames")
    assert isinstance(node, viser.BatchedAxesHandle)
    return np.array(node.batched_positions)


def labels(server: viser.ViserServer) -> list[str]:
    nodes = (server.scene.get_handle_by_name(f"/places/{k}") for k in range(100))
    return [node.text for node in nodes if isinstance(node, viser.LabelHandle)]


def test_places_stand_where_the_tool_would(server: viser.ViserServer) -> None:
    """In the world, whatever BASE and TOOL are; a precision point is where its joints bring the tool."""
    of = session("BASE 100, 0, 50", "TOOL TRANS(0,0,120)", "SET part = TRANS(500,150,-100,90,90,0)", "HERE #safe")
    PlacesView(server.scene, of.engine.model).show(surveyed(of))
    here = position(of.engine.position().T_world_tool)
    assert frames(server) == pytest.approx(np.array([(0.5, 0.15, -0.1), here]), abs=1e-6)
    assert labels(server) == ["part", "#safe"]


def test_names_of_one_place_stand_together(server: viser.ViserServer) -> None:
    of = session("HERE a", "SET b = a", "HERE #c")
    PlacesView(server.scene, of.engine.model).show(surveyed(of))
    assert labels(server) == ["a\nb\n#c"]


def test_they_follow_and_nothing_is_sent_of_those_that_stay(
    server: viser.ViserServer, monkeypatch: pytest.MonkeyPatch
) -> None:
    of = session("HERE a", "DRIVE 1, 30", "HERE b")
    places = PlacesView(server.scene, of.engine.model)
    places.show(surveyed(of))
    found = sent(server, monkeypatch)
    places.show(surveyed(of))
    assert not found
    of.perform("DELETEL a")
    places.show(surveyed(of))
    assert labels(server) == ["b"]
    of.perform("DELETEL b")
    places.show(surveyed(of))
    assert labels(server) == []
    assert server.scene.get_handle_by_name("/places/frames") is None


def test_what_is_hidden_stays_hidden(server: viser.ViserServer) -> None:
    of = session("HERE a")
    places = PlacesView(server.scene, of.engine.model)
    places.visible = False
    places.show(surveyed(of))
    assert not places.visible
