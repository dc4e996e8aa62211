"""Strings as arithmetic."""

from __future__ import annotations

import pytest

from dem.physics.contact import StringLaw


def test_a_string_pulls_and_never_pushes() -> None:
    law = StringLaw(length=0.1, stiffness=5000.0, damping=2.0)
    assert law.tension(0.1001, 0.0) == pytest.approx(0.5)
    assert law.tension(0.1001, 0.1) == pytest.approx(0.7)
    assert law.tension(0.1001, -1.0) == 0
    assert law.tension(0.0999, 10.0) == 0
