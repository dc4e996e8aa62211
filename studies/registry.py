"""The shipped studies: pairs of a script `NAME.py` and a sweep file `NAME.yaml` in this folder.

Each variant of a sweep file is a study too: `strength-code` is `strength.yaml@code`. The variant `quick` is instead
applied to any of these studies by `--quick`. Libraries are imported when a study is loaded, so that `--help` is fast.
"""

from __future__ import annotations

import importlib
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING

import yaml

from dem.errors import InputError, nearest

if TYPE_CHECKING:
    from studies.framework.study import Study

FOLDER = Path(__file__).parent
QUICK = "quick"


@dataclass(frozen=True)
class Script:
    """A shipped study that is not imported yet: names of its script and of the variants of its sweep file."""

    name: str  #: Name of the study, such as `strength-code`
    module: str  #: Name of the script, such as `strength`
    variants: tuple[str, ...] = ()  #: Variants of the sweep, such as `("code",)`
    quick: bool = True  #: Whether there is a quick variant

    @cached_property
    def about(self) -> str:
        """First paragraph of the script's docstring, for `--help`."""
        if self.variants:
            return f"variant {' '.join(self.variants)} of {self.module}"
        # All commands need this text, and Python's parser takes 50 ms for the scripts.
        docstring = (FOLDER / f"{self.module}.py").read_text(encoding="utf-8").split('"""')[1]
        return docstring.split("\n\n")[0].strip()

    @cached_property
    def found(self) -> str:
        """What the full study found, in one sentence with the folder of its results; empty if unpublished.

        It is read from `results/NAME/README.md`, which exists in the repository but not in installed packages.
        """
        page = FOLDER.parent / "results" / self.name / "README.md"
        lines = page.read_text(encoding="utf-8").splitlines() if page.is_file() else []
        finding = next((line.removeprefix("> ") for line in lines if line.startswith("> ")), "")
        return finding and f"{finding.rstrip('.')} (results/{self.name})."

    def load(self) -> Study:
        """Import the script and return its study."""
        study: Study = importlib.import_module(f"studies.{self.module}").STUDY
        return replace(study, name=self.name)

    def sweep_file(self, *, quick: bool = False) -> Path:
        """Return the path of the sweep file with the variants to be applied, `FILE@VARIANT,VARIANT`.

        `quick` adds the variant `quick`; InputError if the study has none.
        """
        if quick and not self.quick:
            raise InputError(f"study {self.name} has no quick variant; leave --quick out")
        variants = [*self.variants, *([QUICK] if quick else [])]
        return FOLDER / (f"{self.module}.yaml" + (f"@{','.join(variants)}" if variants else ""))


def _scripts() -> list[Script]:
    found = []
    for file in sorted(FOLDER.glob("*.yaml")):
        if not file.with_suffix(".py").is_file():
            continue
        sweep = yaml.load(file.read_text(encoding="utf-8"), Loader=getattr(yaml, "CSafeLoader", yaml.SafeLoader))
        variants = sweep.get("variants") or {}
        name, quick = file.stem.replace("_", "-"), QUICK in variants
        found.append(Script(name=name, module=file.stem, quick=quick))
        found += [
            Script(name=f"{name}-{variant}", module=file.stem, variants=(variant,), quick=quick and not on_yade)
            for variant, changes in variants.items()
            if variant != QUICK
            for on_yade in [(changes.get("constants") or {}).get("engine") == "yade"]  # too slow to be quick
        ]
    return found


STUDIES: Mapping[str, Script] = MappingProxyType({study.name: study for study in _scripts()})  #: All studies by name


def study_of(files: Mapping[str, str]) -> tuple[Script, bool] | None:
    """Find the shipped study that a sweep is, by the texts of its files; None if it is none.

    Args:
        files: texts of the sweep file and its template by file name, as in the manifest of a sweep.

    Returns:
        The study, and whether the sweep is its quick variant.
    """
    from templates.sweep.sweep_file import load_sweep  # noqa: PLC0415

    for study in STUDIES.values():
        for quick in (False, True) if study.quick else (False,):
            file = study.sweep_file(quick=quick)
            if file.name not in files:
                continue
            sweep = load_sweep(file)
            if (files[file.name], files.get(sweep.content.template)) == (sweep.text, sweep.template_text):
                return study, quick
    return None


def shipped(name: str) -> Script:
    """Return the shipped study with a name; InputError if there is none."""
    if name not in STUDIES:
        raise InputError(f"study {name!r} does not exist; {nearest(name, sorted(STUDIES))}")
    return STUDIES[name]
