"""The study of melting: piles that were laid by hand and lost a known part of themselves."""

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation
from synthetic.released import stack, write_released

from dem.record.run import open_run
from postprocess.measures.spread import centre_of_mass
from studies.framework.runs import MeasuredRun
from studies.melting import BASE, CONTACT, HEIGHT, LIFT, OFFSET, SINCE, SLOUGHED, SPREAD, STUDY, TILT, TOPPLED

Pile = NDArray[np.float64]


def shed(pile: Pile, count: int) -> Pile:
    """Lay the topmost smarticles far outside, apart from each other."""
    left = pile.copy()
    for k in range(1, count + 1):
        left[-k] = pile[0] + k * np.array([0.05, 0.0, 0.0])
    return left


def sunk(pile: Pile, share: float) -> Pile:
    return pile * np.array([1.0, 1.0, share])


def fallen(pile: Pile) -> Pile:
    """Turn the pile onto its side about a line in the floor, 20 mm from the axis."""
    edge = np.array([0.02, 0.0, 0.0])
    turned = Rotation.from_euler("y", 90, degrees=True).apply((pile - edge).reshape(-1, 3))
    return turned.reshape(pile.shape) + edge


def measured(directory: Path) -> MeasuredRun:
    return STUDY.measured(open_run(directory))


def test_a_run_is_measured_against_time_from_when_the_wall_went(tmp_path: Path) -> None:
    run = measured(write_released(tmp_path / "run", "internal", before=stack(), after=shed(stack(), 3)))
    assert run.history[SINCE] == pytest.approx([0, 0.5, 1, 1.5, 2])
    assert run.history[SLOUGHED].tolist() == [0, 0, 0.3, 0.3, 0.3]
    assert run.history[CONTACT].tolist() == [1, 1, 0.7, 0.7, 0.7]
    assert (run.history[HEIGHT][0], run.row[SLOUGHED], run.row[LIFT]) == (1, 0.3, 0)
    assert run.history[SPREAD][-1] > 5


def test_a_pile_that_fell_over_differs_from_one_that_sank(tmp_path: Path) -> None:
    afters = {"over": fallen(stack()), "sank": sunk(stack(), 0.99)}
    over, sank = (
        dict(measured(write_released(tmp_path / name, "shape-change", before=stack(), after=after)).row)
        for name, after in afters.items()
    )
    assert (over[TOPPLED], sank[TOPPLED]) == (1, 0)
    height = centre_of_mass(stack())[2]
    # Turned about the edge, the centre of mass came from (0, h) to (20 mm + h, 20 mm).
    assert float(str(over[OFFSET])) * float(str(over[BASE])) == pytest.approx(0.02 + height)
    assert over[TILT] == pytest.approx(np.degrees(np.arctan2(0.02 + height, 0.02)))
    assert sank[TILT] == pytest.approx(0, abs=1e-6)
    assert sank[HEIGHT] == pytest.approx(0.99)
