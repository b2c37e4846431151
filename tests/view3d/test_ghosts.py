"""Arms that are seen through: the goal, and what other branches do."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
import viser

from tests.interfaces.monitor.test_showing import session
from tests.view3d.test_figure import matrix, sent
from tests.view3d.test_paths import seen
from tests.view3d.test_places import surveyed
from vrs_cli.engine.position import destination_at, position_at
from vrs_cli.errors import RequestRefused
from vrs_cli.interfaces.dialogue import at_once
from vrs_cli.interfaces.session.acts import show_branch
from vrs_cli.interfaces.session.session import Session
from vrs_cli.kinematics.joints import Joints
from vrs_cli.kinematics.model import link_frames
from vrs_cli.net import messages
from vrs_cli.net.far_end import Outlet
from vrs_cli.net.messages import At, Done, Request
from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.view3d.figure import link_node
from vrs_cli.view3d.ghosts import BranchGhosts, GoalGhost
from vrs_cli.wire.snapshots import ShowBranch


def stands(server: viser.ViserServer, root: str, of: Session) -> np.ndarray | None:
    """Where the last link of a figure is; None where it is not seen."""
    node = server.scene.get_handle_by_name(root)
    if node is None or not node.visible:
        return None
    T = np.eye(4)
    for i in range(of.engine.model.joint_count + 1):
        T = T @ np.vstack([matrix(server.scene.get_handle_by_name(link_node(root, i))), (0, 0, 0, 1)])
    return T[:3]


def flange(of: Session, joints: Joints) -> np.ndarray:
    return np.array(link_frames(of.engine.model, joints)[-1]).reshape(3, 4)


def test_the_goal_is_where_the_motion_ends_and_is_hidden_where_the_arm_is_there(server: viser.ViserServer) -> None:
    of = session("DRIVE 1, 60 AT 1", "DRIVE 2, 20 AT 5")
    engine, goal = of.engine, GoalGhost(server.scene, of.engine.model)
    goal.show(seen(engine, 0.0))
    assert stands(server, "/goal", of) is None
    for t in (1.0, 1.5, 5.1):
        goal.show(seen(engine, t))
        there = destination_at(engine.arm, engine.timeline, t).joints
        assert np.abs(stands(server, "/goal", of) - flange(of, there)).max() < 1e-6
    for t in (4.0, destination_at(engine.arm, engine.timeline, 1.5).time - 0.005, 99.0):
        goal.show(seen(engine, t))
        assert stands(server, "/goal", of) is None
    goal.show(seen(engine, 1.5))
    goal.visible = False
    goal.show(seen(engine, 1.5))
    assert stands(server, "/goal", of) is None


def test_links_that_stand_where_those_of_the_arm_do_are_not_seen(server: viser.ViserServer) -> None:
    of = session("DRIVE 3, 60 AT 1")
    goal = GoalGhost(server.scene, of.engine.model)
    goal.show(seen(of.engine, 1.2))
    seen_links = []
    for i in range(7):
        bodies = [server.scene.get_handle_by_name(f"{link_node('/goal', i)}/body{k}") for k in range(40)]
        seen_links.append({body.visible for body in bodies if body is not None})
    assert seen_links[:3] == [{False}, {False}, {False}]
    assert all(link <= {True} for link in seen_links[3:])
    assert {True} in seen_links[3:]


def test_nothing_is_sent_of_a_goal_that_stays(server: viser.ViserServer, monkeypatch: pytest.MonkeyPatch) -> None:
    of = session("DRIVE 1, 60 AT 1")
    goal = GoalGhost(server.scene, of.engine.model)
    goal.show(seen(of.engine, 1.1))
    found = sent(server, monkeypatch)
    for t in (1.2, 1.3, 1.4):
        goal.show(seen(of.engine, t))
    assert not found


class Robot:
    """Answers at once; `asked` counts looks at branches. `cut`: there is no connection."""

    def __init__(self, of: Session) -> None:
        self.of, self.asked, self.cut = of, 0, False

    @property
    def welcome(self) -> messages.Welcome:
        raise NotImplementedError

    @property
    def open(self) -> bool:
        return not self.cut

    @property
    def timeline(self) -> Timeline:
        return self.of.engine.timeline

    def begin(self, make: Callable[[int], Request], outlet: Outlet) -> int:
        if self.cut:
            raise RequestRefused("there is no connection")
        request = make(1)
        assert isinstance(request, At)
        assert isinstance(request.act, ShowBranch)
        self.asked += 1
        outlet(Done(1, found=at_once(show_branch(self.of, request.act))))
        return 1

    def tell(self, message: messages.ClientMessage) -> None:
        raise NotImplementedError

    def listen(self, outlet: Outlet) -> None:
        raise NotImplementedError


def test_branches_move_beside_the_arm_and_tell_how_much_later_they_end(server: viser.ViserServer) -> None:
    of = session("DRIVE 1, 60", "BRANCH slow", "DRIVE 2, 40", "BRANCH main", "DRIVE 1, -90")
    robot = Robot(of)
    ghosts = BranchGhosts(server.scene, of.engine.arm, robot)
    robot.cut = True
    ghosts.show(surveyed(of))
    robot.cut = False
    label = None
    for t in (1.2, 1.4, 1.6):
        ghosts.show(surveyed(of)._replace(t=t, position=of.engine.position(t)))
        label = server.scene.get_handle_by_name("/branches/slow-name")
        timeline = of.branches.book("slow").timeline
        there = position_at(of.engine.arm, timeline, t).joints
        assert np.abs(stands(server, "/branches/slow", of) - flange(of, there)).max() < 1e-6
        assert isinstance(label, viser.LabelHandle)
        assert label.text == f"slow: {timeline.end - of.engine.end:+.1f} s"
        assert label.visible
    assert robot.asked == 1, "a timeline that has not changed is not asked for again"
    assert isinstance(label, viser.LabelHandle)
    ghosts.show(surveyed(of)._replace(t=0.5, position=of.engine.position(0.5)))
    assert stands(server, "/branches/slow", of) is None, "they do the same then"
    assert not label.visible


def test_a_branch_that_goes_takes_its_ghost_along_and_one_that_changes_is_asked_for(server: viser.ViserServer) -> None:
    of = session("DRIVE 1, 60", "BRANCH trial", "DRIVE 2, 40", "BRANCH main")
    robot = Robot(of)
    ghosts = BranchGhosts(server.scene, of.engine.arm, robot)
    ghosts.show(surveyed(of)._replace(t=9.0))
    assert stands(server, "/branches/trial", of) is not None
    for line in ("BRANCH trial", "DRIVE 2, -60", "BRANCH main"):
        of.perform(line)
    ghosts.show(surveyed(of)._replace(t=9.0))
    assert robot.asked == 2
    of.perform("DISABLE INTERACTIVE")
    of.perform("DELETEB trial")
    ghosts.show(surveyed(of)._replace(t=9.0))
    assert server.scene.get_handle_by_name("/branches/trial") is None
    assert server.scene.get_handle_by_name("/branches/trial-name") is None
