"""Studies of variants of one scene: runs are named VARIANT_seedN."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

from dem.errors import InputError
from dem.record.manifest import RunManifest

VARIANT = "variant"

_VARIANT_RUN = re.compile(r"(?P<variant>.+)_seed(?P<seed>\d+)")


def named_variant(directory: Path | str) -> tuple[str, int]:
    """Variant and seed of a run of a study of variants, by the name of its directory.

    Raises:
        InputError: It is not named like one.
    """
    found = _VARIANT_RUN.fullmatch(Path(directory).name)
    if found is None:
        msg = f"{directory}: not a run of this study: its runs are named VARIANT_seedN, such as draft_seed1"
        raise InputError(msg)
    return found["variant"], int(found["seed"])


def variant_of(run: RunManifest) -> str:
    """Variant of a run, by the name of its directory.

    Raises:
        InputError: It is not named like a run of such a study, or after another seed.
    """
    variant, seed = named_variant(run.directory)
    if seed != run.seed:
        msg = f"{run.directory}: its name says seed {seed}, run.json says {run.seed}; do not rename runs"
        raise InputError(msg)
    return variant


def variants_of(run_dirs: Sequence[Path | str]) -> list[str]:
    """All variants in the order given, those without a finished run among them."""
    known = [path for path in run_dirs if _VARIANT_RUN.fullmatch(Path(path).name)]
    return list(dict.fromkeys(named_variant(path)[0] for path in known))
