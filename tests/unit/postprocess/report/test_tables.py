"""Tables on disk are whole or absent."""

import pandas as pd
import pytest

from dem.errors import InputError, RunError
from dem.record.run import Run
from postprocess import measure_run, write_table


def test_table_comes_back_as_written(tmp_path, make_run):
    table = measure_run(Run(make_run()), costly="never")
    path = write_table(table, tmp_path / "table.csv")
    pd.testing.assert_frame_equal(pd.read_csv(path), table, check_exact=True)
    assert [item.name for item in tmp_path.iterdir()] == ["table.csv"]


def test_table_is_not_overwritten_unless_asked(tmp_path):
    path = tmp_path / "table.csv"
    write_table(pd.DataFrame({"a": [1]}), path)
    with pytest.raises(InputError, match=r"table\.csv: exists already .* choose another name"):
        write_table(pd.DataFrame({"a": [2]}), path)
    assert path.read_text() == "a\n1\n"
    write_table(pd.DataFrame({"a": [2]}), path, overwrite=True)
    assert path.read_text() == "a\n2\n"


class Unwritable:
    def to_csv(self, path, **_):
        path.write_text("half a ta")
        message = "disk full"
        raise OSError(message)


def test_failed_write_leaves_the_old_table(tmp_path):
    path = tmp_path / "table.csv"
    path.write_text("old")
    with pytest.raises(RunError, match=rf"{path}: cannot be written \(disk full\); free space"):
        write_table(Unwritable(), path, overwrite=True)
    assert path.read_text() == "old"
    assert [item.name for item in tmp_path.iterdir()] == ["table.csv"]


@pytest.mark.parametrize(
    ("name", "cause"), [("table.txt", "let its name end in .csv"), ("none/table.csv", "the folder .* does not exist")]
)
def test_table_that_cannot_be_placed(tmp_path, name, cause):
    with pytest.raises(InputError, match=cause):
        write_table(pd.DataFrame({"a": [1]}), tmp_path / name)
