"""Fixtures: run engines in separate processes, and write tables with `--results DIR`."""

import multiprocessing
import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

from dem.engine.kinds import engine_kind
from dem.errors import RunError
from dem.record.files import write_text
from dem.run.run import _git_revision

ON = [pytest.param("yade", marks=pytest.mark.engine), "links"]
TIMEOUT = 3600  # wall time [s]; large, since the machine may be busy with other simulations

os.environ["OMP_NUM_THREADS"] = "1"  # YADE's bits depend on the number of threads


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the option `--results DIR` to pytest."""
    parser.addoption(
        "--results", type=Path, metavar="DIR", help="write the measured tables into DIR/ENGINE; skip recorded cases"
    )


def _version(engine: str) -> str:
    return engine_kind(engine).version()


@pytest.fixture(scope="session")
def yade() -> Iterator[ProcessPoolExecutor]:
    """Start a process for YADE, which cannot share a process with Matplotlib; skip the test without YADE."""
    pool = ProcessPoolExecutor(1, mp_context=multiprocessing.get_context("spawn"))
    try:
        pool.submit(_version, "yade").result(TIMEOUT)
    except RunError as error:
        pool.shutdown(wait=False, cancel_futures=True)
        pytest.skip(f"needs YADE: {error}")
    yield pool
    pool.shutdown(wait=True, cancel_futures=True)


@pytest.fixture
def call(request: pytest.FixtureRequest) -> Callable[..., Any]:
    """Return `run(engine, function, ...)`: it calls the function in this process (links) or in YADE's."""

    def run(engine: str, function: Callable[..., Any], /, *arguments: Any, **options: Any) -> Any:
        if engine == "links":
            return function(*arguments, **options)
        return request.getfixturevalue("yade").submit(function, *arguments, **options).result(TIMEOUT)

    return run


@pytest.fixture
def call_alone() -> Callable[..., Any]:
    """Return `run(function, ...)`, which calls a function in a new process."""

    def run(function: Callable[..., Any], /, *arguments: Any, **options: Any) -> Any:
        with ProcessPoolExecutor(1, mp_context=multiprocessing.get_context("spawn")) as pool:
            return pool.submit(function, *arguments, **options).result(TIMEOUT)

    return run


class Tables:
    """CSV and Markdown tables in a folder, updated after each test; with folder None nothing is written."""

    def __init__(self, folder: Path | None) -> None:
        self.folder = folder

    def write(self, engine: str, name: str, rows: Sequence[dict[str, Any]], keys: Sequence[str]) -> None:
        """Write rows to DIR/ENGINE/NAME.csv and .md; they replace rows that have equal values of `keys`."""
        if self.folder is None or not rows:
            return
        new, old = pd.DataFrame(rows).assign(commit=_git_revision()), self.read(engine, name)
        if old is not None:
            replaced = pd.MultiIndex.from_frame(new[list(keys)].astype(str))
            kept = old[~pd.MultiIndex.from_frame(old[list(keys)].astype(str)).isin(replaced)]
            new = pd.concat([kept, new], ignore_index=True) if len(kept) else new
        (self.folder / engine).mkdir(parents=True, exist_ok=True)
        path = self.folder / engine / f"{name}.csv"
        write_text(path, new.to_csv(index=False, float_format="%.10g"))
        cells = new.astype(object).map(lambda value: str(value).replace("|", "\\|").replace("\n", " "))
        lines = [" | ".join(line) for line in (new.columns, ["---"] * len(new.columns), *cells.to_numpy())]
        write_text(path.with_suffix(".md"), "\n".join(f"| {line} |" for line in lines) + "\n")

    def skip_recorded(self, engine: str, name: str, **keys: Any) -> None:
        """Skip the test if the table has rows with these values of `keys`, and none of these rows failed."""
        table = self.read(engine, name)
        if table is not None and all(key in table for key in keys):
            matches = [table[key].astype(str) == str(value) for key, value in keys.items()]
            rows = pd.concat(matches, axis=1).all(axis=1)
            failed = "verdict" in table and (table.loc[rows, "verdict"] == "BAD").any()
            if rows.any() and not failed:
                pytest.skip("recorded already")

    def read(self, engine: str, name: str) -> pd.DataFrame | None:
        """Return a recorded table, or None if it does not exist."""
        path = None if self.folder is None else self.folder / engine / f"{name}.csv"
        return pd.read_csv(path, keep_default_na=False) if path is not None and path.exists() else None


@pytest.fixture(scope="session")
def tables(request: pytest.FixtureRequest) -> Tables:
    """Return the tables in the folder given by `--results DIR`."""
    return Tables(request.config.getoption("--results"))
