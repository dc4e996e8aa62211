"""The shipped studies: each `NAME.py` with a `NAME.yaml` beside it.

A variant of the sweep is a study of its own, `strength-code` of `strength.yaml@code`, but for `quick`, which is the
quick variant of them all. Nothing large is imported before a study is loaded.
"""

from __future__ import annotations

import ast
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
    """A study: a script and its sweep file with some variants, and whether there is a quick one besides."""

    name: str
    module: str
    variants: tuple[str, ...] = ()
    quick: bool = True

    @cached_property
    def about(self) -> str:
        """First paragraph of the script, for `--help`."""
        text = ast.get_docstring(ast.parse((FOLDER / f"{self.module}.py").read_text(encoding="utf-8"))) or ""
        return f"variant {' '.join(self.variants)} of {self.module}" if self.variants else text.split("\n\n")[0]

    @property
    def pictured(self) -> Mapping[str, object]:
        """Values of the run that a picture is drawn of."""
        return self.load().pictured

    def load(self) -> Study:
        """Import the study."""
        study: Study = importlib.import_module(f"studies.{self.module}").STUDY
        return replace(study, name=self.name)

    def sweep_file(self, *, quick: bool = False) -> Path:
        """Name the sweep file with its variants, as `load_sweep` reads it; InputError without a quick variant."""
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
            for on_yade in [(changes.get("constants") or {}).get("engine") == "yade"]  # which takes no minutes
        ]
    return found


STUDIES: Mapping[str, Script] = MappingProxyType({study.name: study for study in _scripts()})  #: By name


def shipped(name: str) -> Script:
    """Find a shipped study; InputError where there is none of this name."""
    if name not in STUDIES:
        raise InputError(f"study {name!r} does not exist; {nearest(name, sorted(STUDIES))}")
    return STUDIES[name]


def study_file(name: str, *, quick: bool = False) -> Path:
    """Name the sweep file of a study, see `Script.sweep_file`."""
    return shipped(name).sweep_file(quick=quick)
