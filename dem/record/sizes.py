"""Estimate what the measures of a run will take: space of its frames, memory and processor time."""

from dataclasses import dataclass

MIB = 2**20

# Measured with meshio's compressed files of 10 to 1200 bars.
_FRAME, _BAR = 2500, 110  # bytes
# Peak memory of a process, measured with 150 to 600 smarticles and 400 rods, and 10 % more; libraries take 140 MiB.
# Voronoi cells, of smarticles in a cylinder alone, take most; they are computed in parts from some 2000 smarticles on.
_LIBRARIES, _PER_BAR = 150 * MIB, MIB // 25
_CELLS, _PER_SMARTICLE, _MOST_CELLS = 40 * MIB, 36 * MIB // 100, 900 * MIB
# Processor time for each phase: of cells for each smarticle, and of the rest for each bar [s].
_SECONDS_PER_SMARTICLE, _SECONDS_PER_BAR = 0.003, 0.0002


@dataclass(frozen=True)
class MeasuringCost:
    """What `smarticles measure` takes for one run, estimated within a factor of about two."""

    frame_bytes: int  #: Size of one frame
    memory_bytes: int  #: Memory of one process, which measures one run at a time
    cpu_s: float  #: Processor time [s]


def measuring_cost(count: int, bars: int, phases: int, *, cells: bool) -> MeasuringCost:
    """Return the estimate for a run of `count` bodies with `bars` bars in all.

    `cells`: whether Voronoi cells are computed, which is done for smarticles in a cylinder.
    """
    memory, cpu = _LIBRARIES + _PER_BAR * bars, _SECONDS_PER_BAR * bars
    if cells:
        memory += min(_CELLS + _PER_SMARTICLE * count, _MOST_CELLS)
        cpu += _SECONDS_PER_SMARTICLE * count
    return MeasuringCost(frame_bytes=_FRAME + _BAR * bars, memory_bytes=memory, cpu_s=phases * cpu)
