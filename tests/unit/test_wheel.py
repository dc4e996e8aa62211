"""A wheel of this checkout, installed elsewhere: five packages with their data, and commands that work from it."""

import json
import os
import re
import shutil
import subprocess
import sys
import sysconfig
import zipfile
from collections.abc import Callable
from pathlib import Path

import pytest
from synthetic import SyntheticRun, write_run

from smarticles.sweeps import make_folder
from studies.registry import shipped

ROOT = Path(__file__).resolve().parents[2]
PACKAGES = {"dem", "postprocess", "smarticles", "studies", "templates"}


def call(*command: str | Path, cwd: Path, **variables: str) -> str:
    clean = {name: value for name, value in os.environ.items() if not name.startswith("PYTHON")}
    done = subprocess.run(
        [str(word) for word in command],
        cwd=cwd,
        env={**clean, **variables},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr + done.stdout
    return done.stdout


@pytest.fixture(scope="module")
def sources(tmp_path_factory: pytest.TempPathFactory) -> list[str]:
    """List the files of the repository, changed ones included, ignored ones not."""
    listed = call("git", "ls-files", "--cached", "--others", "--exclude-standard", "-z", cwd=ROOT).split("\0")
    return sorted(name for name in listed if name and (ROOT / name).exists())


@pytest.fixture(scope="module")
def clone(sources: list[str], tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a fresh copy of the repository, in a folder of its name."""
    place = tmp_path_factory.mktemp("clone") / "smarticles"
    for name in sources:
        (place / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy2(ROOT / name, place / name, follow_symlinks=False)
    return place


@pytest.fixture(scope="module")
def wheel(clone: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Build the wheel from a fresh copy."""
    out = tmp_path_factory.mktemp("wheel")
    pip = (sys.executable, "-m", "pip", "-q", "--disable-pip-version-check", "wheel", "--no-deps", "--no-index")
    call(*pip, "--no-build-isolation", "--wheel-dir", out, ".", cwd=clone)
    (built,) = out.iterdir()
    return built


@pytest.fixture(scope="module")
def smarticles(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Callable[..., str]:
    """Return the command of an environment with the wheel and the libraries of this one, without the repository."""
    place = tmp_path_factory.mktemp("far") / "environment"
    call(sys.executable, "-m", "venv", "--without-pip", "--system-site-packages", place, cwd=place.parent)
    python = place / "bin" / "python"
    packages = Path(call(python, "-c", "import sysconfig; print(sysconfig.get_path('purelib'))", cwd=place).strip())
    pip = (sys.executable, "-m", "pip", "-q", "--disable-pip-version-check", "--python", python)
    call(*pip, "install", "--no-deps", "--no-index", "--ignore-installed", wheel, cwd=place)
    # As a line of a .pth file, a folder's own .pth files are not read: those of an editable installation.
    (packages / "libraries.pth").write_text(sysconfig.get_path("purelib") + "\n")

    def run(*words: str | Path) -> str:
        return call(place / "bin" / "smarticles", *words, cwd=place, OMP_NUM_THREADS="1")

    found = call(python, "-c", f"import {', '.join(sorted(PACKAGES))} as last; print(last.__path__)", cwd=place)
    assert str(packages) in found
    return run


def test_nothing_but_the_five_packages_is_put_on_the_path(wheel: Path) -> None:
    with zipfile.ZipFile(wheel) as archive:
        tops = {name.partition("/")[0] for name in archive.namelist()}
    assert {top for top in tops if not top.endswith(".dist-info")} == PACKAGES


def test_every_file_of_the_packages_is_in_the_wheel(wheel: Path, sources: list[str]) -> None:
    with zipfile.ZipFile(wheel) as archive:
        built = {name for name in archive.namelist() if ".dist-info/" not in name}
        table = archive.read("dem/plan/work_precision.csv")
    assert built == {name for name in sources if name.partition("/")[0] in PACKAGES}
    assert table == (ROOT / "results" / "accuracy-links" / "work_precision.csv").read_bytes()


def test_a_study_is_analysed_from_the_wheel(smarticles: Callable[..., str], tmp_path: Path) -> None:
    out = tmp_path / "study"
    folder = make_folder(shipped("gravish").sweep_file(quick=True), out, "test")
    for entry in [one for one in folder.entries if not one.again and one.values["l_over_w"] == 0.7]:
        shake = SyntheticRun(
            aspect_ratio=entry.values["l_over_w"],
            seed=entry.values["seed"],
            count=6,
            frames_per_phase=1,
            friction=0.4 if entry.values["contact"] == "paper" else 0.8,
        )
        manifest = write_run(folder.run(entry), shake) / "run.json"
        content = {**json.loads(manifest.read_text()), "scene_sha256": entry.scene_sha256}
        content["engine"] = entry.values["engine"]
        manifest.write_text(json.dumps(content))
    said = smarticles("study", "gravish", "--quick", "--analyse", "--out", out)
    assert said.startswith("not the full study: ")
    assert (out / "results" / "deviations.csv").is_file()
    assert (out / "results" / "run.png").is_file()


def test_the_installed_clone_is_imported_from_the_folder_that_holds_it(clone: Path, tmp_path: Path) -> None:
    place = tmp_path / "environment"
    call(sys.executable, "-m", "venv", "--without-pip", "--system-site-packages", place, cwd=tmp_path)
    python = place / "bin" / "python"
    packages = Path(call(python, "-c", "import sysconfig; print(sysconfig.get_path('purelib'))", cwd=place).strip())
    (packages / "libraries.pth").write_text(sysconfig.get_path("purelib") + "\n")
    (words,) = re.findall(r" install (.*--editable .*)", (clone / "setup" / "install.sh").read_text())
    pip = (sys.executable, "-m", "pip", "-q", "--disable-pip-version-check", "--python", python)
    call(*pip, "install", "--no-index", "--ignore-installed", *words.split(), cwd=clone)
    said = call(python, "-c", "import smarticles; print(smarticles.Scene, smarticles.__file__)", cwd=clone.parent)
    assert str(clone) in said
