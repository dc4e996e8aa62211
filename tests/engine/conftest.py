"""YADE in a process of its own: one worker runs all cases of `cases.py`, so that it is loaded once."""

import multiprocessing
import os
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

import cases
import pytest

from dem.errors import RunError

HERE = Path(__file__).parent
TIMEOUT = 300  # s of wall time, for machines that are busy with long simulations


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark all tests of this folder."""
    for item in items:
        if HERE in item.path.parents:
            item.add_marker(pytest.mark.engine)


@pytest.fixture(scope="session")
def worker() -> Iterator[ProcessPoolExecutor]:
    # Bits depend on the number of threads, and threads that find no free core spin.
    os.environ["OMP_NUM_THREADS"] = "1"
    pool = ProcessPoolExecutor(max_workers=1, mp_context=multiprocessing.get_context("spawn"))
    try:
        pool.submit(cases.version).result(TIMEOUT)
    except RunError as error:
        pool.shutdown(wait=False, cancel_futures=True)
        pytest.skip(f"engine tests need YADE: {error}")
    yield pool
    pool.shutdown(wait=True, cancel_futures=True)


@pytest.fixture(autouse=True)
def _needs_yade(worker: ProcessPoolExecutor) -> None:
    """Skip where there is no YADE."""


@pytest.fixture
def simulate(worker: ProcessPoolExecutor) -> Callable[..., dict[str, Any]]:
    """Run a function of `cases.py` where YADE is."""

    def run(case: Callable[..., dict[str, Any]], /, *arguments: Any, **options: Any) -> dict[str, Any]:
        return worker.submit(case, *arguments, **options).result(TIMEOUT)

    return run
