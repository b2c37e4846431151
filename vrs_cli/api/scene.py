"""A trajectory as one sees it: in a notebook below the cell, or as a page of its own."""

from __future__ import annotations

import webbrowser
from functools import cached_property
from html import escape
from pathlib import Path
from tempfile import mkdtemp

from vrs_cli.files.atomic import write_atomically
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.view3d.needs import check_view


class Scene:
    """An arm that follows a timeline. `html`: the page, which plays offline; `height` [px] of what a notebook shows.

    Raises UsageError where viser is missing.
    """

    def __init__(self, arm: RobotArm, timeline: Timeline, height: int) -> None:
        check_view()
        self._arm, self._timeline, self._height = arm, timeline, height

    @cached_property
    def html(self) -> str:
        from vrs_cli.view3d.studio import page, usual_rate

        return page(self._arm, self._timeline, usual_rate(self._timeline))

    def save(self, path: str | Path) -> None:
        """Write the page to a file. Raises FileError."""
        write_atomically(path, self.html)

    def open(self) -> Path:
        """Show it in the browser of this machine: for a script, which has no cell to show it below. The page is in the
        file that is returned, which stays.
        """
        path = Path(mkdtemp(prefix="vrs-")) / f"{self._arm.model.name}.html"
        self.save(path)
        webbrowser.open(path.as_uri())
        return path

    def __repr__(self) -> str:
        span = f"{self._timeline.start:.3f} to {self._timeline.end:.3f} s"
        return f"<Scene of {self._arm.model.name}: {span}; .open() shows it in a browser>"

    def _repr_html_(self) -> str:
        """A frame that has the whole page in it: a notebook that is opened elsewhere needs no server either."""
        style = "border:0;width:100%"
        return f'<iframe srcdoc="{escape(self.html)}" height="{self._height}" style="{style}"></iframe>'
