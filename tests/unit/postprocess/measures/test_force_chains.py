"""Force chains, on forces whose answer is on paper; and on what a run has recorded."""

import math
from pathlib import Path

import numpy as np
import pytest
from synthetic import SyntheticRun, write_run
from synthetic.forces import pressed, write_forces

from dem.errors import InputError
from dem.record.forces import has_forces, read_forces
from dem.record.frames import read_frames
from dem.record.run import Run, open_run
from postprocess.geometry.links import UndefinedMeasureError
from postprocess.measures.force_chains import (
    MEASURES,
    force_chains,
    force_distribution,
    force_participation,
    strong_contacts,
)
from postprocess.measures.table import measure_run

MEASURE = MEASURES[0]


@pytest.fixture
def run(tmp_path: Path) -> Path:
    return write_run(tmp_path / "run", SyntheticRun(count=6, frames_per_phase=1, phases=("relax",)))


def test_exponential_forces_have_the_shares_of_theory() -> None:
    forces = np.random.default_rng(1).exponential(3e-3, 200_000)
    above = strong_contacts(forces)
    assert above.mean() == pytest.approx(math.exp(-1), rel=0.01)
    assert forces[above].sum() / forces.sum() == pytest.approx(2 / math.e, rel=0.01)
    assert force_participation(forces) == pytest.approx(0.5, rel=0.01)


@pytest.mark.parametrize("count", [1, 7])
def test_forces_that_are_alike_share_alike_and_none_is_strong(count: int) -> None:
    assert force_participation([2.0] * count) == pytest.approx(1.0)
    assert not strong_contacts([2.0] * count).any()


def test_no_contact_has_no_chain() -> None:
    with pytest.raises(UndefinedMeasureError, match="at least 1 contact"):
        force_participation([])


def test_chains_are_joined_by_strong_contacts_alone(run: Path) -> None:
    # 0 - 1 - 2 carry much, 3 - 4 hold 1 up with little; the floor carries all and counts for nothing.
    write_forces(run, pressed([(0, 1), (1, 2), (1, 3), (3, 4), (2, -1)], [5.0, 4.0, 1.0, 1.0, 90.0]))
    frame, manifest = read_frames(run)[-1], open_run(run)
    chains = force_chains(frame)
    assert chains.sizes.tolist() == [3, 1, 1, 1]
    assert chains.labels.tolist()[:3] == [0, 0, 0]
    values = MEASURE.columns(frame, manifest)
    assert list(values.values()) == pytest.approx([4, 2.75, 0.1, 0.5, 9 / 11, 121 / (4 * 43), 0.5])
    table = measure_run(Run(run))
    assert float(table["strong share of force [-]"].iloc[-1]) == pytest.approx(9 / 11)


def test_a_run_that_records_none_has_no_such_columns_and_says_how_to(run: Path) -> None:
    assert not has_forces(run)
    assert not MEASURE.available_for(open_run(run))
    assert not [name for name in measure_run(Run(run)).columns if "force" in name and "chain" in name]
    with pytest.raises(InputError, match=r"cannot read forces .*force_000000.vtu: .*recording.contact_forces: true"):
        read_forces(read_frames(run)[0])


def test_exponential_forces_have_an_exponential_density():
    forces = np.random.default_rng(0).exponential(0.003, 200_000)
    found = force_distribution(forces, bins=16, largest=4.0)
    middles = (found.edges[:-1] + found.edges[1:]) / 2
    assert found.density == pytest.approx(np.exp(-middles), rel=0.06)
    assert found.mean_N == pytest.approx(0.003, rel=0.02)
    assert found.count == 200_000
    # Forces above the largest one still count: the integral is the fraction below.
    assert (found.density * np.diff(found.edges)).sum() == pytest.approx(1 - np.exp(-4), abs=0.002)


def test_the_distribution_of_recorded_forces_leaves_walls_out(tmp_path):
    directory = write_run(tmp_path, SyntheticRun(frames_per_phase=1, phases=("deposit",)))
    write_forces(directory, pressed([(0, 1), (1, 2), (3, -1)], [1.0, 3.0, 50.0]))
    found = force_distribution(Run(directory).forces[-1], bins=4, largest=2.0)
    assert (found.count, found.mean_N) == (2, 2.0)
    assert found.density.tolist() == [0, 1, 0, 1]


@pytest.mark.parametrize("keywords", [{"bins": 0}, {"largest": 0.0}])
def test_intervals_of_forces_must_exist(keywords):
    with pytest.raises(InputError, match="intervals"):
        force_distribution([1.0], **keywords)
