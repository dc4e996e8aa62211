"""The walls between the packages: who may import what, read from the sources and checked in a fresh process."""

from __future__ import annotations

import ast
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PACKAGES = ("cli", "dem", "postprocess", "stability", "templates", "verification")
SOURCES = sorted(path for package in PACKAGES for path in (ROOT / package).rglob("*.py"))


def imported(nodes: Iterator[ast.AST], package: str) -> Iterator[str]:
    """Full names of what import statements and `importlib.import_module("…")` bring in."""
    for node in nodes:
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = node.module or ""
            if node.level:  # relative
                base = ".".join(filter(None, [package, base]))
            yield from (f"{base}.{alias.name}" for alias in node.names)
        elif isinstance(node, ast.Call) and node.args and isinstance(node.args[0], ast.Constant):
            function = node.func
            name = function.attr if isinstance(function, ast.Attribute) else getattr(function, "id", "")
            if name in ("import_module", "__import__", "find_spec") and isinstance(node.args[0].value, str):
                yield node.args[0].value


def at_import(tree: ast.Module) -> Iterator[ast.AST]:
    """Nodes that run when the module is imported: everything outside of functions."""
    waiting: list[ast.AST] = list(tree.body)
    while waiting:
        node = waiting.pop()
        if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef, ast.Lambda)):
            continue
        yield node
        waiting += ast.iter_child_nodes(node)


def names(path: Path, *, only_at_import: bool = False) -> set[str]:
    tree = ast.parse(path.read_text(encoding="utf-8"))
    package = ".".join(path.relative_to(ROOT).parent.parts)
    return set(imported(at_import(tree) if only_at_import else ast.walk(tree), package))


def among(found: set[str], *roots: str) -> set[str]:
    return {name for name in found if any(name == root or name.startswith(f"{root}.") for root in roots)}


def of(package: str) -> list[Path]:
    return [path for path in SOURCES if path.relative_to(ROOT).parts[0] == package]


def test_the_walker_sees_what_it_must(tmp_path: Path) -> None:
    source = "import a.b\nfrom c import d\ndef f():\n    from e import g\n    importlib.import_module('h.i')\n"
    tree = ast.parse(source)
    assert set(imported(ast.walk(tree), "p")) == {"a.b", "c.d", "e.g", "h.i"}
    assert set(imported(at_import(tree), "p")) == {"a.b", "c.d"}
    assert len(SOURCES) > 20
    assert all(of(package) for package in PACKAGES)


def test_only_one_module_imports_yade() -> None:
    importers = {str(path.relative_to(ROOT)) for path in SOURCES if among(names(path), "yade")}
    assert importers - {"cli/doctor.py"} == {"dem/library.py"}  # doctor only asks whether YADE is there
    assert not among(names(ROOT / "dem" / "library.py", only_at_import=True), "yade")


def test_dem_knows_no_pictures_no_measures_and_no_templates() -> None:
    for path in of("dem"):
        assert not among(names(path), "pyvista", "vtk", "vtkmodules", "postprocess", "templates", "cli"), path
        assert not among(names(path), "verification"), path


def test_postprocess_knows_neither_yade_nor_the_simulator() -> None:
    for path in of("postprocess"):
        found = names(path)
        assert not among(found, "yade", "templates", "cli", "verification"), path
        assert not among(found, "dem") - among(found, "dem.errors", "dem.record.files"), path


def test_verification_knows_the_simulator_and_draws_nothing() -> None:
    for path in of("verification"):
        found = names(path)
        assert not among(found, "yade", "pyvista", "vtk", "matplotlib", "postprocess", "templates", "cli"), path


def test_stability_knows_the_simulator_and_its_bench() -> None:
    for path in of("stability"):
        # Its figure is drawn from a table, in a process of its own.
        allowed = {"postprocess.report.figures"} if path.name == "figure.py" else set()
        assert not among(names(path), "yade", "pyvista", "vtk", "postprocess", "templates", "cli") - allowed, path


def test_templates_know_only_the_scene() -> None:
    for path in of("templates"):
        found = names(path)
        assert not among(found, "yade", "pyvista", "vtk", "postprocess", "cli"), path
        allowed = among(
            found, "dem.scene.scene", "dem.setting.parts", "dem.errors", "dem.record.files", "dem.scene.yaml_text"
        )
        assert not among(found, "dem") - allowed, path


def test_command_line_loads_nothing_heavy_at_import() -> None:
    for path in of("cli"):
        found = names(path, only_at_import=True)
        assert not among(found, "yade", "pyvista", "vtk", "dem.engine.yade.engine", "dem.run.run"), path
        assert not among(found, "postprocess.pictures.render", "postprocess.pictures.stage"), path


MODULES = [
    ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")
    for path in SOURCES
    if path.name != "__main__.py"
]


@pytest.mark.parametrize("package", PACKAGES)
def test_importing_everything_loads_neither_yade_nor_two_vtks(package: str) -> None:
    modules = [name for name in MODULES if name.split(".")[0] == package]
    code = (
        "import importlib, sys\n"
        f"for name in {modules!r}: importlib.import_module(name)\n"
        "loaded = {name.split('.')[0] for name in sys.modules}\n"
        f"print(*sorted(loaded & {{'yade', 'pyvista', 'vtkmodules', 'vtk', *{PACKAGES!r}}}))"
    )
    answer = subprocess.run(
        [sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, timeout=300, check=False
    )
    assert answer.returncode == 0, answer.stderr
    loaded = set(answer.stdout.split())
    assert package in loaded
    assert "yade" not in loaded
    if package in ("dem", "templates", "cli", "verification"):
        assert not loaded & {"pyvista", "vtkmodules", "vtk"}
    if package == "dem":
        assert loaded == {"dem"}
