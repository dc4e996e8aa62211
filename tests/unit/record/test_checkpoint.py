"""A checkpoint is plain data and an engine's own bytes; one without an engine name is read."""

import io
import json
import zipfile
from pathlib import Path

import numpy as np
import pytest

from dem.errors import InputError
from dem.record.checkpoint import Checkpoint, has_checkpoint, read_checkpoint, write_checkpoint

MADE_BY = ("double", "1.2")


def checkpoint(time: float = 0.5) -> Checkpoint:
    return Checkpoint(
        scene_sha256="abc",
        made_by=MADE_BY,
        state={"engine": {"steps": 7}, "stage": {"left": 3}, "wall_s": time},
        series={"time_s": np.array([0.0, time]), "container_force_N": np.zeros((2, 3))},
        engine=b"\x00opaque",
    )


def test_everything_comes_back_and_the_one_before_is_kept(tmp_path: Path) -> None:
    assert not has_checkpoint(tmp_path)
    for time in (0.25, 0.5):
        write_checkpoint(tmp_path, checkpoint(time))
    assert sorted(path.name for path in tmp_path.iterdir()) == ["checkpoint.previous.zip", "checkpoint.zip"]
    found, warning = read_checkpoint(tmp_path, scene_sha256="abc", made_by=MADE_BY)
    assert warning is None
    assert (found.engine, found.made_by) == (b"\x00opaque", MADE_BY)
    assert found.state["engine"] == {"steps": 7}
    assert found.series["time_s"].tolist() == [0.0, 0.5]
    (tmp_path / "checkpoint.zip").write_bytes(b"half")
    found, warning = read_checkpoint(tmp_path, scene_sha256="abc", made_by=MADE_BY)
    assert found.series["time_s"].tolist() == [0.0, 0.25]
    assert "going on from checkpoint.previous.zip" in str(warning)


@pytest.mark.parametrize(
    ("wanted", "stated"),
    [
        ({"scene_sha256": "other"}, "scene abc, here is other"),
        ({"made_by": ("double", "2.0")}, "engine double 1.2, here is double 2.0"),
        ({"made_by": ("yade", "1.2")}, "engine double 1.2, here is yade 1.2"),
    ],
)
def test_a_checkpoint_of_another_scene_or_engine_is_rejected(
    tmp_path: Path, wanted: dict[str, object], stated: str
) -> None:
    write_checkpoint(tmp_path, checkpoint())
    with pytest.raises(InputError, match=rf"checkpoint\.zip: made with {stated}; .*start anew"):
        read_checkpoint(tmp_path, **({"scene_sha256": "abc", "made_by": MADE_BY} | wanted))


def test_a_checkpoint_of_another_format_is_rejected(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with monkeypatch.context() as patch:
        patch.setattr("dem.record.checkpoint.CHECKPOINT_FORMAT", 3)
        write_checkpoint(tmp_path, checkpoint())
    with pytest.raises(InputError, match="made with checkpoint format 3, here is 4; resume with what made it"):
        read_checkpoint(tmp_path, scene_sha256="abc", made_by=MADE_BY)


def packed(series: bytes, state: bytes, how: int = zipfile.ZIP_STORED) -> bytes:
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w", how) as archive:
        for name, part in (("state.json", state), ("series.npz", series), ("engine.bin", b"")):
            archive.writestr(name, part)
    return content.getvalue()


def npz(how: int, **members: bytes) -> bytes:
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w", how) as archive:
        for name, member in members.items():
            archive.writestr(f"{name}.npy", member)
    return content.getvalue()


def npy(shape: str) -> bytes:
    head = f"{{'descr': '<f8', 'fortran_order': False, 'shape': {shape}}}"
    return b"\x93NUMPY\x01\x00" + len(head).to_bytes(2, "little") + head.encode()


STATE = json.dumps({"format": 4, "made_by": {"engine": "double", "version": "1.2"}, "scene_sha256": "abc"}).encode()
ZEROS = bytes(2**24)


@pytest.mark.parametrize(
    ("content", "cause"),
    [
        (packed(b"", STATE + ZEROS, zipfile.ZIP_DEFLATED), r"it would unpack to \d{8} bytes, at most \d{5}"),
        (packed(npz(zipfile.ZIP_DEFLATED, time_s=ZEROS), STATE), r"it would unpack to \d{8} bytes, at most \d{5}"),
        (packed(npz(zipfile.ZIP_STORED, time_s=npy("(10**14,)")), STATE), "."),
        (packed(npz(zipfile.ZIP_STORED, time_s=npy("(100000000000000,)")), STATE), "."),
        (packed(b"", b"[" * 100_000), "recursion"),
        (packed(b"", b"[]"), "."),
        (packed(b"", b'{"made_by": 3}'), "."),
    ],
)
def test_a_checkpoint_that_no_run_has_written_is_damaged(tmp_path: Path, content: bytes, cause: str) -> None:
    (tmp_path / "checkpoint.zip").write_bytes(content)
    with pytest.raises(
        InputError, match=rf"cannot be resumed, damaged: checkpoint\.zip \(.*{cause}.*\); start"
    ) as caught:
        read_checkpoint(tmp_path, scene_sha256="abc", made_by=MADE_BY)
    assert "\n" not in str(caught.value)
