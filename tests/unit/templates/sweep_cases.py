"""A small sweep, and the types of the boundaries that write it."""

from collections.abc import Callable
from pathlib import Path

from templates.sweep.folder import Folder

SCENE = """\
schema_version: 1
name: test
seed: {{ seed }}
count: {{ count }}
phases:
  - {type: deposit}
"""

SWEEP = """\
schema_version: 1
name: test
template: scene.yaml.j2
run_name: "n{{ count }}_seed{{ seed }}"
points:
  grid: {count: [10, 20]}
repeats: {seeds: [1, 2]}
"""

WriteSweep = Callable[..., Path]
MakeFolder = Callable[..., Folder]
