"""`smarticles doctor` on the machine that runs the tests."""

import pytest

from smarticles import doctor

pytestmark = pytest.mark.engine


def test_yade_computes() -> None:
    check = doctor.check_yade()
    assert check.ok, check.found
    assert check.found.endswith("a sphere falls")


def test_pictures_are_drawn_without_a_display(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("DISPLAY", raising=False)
    check = doctor.check_pyvista()
    assert check.ok, check.found
    assert "draws off-screen" in check.found
