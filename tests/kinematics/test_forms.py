"""The folders of the closed forms: `forms.arm_for` alone knows all of them."""

from __future__ import annotations

from pathlib import Path

import pytest

import vrs_cli.kinematics

FOLDER = Path(vrs_cli.kinematics.__file__).parent
FORMS = sorted(path.parent.name for path in FOLDER.glob("*/arm.py"))
MADE_OF = {"wrist_circle": ("numeric", "spherical_wrist")}  # the words of one, the lines of the other


@pytest.mark.parametrize("form", FORMS)
def test_a_closed_form_knows_no_other(form: str) -> None:
    assert len(FORMS) == 5
    others = set(FORMS) - {form, *MADE_OF.get(form, ())}
    for path in (FOLDER / form).glob("*.py"):
        text = path.read_text(encoding="utf-8")
        assert not [other for other in others if f"kinematics.{other}" in text], path
        assert "kinematics.forms" not in text
