"""Fixtures of tests that read run directories: smarticles and small runs, in the files of `dem.record`."""

import json

import meshio
import numpy as np
import pytest

from dem.record.frames import FrameWriter
from synthetic import SyntheticRun, mesh_of, write_manifest, write_series
from synthetic.shapes import W, bent, random_scene

PHASES = ("deposit", "relax", "shake", "relax")


@pytest.fixture(scope="session")
def shape():
    return bent


@pytest.fixture(scope="session")
def scene():
    return random_scene


@pytest.fixture(scope="session")
def make_run(tmp_path_factory):
    """Writes a run directory; `plan` is a list of (phase, lift of the pile [m]) per frame, each 0.1 s or at `times`."""

    def make(plan=((0, 0.0), (1, 0.0), (2, 0.001)), *, times=None, ending=None, series=True):
        times = 0.1 * np.arange(len(plan)) if times is None else np.array(times)
        directory = tmp_path_factory.mktemp("run")
        made = SyntheticRun(name="pile", seed=7, count=6, phases=PHASES)
        write_manifest(directory, made, scene_sha256="abc")
        (directory / "scene.yaml").write_text("schema_version: 1\nfidelity: {rows: 1, pitch: 1.0}\n", encoding="utf-8")
        pile = random_scene(6, 3, box=1.5, width=W, angles=(90, 90)) - [W / 2, W / 2, 0]
        frames = FrameWriter(directory)
        for number, (phase, lift) in enumerate(plan):
            # The first frame is poured in part only.
            poured = (pile + np.array([0, 0, lift]))[: 1 if number == 0 else None]
            contacts = np.arange(len(poured))
            frames.write(
                mesh_of(poured, time=times[number], phase=phase, floor_z=-0.002, contacts=contacts), times[number]
            )
        if series:
            columns = {
                "time_s": times,
                "phase": np.array([phase for phase, _ in plan]),
                "kinetic_energy_J": 10.0 * times,
                "unbalanced_force": 1.0 - times,
                "container_force_N": np.outer(times, [1.0, 2.0, 3.0]),
            }
            write_series(directory, columns, seed=7, scene_sha256="abc")
        if ending is not None:
            name, content = ending
            (directory / name).write_text(json.dumps(content))
        return directory

    return make


@pytest.fixture
def run(make_run):
    return make_run()


@pytest.fixture(scope="session")
def write_frame():
    """Writes one frame file, changed on request, and returns its path; keywords as `mesh_of`."""

    def write(directory, vertices=None, *, drop=None, change=None, **keywords):
        vertices = random_scene(2, 0) if vertices is None else vertices
        mesh = mesh_of(vertices, **keywords)
        mesh.cell_data["smarticle_id"][0] += 100
        mesh.cell_data["velocity_m_per_s"][0] = np.arange(9.0 * len(vertices)).reshape(-1, 3)
        mesh.cell_data.pop(drop, None)
        if change is not None:
            change(mesh)
        path = directory / "frame.vtu"
        meshio.vtu.write(path, mesh, binary=True, compression="zlib")
        return path

    return write
