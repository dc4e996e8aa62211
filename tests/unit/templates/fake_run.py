"""Stands for `smarticles run`: writes what the runner reads, as its first argument says.

fake_run.py BEHAVIOUR SCENE DIR [--resume]
"""

import hashlib
import json
import os
import re
import signal
import sys
import time
from pathlib import Path


def main() -> int:
    behaviour, scene, directory = sys.argv[1], Path(sys.argv[2]), Path(sys.argv[3])
    if behaviour == "reject":
        print("smarticles: error: scene.yaml: count: -1 is negative; use 1", file=sys.stderr)
        return 2
    resume = sys.argv[4:] == ["--resume"]
    if not resume and directory.exists() and any(directory.iterdir()):
        print("smarticles: error: --out: holds another run", file=sys.stderr)
        return 2
    directory.mkdir(parents=True, exist_ok=True)
    sha256 = re.search(r"# sha256 (\w+)", scene.read_text())
    assert sha256 is not None
    write_manifest(directory, sha256[1])
    (directory / "searched").write_text(os.environ.get("PYTHONPATH", ""))
    (directory / "threads").write_text(os.environ["OMP_NUM_THREADS"])
    held = [str(fd.readlink()) for fd in descriptors() if fd.is_symlink()]
    (directory / "held").write_text("\n".join(held))
    (directory / "id").write_text(hashlib.sha256(os.urandom(8)).hexdigest())
    if behaviour == "fail":
        failed = {"status": "failed", "cause": "left through the wall", "time_s": 0.1}
        (directory / "failed.json").write_text(json.dumps(failed))
        return 1
    if behaviour == "crash":
        print("Segmentation something", flush=True)
        os.kill(os.getpid(), signal.SIGKILL)
    if behaviour == "silent":
        return 0
    if behaviour == "wait":
        return wait(directory)
    if behaviour == "deaf":
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        (directory / "progress.json").write_text("{}")
        time.sleep(600)
    (directory / "done.json").write_text(
        json.dumps({"status": "done", "time_s": 1.0, "steps": 1, "wall_s": 1.0, "phases": []})
    )
    return 0


def write_manifest(directory: Path, sha256: str) -> None:
    """The keys that `Manifest` asks for."""
    words = dict.fromkeys(("name", "command", "started", "fidelity"), "")
    lengths = ("middle_length_m", "barb_length_m", "thickness_normal_m", "thickness_in_plane_m", "container_radius_m")
    numbers = dict.fromkeys((*lengths, "smarticle_mass_kg", "solid_volume_m3", "sphere_diameter_m", "time_step_s"), 1.0)
    counts = dict.fromkeys(("seed", "threads", "count", "aspect_ratio", "spheres_per_smarticle"), 1)
    data = {"format": 1, "scene_sha256": sha256, "versions": {}, "phases": [], **words, **numbers, **counts}
    (directory / "run.json").write_text(json.dumps(data))


def descriptors() -> list[Path]:
    """What may be open beside the standard streams."""
    return [Path(f"/proc/self/fd/{number}") for number in range(3, 4096)]  # tests before may hold many


def wait(directory: Path) -> int:
    """Until Ctrl-C; then close the files, as a run does."""
    progress = {"phase": "shake", "phase_index": 2, "time_s": 1.25, "end_s": 5.5, "phi": 0.123}
    try:
        temporary = directory / "temporary"
        temporary.write_text(json.dumps(progress))
        temporary.replace(directory / "progress.json")
        time.sleep(600)
    except KeyboardInterrupt:
        (directory / "failed.json").write_text(json.dumps({"status": "interrupted", "cause": "…", "time_s": 1.25}))
        return 130
    return 0


sys.exit(main())
