"""What does not give way, in data and in pictures."""

import json

import numpy as np
import pytest
import yaml
from PIL import Image
from synthetic import RADIUS, SyntheticRun, W, write_run
from synthetic.hooked import AFTER_REST, LOWER, SPEED, UPPER, write_hooked_run

from dem.errors import InputError
from dem.record.frames import read_frames
from dem.record.run import open_run
from postprocess.pictures.camera import MILLIMETRE, Look, extent, wall_corners
from postprocess.pictures.render import render_run
from postprocess.pictures.surroundings import Lift, Surroundings, read_surroundings

TIERS = ((RADIUS, 0.006), (0.018, 0.014), (0.0125, 0.074))  # radius and top


def pulled(directory, **changes):
    """A flat pile: the hook that is pulled is seen above it."""
    keys = {"phases": AFTER_REST, "packing": (0.1,) * 3, "frames_per_phase": 2, "floor_z": -0.003}
    return write_hooked_run(directory, SyntheticRun(**{**keys, **changes}), np.zeros_like)


def changed(directory, **keys):
    """The same run with other keys in its scene."""
    path = directory / "scene.yaml"
    path.write_text(yaml.safe_dump(yaml.safe_load(path.read_text()) | keys))
    return directory


def moulded(directory, *, speed=None, remove=True, duration=1.0):
    """A run in three tiers, whose wall is taken away in its last phase."""
    run = SyntheticRun(phases=("deposit", "relax"), packing=(0.1, 0.1), frames_per_phase=2)
    write_run(directory, run)
    bottoms = (0.0, *(top for _, top in TIERS))
    tiers = [
        {"radius_m": radius, "height_m": top - bottom}
        for (radius, top), bottom in zip(TIERS, bottoms[:-1], strict=True)
    ]
    last = {"type": "remove-container", "duration_s": duration, "speed_m_per_s": speed}
    changed(directory, container={"tiers": tiers}, phases=[{"type": "deposit"}, last])
    if remove:
        for name in ("run.json", "done.json"):
            content = json.loads((directory / name).read_text())
            content["phases"][1]["type"] = "remove-container"
            (directory / name).write_text(json.dumps(content))
    return directory


def around(directory):
    return read_surroundings(open_run(directory))


def test_hooks_are_where_the_series_says(tmp_path):
    """Above the floor, which is not at z = 0."""
    found = around(pulled(tmp_path / "run")).hooks
    assert (found.side, found.length) == (5e-4, W)
    assert found.heights(0.5) == pytest.approx((LOWER, UPPER))
    assert found.heights(1.5 + 0.7) == pytest.approx((LOWER, UPPER + 0.7 * SPEED))


def test_hooks_without_a_series_are_where_they_started(tmp_path):
    run = pulled(tmp_path / "run")
    (run / "series.h5").unlink()
    assert around(run).hooks.heights(3.0) == (LOWER, UPPER)


def test_a_plain_scene_has_a_cylinder_and_nothing_else(tmp_path):
    found = around(write_run(tmp_path / "run", SyntheticRun(frames_per_phase=1)))
    assert (found.hooks, found.tiers, found.removed) == (None, (), None)
    assert found.raised(100.0, 3, 0.01) == 0.0


def test_tiers_have_walls_and_ceilings(tmp_path):
    found = around(moulded(tmp_path / "run"))
    assert np.array(found.tiers) == pytest.approx(np.array(TIERS))
    (wide, low), (middle, half), (narrow, high) = TIERS
    corners = [(wide, 0), (wide, low), (middle, low), (middle, half), (narrow, half), (narrow, high)]
    assert np.array(found.corners) == pytest.approx(np.array(corners))


@pytest.mark.parametrize(("top", "drawn"), [(30.0, 30.0), (1.0, 14 + 11.7 / 4), (500.0, 74.0)])
def test_the_top_tier_is_drawn_as_high_as_it_needs_be(tmp_path, top, drawn):
    run = open_run(moulded(tmp_path / "run"))
    corners = wall_corners(top, run, read_surroundings(run))
    assert corners[-1] == pytest.approx((12.5, drawn))
    assert corners[-2] == pytest.approx((12.5, 14.0))


