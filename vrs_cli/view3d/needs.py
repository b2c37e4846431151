"""Find what the old page of the scene needs beside vrs: viser."""

from __future__ import annotations

from importlib.util import find_spec

from vrs_cli.extras import how_to_install
from vrs_cli.render.browser import PictureError


def check_view() -> None:
    """Raises PictureError where viser is missing."""
    if find_spec("viser") is None:
        raise PictureError("the scene needs viser, which is not installed", how_to_install("viser"))
