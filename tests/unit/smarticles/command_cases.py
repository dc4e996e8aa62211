"""A sweep to expand, and the types of the boundaries."""

from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

SCENE = """\
schema_version: 1
seed: 1
count: {{ count }}
phases:
  - {type: deposit}
  - {type: shake, duration_s: 1}
"""

SWEEP = """\
schema_version: 1
name: counts
template: scene.yaml.j2
run_name: "n{{ count }}"
points: {grid: {count: [5, 6]}}
"""


class Said(NamedTuple):
    """What a command answered."""

    status: int
    out: str
    err: str


Smarticles = Callable[..., Said]
WriteRun = Callable[..., Path]
