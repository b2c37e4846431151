"""What is seen around a robot as somebody wants it: a box for each."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from vrs_cli.view3d.ghosts import BranchGhosts, GoalGhost
from vrs_cli.view3d.limits import LimitsView
from vrs_cli.view3d.panel_front_end import PanelFrontEnd
from vrs_cli.view3d.paths import Path
from vrs_cli.view3d.places import PlacesView
from vrs_cli.view3d.reach import ReachView
from vrs_cli.view3d.reasons import Asking, Reasons
from vrs_cli.view3d.window import RobotWindow


class Choice(NamedTuple):
    """`choose` shows it or hides it."""

    label: str
    hint: str
    at_first: bool
    choose: Callable[[bool], None]


class AtWill:
    """Adds its parts to a window, and their boxes where the panel is that is open now."""

    def __init__(self, window: RobotWindow) -> None:
        scene, arm = window.client.scene, window.watched.arm
        path = next(part for part in window.parts if isinstance(part, Path))
        goal = GoalGhost(scene, arm.model)
        choices = [
            Choice("Path", "Past blue, planned orange, lighter where motions blend", True, _setter(path, "visible")),
            Choice("Commands", "The text of each command where its motion begins", False, _setter(path, "commands")),
            Choice("Goal", "The arm as it will stand when the motion ends", True, _setter(goal, "visible")),
        ]
        limits, reach = LimitsView(scene, "/robot", arm.model), ReachView(scene, "/robot", arm)
        choices.append(
            Choice("Joint ranges", "How far each joint goes, and where it is", False, _setter(limits, "visible"))
        )
        if reach.known:
            hint = "How far the tool gets in this configuration"
            choices.append(Choice("Reach", hint, False, _setter(reach, "visible")))
        window.parts += (goal, limits, reach)
        self.reasons = Reasons(scene, arm.model)
        window.parts.append(self.reasons)
        if window.robot is not None:
            places, branches = PlacesView(scene, arm.model), BranchGhosts(scene, arm, window.robot, window.again)
            window.parts += (places, branches)
            choices += (
                Choice("Places", "The locations that have names", True, _setter(places, "visible")),
                Choice("Branches", "The arm as other branches move it", True, _setter(branches, "visible")),
            )
        for choice in choices:
            _add_box(window, choice)

    def explain(self, front_end: PanelFrontEnd) -> None:
        """What is typed at a panel, and refused, is shown with its reason."""
        front_end.explained, front_end.refused = (
            self.reasons.explain,
            Asking(front_end.robot, self.reasons.explain).refused,
        )


def _add_box(window: RobotWindow, choice: Choice) -> None:
    box = window.client.gui.add_checkbox(choice.label, choice.at_first, hint=choice.hint)
    box.on_update(window.doing(lambda: choice.choose(box.value)))


def _setter(part: object, name: str) -> Callable[[bool], None]:
    return lambda value: setattr(part, name, value)
