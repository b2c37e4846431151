from __future__ import annotations

import pytest

from vrs_cli.files.opening import wrong_name


@pytest.mark.parametrize(
    "name", ["log.txt", "console.txt", "com10", "größe.v2", ".hidden", "a.b.c", "lpt", "nullen.v2"]
)
def test_good_names(name: str) -> None:
    assert wrong_name(name) == ""


@pytest.mark.parametrize(
    ("name", "told"),
    [
        ("nul", "NUL is a device"),
        ("Con.txt", "CON is a device"),
        ("com1.tar.gz", "COM1 is a device"),
        ("lpt9 .txt", "LPT9 is a device"),
        ("a:b", "no :"),
        ("a?b", "no ?"),
        ("a\\b", "no \\"),
        ("a\tb", "a control character"),
        ("a.", "ends in a dot or a blank"),
        ("a ", "ends in a dot or a blank"),
    ],
)
def test_names_that_are_not_good_everywhere(name: str, told: str) -> None:
    assert told in wrong_name(name)
