"""Scenes made and changed in Python: arrays, checked copies, the keys of the scene as attributes."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pandas as pd
import pytest

from dem.errors import InputError
from dem.scene.scene import Scene

ROD = {"shape": "rod", "length_m": 0.01}


def made(**keys: Any) -> Scene:
    return Scene(**{"seed": 1, "count": 5, "fidelity": "draft", "phases": [{"type": "deposit"}], **keys})


def test_numbers_and_arrays_of_numpy_are_keys_like_others() -> None:
    scene = made(
        seed=np.int64(3),
        count=np.arange(7)[-1],
        gravity_m_per_s2=np.float64(1.6),
        smarticle={"aspect_ratio": np.float32(0.5), "angles_deg": np.array([80.0, 90.0])},
        phases=[{"type": "relax" if k else "deposit", **({"duration_s": t} if k else {})} for k, t in
                enumerate(np.linspace(0, 1, 3))],
    )  # fmt: skip
    plain = made(
        seed=3,
        count=6,
        gravity_m_per_s2=1.6,
        smarticle={"aspect_ratio": 0.5, "angles_deg": [80, 90]},
        phases=[{"type": "deposit"}, {"type": "relax", "duration_s": 0.5}, {"type": "relax", "duration_s": 1.0}],
    )
    assert scene == plain
    assert made(smarticle={"angles_deg": pd.Series([80, 90])}).smarticle.angles_deg == (80, 90)
    with pytest.raises(InputError, match=r"count: 2\.5 is not a whole number"):
        made(count=np.float64(2.5))


COPIES: dict[str, Callable[..., Scene]] = {
    "replace": lambda scene, **keys: scene.replace(**keys),
    "model_copy": lambda scene, **keys: scene.model_copy(update=keys),
    "copy.replace": lambda scene, **keys: scene.__replace__(**keys),
}


@pytest.mark.parametrize("copied", COPIES.values(), ids=COPIES)
def test_copies_are_checked_as_new_scenes_are(copied: Callable[..., Scene]) -> None:
    scene = made(engine="yade")
    assert copied(scene, count=8) == made(engine="yade", count=8)
    with pytest.raises(InputError, match="count: -1 is out of range; use at least 1"):
        copied(scene, count=-1)
    with pytest.raises(InputError, match="unknown key 'cuont'; did you mean 'count'"):
        copied(scene, cuont=8)
    assert scene.count == 5


def test_copies_change_nested_keys_and_what_follows_from_them() -> None:
    scene = made(phases=[{"type": "deposit", "thrown_at_m_per_s": 3.0}])
    gentle = scene.replace(**{"phases.0.thrown_at_m_per_s": 0.0, "smarticle.aspect_ratio": 0.4})
    assert gentle == made(
        smarticle={"aspect_ratio": 0.4}, phases=[{"type": "deposit", "thrown_at_m_per_s": 0.0}]
    )  # fmt: skip
    assert gentle.fidelity.stiffness_N_per_m < scene.fidelity.stiffness_N_per_m
    assert scene.replace(fidelity="standard") == made(phases=scene.phases, fidelity="standard")
    assert made(fidelity={"base": "draft", "rows": 2}).replace(count=6).fidelity.rows == 2
    with pytest.raises(InputError, match=r"phases\.4\.type: there is no '4' in the scene"):
        scene.replace(**{"phases.4.type": "relax"})


def test_scenes_with_bodies_that_were_computed_are_compared_by_their_keys() -> None:
    one, other = made(particle=ROD), made(particle=ROD)
    assert one.mixture is not None
    assert other.mixture is not None
    assert one == other
    assert len({one, other, made()}) == 2
    assert one != other.replace(seed=2)


def test_a_scene_says_how_to_change_it() -> None:
    scene = made()
    with pytest.raises(InputError, match=r"count: .* scene\.replace\(count=…\)"):
        scene.count = 4
    assert scene.count == 5


def test_the_key_particle_is_an_attribute() -> None:
    assert made().particle is None
    assert made().body.boxes.mass > 0
    scene = made(particle=ROD)
    assert scene.particle is not None
    assert [shape.length_m for shape in scene.particle] == [0.01]  # type: ignore[union-attr]
    with pytest.raises(InputError, match=r"scene\.bodies"):
        _ = scene.body
