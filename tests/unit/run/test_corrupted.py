"""Whatever befalls the files of a run that was killed: resumed it gives equal bits, or one line says what is wrong.

`CORRUPTED=300 pytest tests/unit/run/test_corrupted.py` tries so many damages instead of a few.
"""

import os
import random
import shutil
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
from damages import DAMAGES, mistyped
from double import KindDouble
from scenes import small

from dem.errors import InputError, RunError
from dem.record.run import open_run
from dem.run.run import run_scene
from dem.run.simulation import Simulation
from dem.scene.scene import Scene

TRIED = int(os.environ.get("CORRUPTED", "25"))


def run(scene: Scene, out: Path, *, resume: bool = False) -> None:
    run_scene(scene, out, command="test", resume=resume)


def results(out: Path) -> list[bytes]:
    """Bits of all numbers in frames and series. Some bits of a frame's file, such as its comment, mean nothing."""
    run = open_run(out)
    frames = [{**vars(frame), **frame.cell_data, "path": 0, "cell_data": 0} for frame in run.frames]
    return [np.asarray(values).tobytes() for data in (*frames, run.series.data) for values in data.values()]


def test_a_damaged_run_continues_with_equal_bits_or_says_what_is_wrong(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    double = KindDouble()
    monkeypatch.setattr("dem.engine.yade.kind.YadeKind", lambda: double)
    phases = [{"type": "deposit", "per_layer": 5}, {"type": "internal-oscillation", "theta_deg": 4, "duration_s": 0.1}]
    recording = {"series_interval_s": 0.004, "frame_interval_s": 0.02, "checkpoint_interval_s": 0.04}
    scene, whole, killed = small({"phases": phases, "recording": recording}), tmp_path / "whole", tmp_path / "killed"
    run(scene, whole)
    with monkeypatch.context() as patch:
        taken, left = Simulation._checkpoint, [3]

        def checkpoint(simulation: Simulation) -> None:
            taken(simulation)
            left[0] -= 1
            if not left[0]:
                raise KeyboardInterrupt

        patch.setattr(Simulation, "_checkpoint", checkpoint)
        with pytest.raises(KeyboardInterrupt):
            run(scene, killed)
    files = sorted(
        str(path.relative_to(killed)) for path in killed.rglob("*") if path.is_file() and path.stat().st_size
    )
    right, ends, bad = results(whole), Counter[str](), list[str]()
    for number in range(TRIED):
        rng, out = random.Random(number), tmp_path / "out"
        shutil.rmtree(out, ignore_errors=True)
        shutil.copytree(killed, out)
        # Half of the damages are to the files outside of folders, all of which a resumed run reads or writes.
        chosen = rng.choice([files, [file for file in files if "/" not in file]])
        damages = {file: rng.choice(DAMAGES) for file in rng.sample(chosen, rng.choice([1, 1, 2]))}
        what = f"{number}: " + ", ".join(f"{file} {damage.__name__}" for file, damage in damages.items())
        for file, damage in damages.items():
            damage(out / file, rng)
        try:
            run(scene, out, resume=True)
            equal = results(out) == right
            ends["equal bits"] += equal
            # A checksum that fits the wrong content is no damage but forgery, which need not be found.
            if not equal and damages.get("checkpoint.zip") is not mistyped:
                bad.append(f"{what}: other bits")
        # The command prints the text of an OSError, such as "Is a directory", in one line too.
        except (InputError, RunError, OSError) as error:
            ends["one line"] += 1
            if len(str(error).splitlines()) != 1:
                bad.append(f"{what}: {error!r}")
        except Exception as error:
            bad.append(f"{what}: {error!r}")
    print(dict(ends))
    assert not bad, "\n".join(bad)
    assert min(ends["one line"], ends["equal bits"]) > TRIED / 10
