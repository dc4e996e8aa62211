"""Imports between packages: the contracts of `.importlinter`, and what those cannot express."""

import subprocess
import sys
from configparser import ConfigParser
from pathlib import Path

import pytest
from importlinter.cli import EXIT_STATUS_SUCCESS, lint_imports

ROOT = Path(__file__).resolve().parents[2]
PACKAGES = ("dem", "postprocess", "smarticles", "studies", "templates")
SOURCES = sorted(path for package in PACKAGES for path in (ROOT / package).rglob("*.py"))
MODULES = [
    ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")
    for path in SOURCES
    if path.name != "__main__.py"
]


def contracts() -> list[str]:
    config = ConfigParser()
    config.read(ROOT / ".importlinter", encoding="utf-8")
    return [name.rpartition(":")[2] for name in config.sections() if name.startswith("importlinter:contract:")]


@pytest.mark.parametrize("contract", contracts())
def test_contract(contract: str, capsys: pytest.CaptureFixture[str]) -> None:
    status = lint_imports(
        config_filename=str(ROOT / ".importlinter"), limit_to_contracts=(contract,), no_cache=True, no_logo=True
    )
    assert status == EXIT_STATUS_SUCCESS, capsys.readouterr().out


@pytest.mark.parametrize("packages", [["dem"], ["postprocess"], ["smarticles", "studies", "templates"]])
def test_importing_everything_loads_neither_yade_nor_two_vtks(packages: list[str]) -> None:
    names = [name for name in MODULES if name.split(".")[0] in packages]
    code = (
        "import importlib, sys\n"
        f"for name in {names!r}: importlib.import_module(name)\n"
        "loaded = {name.split('.')[0] for name in sys.modules}\n"
        f"print(*sorted(loaded & {{'yade', 'pyvista', 'vtkmodules', 'vtk', *{PACKAGES!r}}}))"
    )
    answer = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=False)
    assert answer.returncode == 0, answer.stderr
    loaded = set(answer.stdout.split())
    assert loaded >= set(packages)
    assert "yade" not in loaded
    # Pictures are drawn by modules of `postprocess`, and what imports them does so when it draws.
    if packages != ["postprocess"]:
        assert not loaded & {"pyvista", "vtkmodules", "vtk"}
    if packages == ["dem"]:
        assert not loaded & set(PACKAGES) - {"dem"}
