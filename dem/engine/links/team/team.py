"""Threads that make steps together, each with arrays of its own to write into."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np

from dem.engine.links.arrays import Array, Bodies, Cells, Ends, Ground, Law, Pairs
from dem.engine.links.shape import Shape
from dem.engine.links.team.barrier import OVER, gate
from dem.engine.links.team.shared import Shared, shared_by
from dem.engine.links.team.stepping import advance_together


class Team:
    """A number of threads, the calling one among them; others sleep between calls.

    Args:
        threads: how many, 2 at least.
    """

    def __init__(self, threads: int) -> None:
        self.threads = threads
        """How many."""
        self._pool = ThreadPoolExecutor(threads - 1, thread_name_prefix="links")
        self._shared: Shared | None = None
        self._scratch: list[dict[str, Any]] = []

    def advance(
        self, steps: int, made: int, begin: float, dt: float, gravity: float, planar: bool, skins: Array, shape: Shape,
        law: Law, wall_law: Law, bodies: Bodies, pairs: Pairs, cells: Cells, ends: Ends, ground: Ground, motors: Any,
        hooks: Any, rims: Any, channel: Any, cords: Any, ledger: Any, out: Array, row: Array, totals: Array,
    ) -> int:  # fmt: skip
        """Make steps; see `dem.engine.links.stepping.advance`.

        Returns:
            Steps that were made; fewer where a list is full.
        """
        shared = self._fitting(bodies, cells, ledger, out, row)

        def work(mine: int) -> int:
            own, mine_ground, mine_cells, mine_ledger, mine_out, mine_row = bodies, ground, cells, ledger, out, row
            if mine:
                k, scratch = mine - 1, self._scratch[mine - 1]
                own = bodies._replace(load=shared.loads[k], shares=shared.shares[k], deepest=shared.deepest[k])
                mine_ground = ground._replace(force=shared.forces[k])
                mine_cells = cells._replace(close=scratch["close"])
                mine_ledger, mine_out, mine_row = scratch["ledger"], scratch["out"], scratch["row"]
            try:
                return advance_together(
                    mine, self.threads, shared, own,
                    steps, made, begin, dt, gravity, planar, skins, shape, law, wall_law, bodies, pairs, mine_cells,
                    ends, mine_ground, motors, hooks, rims, channel, cords, mine_ledger, mine_out, mine_row, totals,
                )  # fmt: skip
            except BaseException:
                shared.gate[OVER] = 1
                raise

        try:
            others = [self._pool.submit(work, mine) for mine in range(1, self.threads)]
            done = work(0)
        except BaseException:
            # Nobody is to wait for a thread that never comes.
            shared.gate[OVER], self._shared = 1, None
            raise
        for other in others:
            other.result()
        return done

    def _fitting(self, bodies: Bodies, cells: Cells, ledger: Any, out: Array, row: Array) -> Shared:
        """What threads share, of the sizes that it is to have now."""
        found = self._shared
        if found is None or (found.loads.shape[1:], found.shares.shape[1:]) != (bodies.load.shape, bodies.shares.shape):
            self._shared = found = shared_by(self.threads, gate(), bodies)
            self._scratch = []
        sizes = (len(cells.close), None if ledger is None else len(ledger))
        if not self._scratch or self._scratch[0]["sizes"] != sizes:
            self._scratch = [
                {
                    "sizes": sizes,
                    "close": np.zeros_like(cells.close),
                    "ledger": None if ledger is None else np.zeros(ledger.shape),
                    "out": np.zeros_like(out),
                    "row": np.zeros_like(row),
                }
                for _ in range(self.threads - 1)
            ]
        return found
