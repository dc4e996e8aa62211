import subprocess
import sys

import h5py
import numpy as np
import pytest

from dem.errors import InputError
from postprocess import read_series


def test_series_holds_values_units_and_descriptions(run):
    series = read_series(run)
    np.testing.assert_allclose(series.time, [0, 0.1, 0.2])
    np.testing.assert_allclose(series["container_force_N"][2], [0.2, 0.4, 0.6])
    assert series.units["kinetic_energy_J"] == "J"
    assert series.descriptions["phase"] == "index of the phase in the scene"
    assert (series.scene_sha256, series.seed, len(series.time)) == ("abc", 7, 3)
    assert series.nearest(0.14) == 1
    with pytest.raises(ValueError, match="read-only"):
        series.time[0] = 1


def test_samples_at_which_a_quantity_is_known(run):
    with h5py.File(run / "series.h5", "r+") as file:
        file["phase"][...] = [0, 1, 1]
        file["kinetic_energy_J"][...] = [1.0, np.nan, 2.0]
    series = read_series(run)
    assert [series.known("kinetic_energy_J", phase).tolist() for phase in (0, 1, 2)] == [[0], [2], []]
    assert series.known("heat", 0).tolist() == []


def test_unknown_name_lists_what_there_is(run):
    with pytest.raises(InputError, match=r"no series 'heat'; choose one of: .*kinetic_energy_J"):
        read_series(run)["heat"]


def test_missing_series(tmp_path):
    with pytest.raises(InputError, match=r"series\.h5: no such file"):
        read_series(tmp_path)


@pytest.mark.parametrize("kept", [0, 20, 0.5, 0.9])
def test_truncated_series(run, kept):
    path = run / "series.h5"
    data = path.read_bytes()
    path.write_bytes(data[: kept if isinstance(kept, int) else int(kept * len(data))])
    with pytest.raises(InputError, match=r"cannot read series .*series\.h5: ") as error:
        read_series(run)
    assert "\n" not in str(error.value)


def _drop(name):
    def change(file):
        del file[name]

    return change


def _replace(name, values):
    def change(file):
        del file[name]
        file.create_dataset(name, data=values).attrs.update({"unit": "-", "description": ""})

    return change


def _link(link):
    return lambda file: file.__setitem__("energy", link)


def _dataset(**how):
    return lambda file: file.create_dataset("energy", **how).attrs.update({"unit": "-", "description": ""})


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (_drop("time_s"), "dataset 'time_s' is missing"),
        (_replace("kinetic_energy_J", np.zeros((3, 4))), "'kinetic_energy_J' has shape"),
        (lambda file: file.attrs.__delitem__("seed"), "attribute 'seed' is missing"),
        (lambda file: file.attrs.__setitem__("format", 9), "'format' must be 1: got 9"),
        (lambda file: file["phase"].attrs.__delitem__("unit"), "KeyError"),
        (lambda file: file.attrs.__setitem__("format", "x"), "ValueError"),
        (lambda file: file.attrs.__setitem__("seed", "x"), "ValueError"),
        (_link(h5py.ExternalLink("/etc/other.h5", "/x")), "'energy' is not stored in this file"),
        (_link(h5py.SoftLink("/time_s")), "'energy' is not stored in this file"),
        (_dataset(external=[("/etc/passwd", 0, 24)], shape=(3,), dtype="f8"), "'energy' is not stored in this file"),
        (lambda file: file.create_group("energy"), "'energy' is not stored in this file"),
        (_dataset(shape=(10**12,), dtype="f8", chunks=(1000,)), "'energy' is not stored as plain numbers"),
        (_dataset(data=np.zeros(10**6), compression="gzip"), "'energy' is not stored as plain numbers"),
        (_dataset(data=["a", "b", "c"]), "'energy' is not stored as plain numbers"),
    ],
)
def test_series_that_breaks_the_contract(run, change, message):
    with h5py.File(run / "series.h5", "a") as file:
        change(file)
    with pytest.raises(InputError, match=message) as error:
        read_series(run)
    assert "\n" not in str(error.value)


def test_a_flipped_bit_is_found_by_the_checksum_and_a_series_without_checksums_is_read(run, tmp_path):
    path = run / "series.h5"
    with h5py.File(path) as file:
        assert all(dataset.fletcher32 for dataset in file.values())
        values = file["kinetic_energy_J"][()]
        place = path.read_bytes().index(values.tobytes())
        old = tmp_path / "old"
        old.mkdir()
        with h5py.File(old / "series.h5", "w") as plain:
            plain.attrs.update(file.attrs)
            for name, dataset in file.items():
                plain.create_dataset(name, data=dataset[()]).attrs.update(dataset.attrs)
    assert np.array_equal(read_series(old)["kinetic_energy_J"], values)
    content = bytearray(path.read_bytes())
    content[place + 3] ^= 1
    path.write_bytes(content)
    with pytest.raises(InputError, match=r"series\.h5: its content does not fit its checksums") as error:
        read_series(run)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("mode", ["r", "r+"])
@pytest.mark.parametrize("locking", [True, False])
def test_a_series_is_read_while_it_is_open_elsewhere(run, mode, locking):
    with h5py.File(run / "series.h5", mode, locking=locking):
        assert len(read_series(run).time) == 3
        if (mode, locking) != ("r+", True):
            return
        code = f"from dem.record.series import read_series; assert len(read_series({str(run)!r}).time) == 3"
        subprocess.run([sys.executable, "-c", code], check=True)
