"""What a terminal is believed to show."""

from __future__ import annotations

import pytest

from vrs_cli.render.console import has_unicode


@pytest.mark.parametrize(
    ("environ", "has"),
    [
        ({}, True),
        ({"LANG": "de_DE.UTF-8", "TERM": "xterm-256color"}, True),
        ({"LANG": "C.utf8"}, True),
        ({"LANG": "en_GB"}, True),
        ({"LC_ALL": "C", "LANG": "de_DE.UTF-8"}, False),
        ({"LC_ALL": "", "LANG": "POSIX"}, False),
        ({"LC_CTYPE": "de_DE.ISO-8859-15@euro", "LANG": "de_DE.UTF-8"}, False),
        ({"LANG": "de_DE.UTF-8", "TERM": "linux"}, False),
    ],
)
def test_unicode(environ: dict[str, str], has: bool) -> None:
    assert has_unicode(environ) is has