def test_a_wall_that_goes_at_once_is_gone_with_its_phase(tmp_path):
    found = around(moulded(tmp_path / "run"))
    assert (found.raised(0.9, 0, 0.01), found.raised(1.0, 1, 0.01)) == (0.0, None)


def test_a_lifted_wall_rises_until_it_is_clear_of_the_pile(tmp_path):
    found = around(moulded(tmp_path / "run", speed=0.05, duration=0.4))
    assert found.lift == Lift(start=1.0, end=1.4, speed=0.05)
    assert found.raised(1.1, 1, 0.01) == pytest.approx(0.005)
    assert found.raised(1.3, 1, 0.01) is None
    # It is not clear of a high pile at the end, and stays.
    assert found.raised(9.0, 1, 0.1) == pytest.approx(0.02)


def test_a_lift_that_goes_on_begins_where_the_series_says(tmp_path):
    run = moulded(tmp_path / "run", speed=0.05)
    (run / "done.json").unlink()
    lift = around(run).lift
    assert (lift.start, lift.end) == pytest.approx((1.0, 2.0), abs=0.02)


def test_a_scene_that_lacks_a_key_is_named(tmp_path):
    run = changed(pulled(tmp_path / "run"), hooks={"side_m": 0.001})
    with pytest.raises(InputError, match=r"scene\.yaml: hooks\.upper_height_m is missing"):
        around(run)


# Pictures


def image(run, path, *, color_by="id", **look):
    written = render_run(run, output=path, size=(300, 300), color_by=color_by, **look)
    return np.asarray(Image.open(written).convert("RGB")).astype(int)


def red(pixels):
    return (pixels[..., 0] > 100) & (pixels[..., 0] > 2.2 * pixels[..., 1]) & (pixels[..., 0] > 2.2 * pixels[..., 2])


def test_the_hook_is_drawn_and_rises(tmp_path):
    run = pulled(tmp_path / "run")
    late, early = (red(image(run, tmp_path / f"{time}.png", time=time, color_by="height")) for time in (3.5, 2.5))
    assert min(late.sum(), early.sum()) > 50
    assert np.nonzero(late)[0].min() < np.nonzero(early)[0].min() - 5
    without = write_run(tmp_path / "other", SyntheticRun(frames_per_phase=1))
    assert red(image(without, tmp_path / "b.png", color_by="height")).sum() == 0


def test_a_raised_hook_is_in_the_picture(tmp_path):
    run = open_run(pulled(tmp_path / "run"))
    frame = read_frames(run.path)[-1]
    points = extent(frame, run, Look.checked(color_by="id", size=(300, 300), view="front"), read_surroundings(run))
    assert points[:, 2].max() > (UPPER + 2 * W) * MILLIMETRE


def test_walls_are_drawn_until_they_go_and_faintly_then(tmp_path):
    plain = image(moulded(tmp_path / "plain", remove=False), tmp_path / "plain.png")
    gone = image(moulded(tmp_path / "gone"), tmp_path / "gone.png")
    bluish = [(pixels[..., 2] - pixels[..., 0] > 8).mean() for pixels in (plain, gone)]
    assert bluish[0] > 3 * bluish[1]
    # The outline stays: paler than that of the floor, and not nothing.
    assert ((gone < 250).any(axis=2) & (gone > 190).all(axis=2)).mean() > 0.005


def test_a_wall_that_is_being_lifted_is_drawn_where_it_is(tmp_path):
    """Lifted by little: the same wall, a little higher."""
    run = moulded(tmp_path / "run", speed=0.001)
    resting, lifted = (image(run, tmp_path / f"{time}.png", time=time) for time in (1.0, 1.5))
    assert Surroundings(removed=1, lift=around(run).lift).raised(1.5, 1, 0.01) == pytest.approx(0.0005)
    bluish = [(pixels[..., 2] - pixels[..., 0] > 8) for pixels in (resting, lifted)]
    assert bluish[1].mean() == pytest.approx(bluish[0].mean(), rel=0.2)
    assert (bluish[0] != bluish[1]).any()
