"""A trajectory as one HTML file that plays without a server and without the Internet.

The file is the page's script for recordings, which holds the timeline and computes the robot at each moment as a client
does, and the recording beside it as JSON. Its security policy allows this script alone, by its hash, and no address.
Where there are many recordings of one robot, they can share such a file.
"""

from __future__ import annotations

import json
import re
from base64 import b64encode
from collections.abc import Mapping
from functools import cache
from hashlib import sha256
from html import escape
from typing import Any

from vrs_cli.errors import UsageError
from vrs_cli.extras import BUILT_PAGE, how_to_build_page

SCRIPT, SHEET = "replay.js", "replay.css"
NOT_ASCII = re.compile(r"[^\x00-\x7f]")
POLICY = "default-src 'none'; script-src 'sha256-{script}'{more}; style-src 'unsafe-inline'; img-src data: blob:; " + (
    "connect-src data: blob:; base-uri 'none'; form-action 'none'"
)


class PageError(UsageError, text="No page"):
    """The page of the browser cannot be written."""


def page(data: Mapping[str, Any]) -> str:
    """Return the HTML file of a `recorded_page`: the same text for the same data. Raises PageError without a page."""
    return _html(data["title"], "recording", data)


def viewer(robot: Mapping[str, Any]) -> str:
    """Return an HTML file that plays `replays/NAME.js` beside it as `viewer.html#NAME`: `replay` makes such files, of
    this `robot` alone. Raises PageError without a page.
    """
    return _html(robot["model"]["title"], "robot", robot, " 'self' file:")


def replay(moments: Mapping[str, Any]) -> str:
    """Return the script with what a `viewer` plays."""
    return f"replay({json.dumps(moments, separators=(',', ':'))})\n"


def _html(title: str, name: str, data: Mapping[str, Any], scripts: str = "") -> str:
    """Return the page with its data. `scripts`: where it may have other scripts from."""
    script, sheet = _built()
    title = escape(title).encode("ascii", "xmlcharrefreplace").decode()
    policy = POLICY.format(script=b64encode(sha256(script.encode()).digest()).decode(), more=scripts)
    return (
        '<!doctype html>\n<html lang="en"><head><meta charset="utf-8">\n'
        f'<meta http-equiv="Content-Security-Policy" content="{policy}">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1, viewport-fit=cover">\n'
        '<meta name="color-scheme" content="light dark"><meta name="referrer" content="no-referrer">\n'
        f"<title>{title}</title>\n<style>{sheet}</style></head><body>\n"
        "<noscript>This page shows a robot; it needs JavaScript.</noscript>\n"
        f'<script type="application/json" id="{name}">{in_script(data)}</script>\n'
        f"<script>{script}</script>\n</body></html>\n"
    )


def in_script(data: Mapping[str, Any]) -> str:
    """Return JSON that can end no script and begin no comment of HTML."""
    return json.dumps(data, separators=(",", ":")).replace("<", "\\u003c")


def _ascii(code: str) -> str:
    """Return JavaScript that means the same in any encoding: a notebook may be read in another one."""

    def escaped(found: re.Match[str]) -> str:
        units = found[0].encode("utf-16-be").hex()
        return "".join([f"\\u{units[k : k + 4]}" for k in range(0, len(units), 4)])

    return NOT_ASCII.sub(escaped, code)


@cache
def _built() -> tuple[str, str]:
    """Return script and style sheet as they can stand inside HTML."""
    try:
        script, sheet = ((BUILT_PAGE / name).read_text(encoding="utf-8") for name in (SCRIPT, SHEET))
    except OSError:
        raise PageError("the page of the browser is not built", how_to_build_page()) from None
    script = _ascii(script.replace("</script", "<\\/script").replace("<!--", "<\\!--"))
    return script, NOT_ASCII.sub(lambda found: f"\\{ord(found[0]):06x}", sheet.replace("</style", "<\\/style"))


def check_page() -> None:
    """Raises PageError where the page is not built."""
    _built()
