"""The folders of the closed forms: `forms.arm_for` alone knows all of them."""

from __future__ import annotations

from pathlib import Path

import pytest

import vrs_cli.kinematics

FOLDER = Path(vrs_cli.kinematics.__file__).parent
FORMS = sorted(path.parent.name for path in FOLDER.glob("*/arm.py"))


@pytest.mark.parametrize("form", FORMS)
def test_a_closed_form_knows_no_other(form: str) -> None:
    assert len(FORMS) == 4
    for path in (FOLDER / form).glob("*.py"):
        text = path.read_text(encoding="utf-8")
        assert not [other for other in FORMS if other != form and f"kinematics.{other}" in text], path
        assert "kinematics.forms" not in text
