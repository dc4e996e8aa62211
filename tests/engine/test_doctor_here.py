"""`smarticles doctor` on the machine that runs the tests."""

import pytest

from smarticles import installation


def test_yade_computes() -> None:
    check = installation.check_yade()
    assert check.ok, check.found
    assert check.found.endswith("a sphere falls")


def test_pictures_are_drawn_without_a_display(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("DISPLAY", raising=False)
    check = installation.check_pyvista()
    assert check.ok, check.found
    assert "draws off-screen" in check.found
