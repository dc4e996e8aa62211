"""A machine without YADE: a clear error, and nothing written."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest
from scenes import small

from dem.engine.yade.library import import_yade
from dem.errors import RunError
from dem.run.run import run_scene


@pytest.fixture
def no_yade(monkeypatch: pytest.MonkeyPatch) -> None:
    """An import of yade that fails, whatever is installed."""
    monkeypatch.setitem(sys.modules, "yade", None)
    monkeypatch.setattr(sys, "path", list(sys.path))
    monkeypatch.setenv("OMP_NUM_THREADS", "1")


@pytest.mark.usefixtures("no_yade")
def test_missing_yade_says_how_to_get_it() -> None:
    with pytest.raises(RunError) as caught:
        import_yade()
    assert str(caught.value) == (
        "YADE cannot be imported (import of yade halted; None in sys.modules); install it with `make setup` or "
        "`apt-get install yade`, see environment.md, or run the scene on the engine that needs none: --engine links; "
        "`smarticles doctor` reports what is missing"
    )


@pytest.mark.usefixtures("no_yade")
def test_missing_yade_leaves_no_directory(tmp_path: Path) -> None:
    out = tmp_path / "run"
    with pytest.raises(RunError, match=r"^YADE cannot be imported .* `make setup`"):
        run_scene(small(), out, command="test", progress=False)
    assert not out.exists()


def test_yade_that_breaks_on_import_says_the_cause(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "yade").mkdir()
    (tmp_path / "yade" / "__init__.py").write_text("raise ImportError('libboost_python311.so.1.74: cannot open')")
    monkeypatch.delitem(sys.modules, "yade", raising=False)
    monkeypatch.setattr(sys, "path", [str(tmp_path), *sys.path])
    monkeypatch.setenv("OMP_NUM_THREADS", "1")
    with pytest.raises(RunError, match=r"^YADE cannot be imported \(libboost_python311\.so\.1\.74: cannot open\)"):
        import_yade()
