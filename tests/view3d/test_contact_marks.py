"""What touches is red in a scene, for as long as it touches."""

from __future__ import annotations

import numpy as np
import pytest
import viser

pytest.importorskip("mujoco")

import vrs_cli as vrs
from tests.contacts.test_watch import WALL
from tests.view3d.test_scene_bodies import ARM, PROGRAMS, moment
from vrs_cli.files.cell_file import parse_cell, read_cell
from vrs_cli.language.run.signals import Cell
from vrs_cli.view3d.contact_marks import RED, ContactMarks
from vrs_cli.view3d.figure import Figure
from vrs_cli.view3d.scene_bodies import SceneBodies
from vrs_cli.world.world import World


def marks_of(server: viser.ViserServer, cell: Cell) -> ContactMarks:
    world = World(ARM, cell)
    return ContactMarks(world, Figure(server.scene, "/robot", ARM.model), SceneBodies(server.scene, world))


def red_at(server: viser.ViserServer, marks: ContactMarks, timeline: vrs.Timeline, t: float) -> set[str]:
    """Return the names of the red nodes at t [s]."""
    marks.show(moment(timeline, t))
    nodes = server.scene._handle_from_node_name.items()
    return {name for name, node in nodes if getattr(node, "color", None) == RED}


def test_what_touches_is_red_while_it_touches(server: viser.ViserServer) -> None:
    robot, marks = vrs.Robot(), marks_of(server, parse_cell(WALL))
    for line in ("DRIVE 1, 20, 50", "DRIVE 2, 60, 50", "DRIVE 2, -60, 50"):
        robot.do(line)
    assert red_at(server, marks, robot.timeline, 1.0) == set()
    found = red_at(server, marks, robot.timeline, 2.5)
    assert "/cell/wall" in found
    assert {name.rpartition("/")[0] for name in found if name.startswith("/robot")} == {"/robot/0/1/2/3"}
    assert red_at(server, marks, robot.timeline, 1.0) == set()
    assert red_at(server, marks, robot.timeline, robot.timeline.end) == set()
    robot.undo()
    robot.undo()
    assert red_at(server, marks, robot.timeline, 2.5) == set()


def test_nothing_is_red_when_the_hand_takes_and_puts_down_a_part(server: viser.ViserServer) -> None:
    robot, marks = vrs.Robot(), marks_of(server, read_cell(str(PROGRAMS / "pick_and_place.toml")))
    robot.run(PROGRAMS / "pick_and_place.v2")
    for t in np.arange(0.0, robot.timeline.end, 0.1).tolist():
        assert red_at(server, marks, robot.timeline, t) == set()
