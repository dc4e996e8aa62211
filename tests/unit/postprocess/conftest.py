"""Smarticles and run directories to measure, made to the contract of ARCHITECTURE.md."""

import json

import h5py
import meshio
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

W, T1, T2, RADIUS = 11.7e-3, 1.27e-3, 0.5e-3, 0.0234


def u_shape(width=W, aspect_ratio=0.7, angles=(90.0, 90.0)):
    """One smarticle in the plane z = 0, middle link along x, mouth up y; angles in degrees."""
    first, second = np.radians(angles)
    barb = aspect_ratio * width
    left, right = np.array([-width / 2, 0, 0]), np.array([width / 2, 0, 0])
    tip_left = left + barb * np.array([-np.cos(first), np.sin(first), 0])
    tip_right = right + barb * np.array([np.cos(second), np.sin(second), 0])
    return np.array([tip_left, left, right, tip_right])


def random_scene(count, seed, *, box=3.0, width=1.0, aspect_ratio=0.7, angles=None):
    """Smarticles at random poses in a cube of `box` widths; random angles unless given."""
    rng = np.random.default_rng(seed)
    scene = []
    for _ in range(count):
        bend = rng.uniform(-15, 105, 2) if angles is None else angles
        turn = Rotation.random(rng=rng).as_matrix()
        shape = u_shape(width, aspect_ratio, bend)
        scene.append(shape @ turn.T + rng.uniform(0, box * width, 3))
    return np.array(scene)


@pytest.fixture(scope="session")
def shape():
    return u_shape


@pytest.fixture(scope="session")
def scene():
    return random_scene


def frame_mesh(vertices, *, time=0.0, phase=0, floor_z=0.0, contacts=None, extra=None):
    """A frame as a meshio mesh, line by line as the contract says."""
    count = len(vertices)
    first = 4 * np.arange(count)[:, None] + np.arange(3)
    lines = np.stack([first, first + 1], axis=-1).reshape(-1, 2)
    links = 3 * count
    contacts = np.arange(count) if contacts is None else np.asarray(contacts)
    data = {
        "smarticle_id": np.repeat(np.arange(count) + 100, 3),
        "link": np.tile([0, 1, 2], count),
        "velocity_m_per_s": np.arange(3.0 * links).reshape(links, 3),
        "angular_velocity_rad_per_s": np.zeros((links, 3)),
        "contacts": np.repeat(contacts, 3),
        "time_s": np.full(links, time),
        "floor_z_m": np.full(links, floor_z),
        "phase": np.full(links, phase),
        **(extra or {}),
    }
    points = np.asarray(vertices).reshape(-1, 3)
    return meshio.Mesh(points, [("line", lines)], cell_data={name: [values] for name, values in data.items()})


def write_pvd(directory, times, files):
    entries = "".join(
        f'<DataSet timestep="{time}" group="" part="0" file="{file}"/>\n'
        for time, file in zip(times, files, strict=True)
    )
    (directory / "frames.pvd").write_text(
        f'<?xml version="1.0"?>\n<VTKFile type="Collection" version="0.1"><Collection>\n{entries}'
        "</Collection></VTKFile>\n"
    )


MANIFEST = {
    "format": 1,
    "name": "pile",
    "scene_sha256": "abc",
    "seed": 7,
    "command": "smarticles run pile.yaml --out pile",
    "started": "2025-01-01T00:00:00",
    "versions": {"yade": "2023.02a"},
    "threads": 1,
    "fidelity": "draft",
    "count": 6,
    "aspect_ratio": 0.7,
    "middle_length_m": W,
    "barb_length_m": 0.7 * W,
    "thickness_normal_m": T1,
    "thickness_in_plane_m": T2,
    "smarticle_mass_kg": 1.4e-4,
    "solid_volume_m3": T1 * T2 * 2.4 * W,
    "container_radius_m": RADIUS,
    "sphere_diameter_m": T1,
    "spheres_per_smarticle": 22,
    "time_step_s": 1e-5,
    "phases": [
        {"index": 0, "type": "deposit"},
        {"index": 1, "type": "relax"},
        {"index": 2, "type": "shake"},
        {"index": 3, "type": "relax"},
    ],
}


def write_series(directory, times):
    columns = {
        "time_s": (times, "s"),
        "phase": (np.zeros(len(times), dtype=int), "-"),
        "kinetic_energy_J": (10.0 * times, "J"),
        "unbalanced_force": (1.0 - times, "1"),
        "container_force_N": (np.outer(times, [1.0, 2.0, 3.0]), "N"),
    }
    with h5py.File(directory / "series.h5", "w") as file:
        file.attrs.update({"format": 1, "scene_sha256": "abc", "seed": 7})
        for name, (values, unit) in columns.items():
            dataset = file.create_dataset(name, data=values)
            dataset.attrs.update({"unit": unit, "description": f"the {name}"})


@pytest.fixture(scope="session")
def make_run(tmp_path_factory):
    """Writes a run directory; `plan` is a list of (phase, lift of the pile [m]) per frame."""

    def make(plan=((0, 0.0), (1, 0.0), (2, 0.001)), *, ending=None, extra=None, series=True):
        directory = tmp_path_factory.mktemp("run")
        (directory / "frames").mkdir()
        (directory / "run.json").write_text(json.dumps(MANIFEST))
        pile = random_scene(6, 3, box=1.5, width=W, angles=(90, 90)) - [W / 2, W / 2, 0]
        times, files = [], []
        for number, (phase, lift) in enumerate(plan):
            mesh = frame_mesh(
                # The first frame is poured in part only.
                (pile + np.array([0, 0, lift]))[: 1 if number == 0 else None],
                time=0.1 * number,
                phase=phase,
                floor_z=-0.002,
                extra=extra,
            )
            files.append(f"frames/frame_{number:06d}.vtu")
            times.append(0.1 * number)
            meshio.vtu.write(directory / files[-1], mesh, binary=True, compression="zlib")
        write_pvd(directory, times, files)
        if series:
            write_series(directory, np.array(times))
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
    """Writes one frame file and returns its path; keywords as `frame_mesh`."""

    def write(directory, vertices=None, *, drop=None, change=None, **keywords):
        vertices = random_scene(2, 0) if vertices is None else vertices
        mesh = frame_mesh(vertices, **keywords)
        mesh.cell_data.pop(drop, None)
        if change is not None:
            change(mesh)
        path = directory / "frame.vtu"
        meshio.vtu.write(path, mesh, binary=True, compression="zlib")
        return path

    return write
