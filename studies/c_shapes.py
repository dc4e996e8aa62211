"""C shapes under vibration: links against time, and the number of links at which a giant cluster forms.

Kim, Wu and Han (Nature Communications 2025, arXiv 2509.00216) find that the number of links grows as the logarithm of
time, that the network of links percolates at a critical number, which continuum percolation of rings describes, and
that the opening angle changes the network. Here two C shapes are linked if their linking number, closed straight across
the mouths, is not 0. The critical number is found by random removal of bodies from the network, which lowers the
density as in continuum percolation; the same is done with C shapes that are placed at random, which may overlap.
"""

import math
from collections.abc import Callable
from functools import partial

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.cluster.hierarchy import DisjointSet
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from dem.errors import InputError
from dem.record.run import Run
from postprocess.geometry.bars import body_centres
from postprocess.measures.closed_linking import closed_linking
from postprocess.measures.graph import EntanglementGraph, entanglement_graph
from postprocess.report import figures as style
from postprocess.statistics.points import SEED
from postprocess.statistics.seeds import mean_over_seeds, slope_within
from studies.framework.figures import Histories, Means, Series, marker, one_by_one
from studies.framework.findings import Effect, Finding, Outcome, decide, means_by, within
from studies.framework.provenance import Reference
from studies.framework.runs import Key, MeasuredRun, declare, last_columns, run_columns
from studies.framework.study import COUNT, Study

Floats = NDArray[np.float64]

OPENING, TIME = "opening angle [deg]", "time shaken [s]"
FIRST, LAST, SHARE = "links per body poured [-]", "links per body [-]", "largest cluster [-]"
SHARE_POURED = "largest cluster poured [-]"
GROWTH = "links per body and decade of time [-]"
CRITICAL, RANDOM = "critical links per body [-]", "critical links per body at random [-]"
AGAINST_LINE, AGAINST_END = "ln residual over that of a line [-]", "ln residual over that of an exponential [-]"
DELAYED = "ln residual with an onset over that of an exponential [-]"

EARLY = 0.1  # s, time at which fits begin: three periods of vibration
MOMENTS = 24  #: Number of times, equally apart on a logarithmic axis, at which links are counted
GIANT = 0.5  #: A cluster with at least this share of the bodies is giant
ORDERS = 60  #: Number of random orders of removal over which results are averaged
NEAR = math.log(1.25)  #: Critical numbers agree if ln of their ratio is at most this in size

QUANTITIES = declare(
    {
        FIRST: ("links poured", ".2f", "linked pairs per body at rest before the vibration"),
        LAST: ("links in the end", ".2f", "linked pairs per body at the end of the vibration"),
        GROWTH: ("per decade", ".2f", "slope of the links per body against the decimal logarithm of time"),
        SHARE_POURED: ("cluster poured", ".2f", "share of the bodies in the largest cluster before the vibration"),
        SHARE: ("cluster in the end", ".2f", "the same at the end of the vibration"),
        CRITICAL: (
            "critical",
            ".2f",
            "links per body at which the largest cluster has half of the bodies, by random removal of bodies from the "
            "last network; empty where it has less with all bodies",
        ),
        RANDOM: (
            "critical at random",
            ".2f",
            "the same of as many C shapes at random places in the pile's cylinder, which may overlap",
        ),
        AGAINST_LINE: ("", "", "ln of the residual of a + b ln t over that of a + b t"),
        AGAINST_END: ("", "", "ln of the residual of a + b ln t over that of a + b exp(-t/τ)"),
        DELAYED: ("", "", "ln of the residual of a + b ln(1 + t/τ) over that of a + b exp(-t/τ)"),
    },
    axes={CRITICAL: "critical links per body [-]", GROWTH: "links per body and decade [-]"},
)


def measure(run: Run) -> MeasuredRun:
    """Count links over time and find the critical number; return the run's row and its history."""
    types = [phase.type for phase in run.phases]
    if types != ["deposit", "relax", "shake"]:
        raise InputError(f"{run.path}: its phases are {', '.join(types)}, not deposit, relax, shake; leave it out")
    rest, shaken = run.frames.in_phase(1), run.frames.in_phase(2)
    if not rest or not shaken:
        raise InputError(f"{run.path}: no frame of the rest or of the vibration; run it again")
    began = rest[-1].time
    times = np.array([frame.time for frame in shaken]) - began
    wanted = np.geomspace(EARLY, times[-1], MOMENTS)
    chosen = np.unique([int(np.abs(times - moment).argmin()) for moment in wanted])
    graphs = [linked(shaken[int(one)].segments, shaken[int(one)].body) for one in chosen]
    poured, last = linked(rest[-1].segments, rest[-1].body), shaken[int(chosen[-1])]
    links = np.array([links_per_body(graph) for graph in graphs])
    history = {
        TIME: times[chosen],
        LAST: links,
        SHARE: np.array([graph.clusters.largest for graph in graphs]),
    }
    residuals = {law: residual(law, times[chosen], links) for law in LAWS}
    count, radius = run.manifest.count, run.manifest.container_radius_m
    top = float(np.percentile(last.segments[..., 2], 95)) - last.floor_z
    generator = np.random.default_rng(run.manifest.seed)
    placed = at_random(last.segments.reshape(count, -1, 2, 3), body_centres(last), radius, top, generator)
    row = {
        OPENING: opening_of(run),
        **{name: value for name, value in run_columns(run).items() if name in (SEED, COUNT, "fidelity")},
        FIRST: links_per_body(poured),
        LAST: links[-1],
        GROWTH: float(np.polyfit(np.log10(times[chosen]), links, 1)[0]),
        SHARE_POURED: poured.clusters.largest,
        SHARE: graphs[-1].clusters.largest,
        CRITICAL: critical_links(graphs[-1], generator),
        RANDOM: critical_links(linked(placed, np.repeat(np.arange(count), len(placed) // count)), generator),
        AGAINST_LINE: math.log(residuals["logarithm"] / residuals["line"]),
        AGAINST_END: math.log(residuals["logarithm"] / residuals["exponential"]),
        DELAYED: math.log(residuals["delayed logarithm"] / residuals["exponential"]),
        **last_columns(run),
    }
    return MeasuredRun(run=run, rows=[row], history=history)


def opening_of(run: Run) -> float:
    """Return the opening angle of a run's C shapes [deg]; InputError if its bodies are of another shape."""
    shapes = run.scene.get("particle") or []
    if [shape.get("shape") for shape in shapes] != ["c"]:
        raise InputError(f"{run.path}: its bodies are not C shapes of one kind; leave it out")
    return float(shapes[0]["opening_deg"])


def linked(segments: Floats, body: NDArray[np.int64]) -> EntanglementGraph:
    """Return the graph in which two bodies are joined if their linking number is not 0.

    Open curves are closed by a straight line between their ends. Segments are (M, 2, 3) [m], `body` (M,) numbers of
    bodies.
    """
    return entanglement_graph(closed_linking(segments, body), least=1)


def links_per_body(graph: EntanglementGraph) -> float:
    """Return the number of links over the number of bodies [-]; the mean degree is twice as large."""
    return len(graph.i) / len(graph.bodies)


def at_random(bodies: Floats, centres: Floats, radius: float, height: float, generator: np.random.Generator) -> Floats:
    """Place copies of bodies at random in a cylinder; return their segments (N S, 2, 3) [m], body by body.

    Centres are uniform in the cylinder of a radius and height [m], orientations are uniform; bodies may overlap. They
    have S segments each, (N, S, 2, 3) [m], and present centres (N, 3) [m].
    """
    count = len(bodies)
    away, angle = radius * np.sqrt(generator.random(count)), 2 * math.pi * generator.random(count)
    places = np.stack([away * np.cos(angle), away * np.sin(angle), height * generator.random(count)], axis=1)
    turns = Rotation.random(count, rng=generator).as_matrix()
    turned = np.einsum("nij,nskj->nski", turns, bodies - centres[:, None, None])
    moved: Floats = (turned + places[:, None, None]).reshape(-1, 2, 3)
    return moved


def critical_links(graph: EntanglementGraph, generator: np.random.Generator) -> float:
    """Return the links per body [-] at which the largest cluster has the share `GIANT` of the bodies.

    Bodies are added in random order, with their links to those that are there already; links per body and the share of
    the largest cluster are averaged over `ORDERS` orders. NaN if the share does not reach `GIANT` with all bodies, or
    exceeds it at every number of bodies.

    Source: Newman and Ziff, Phys. Rev. E 64, 016706 (2001).
    """
    number = len(graph.bodies)
    neighbours: list[list[int]] = [[] for _ in range(number)]
    for one, other in zip(graph.i.tolist(), graph.j.tolist(), strict=True):
        neighbours[one].append(other)
        neighbours[other].append(one)
    links, largest = np.zeros(number), np.zeros(number)
    for _ in range(ORDERS):
        joined, here, greatest = DisjointSet(), 0, 1
        for step, body in enumerate(generator.permutation(number).tolist()):
            joined.add(body)
            for other in neighbours[body]:
                if other in joined:
                    here += 1
                    joined.merge(body, other)
            greatest = max(greatest, joined.subset_size(body))
            links[step] += here / (step + 1)
            largest[step] += greatest / (step + 1)
    links, largest = links / ORDERS, largest / ORDERS
    below = np.nonzero(largest < GIANT)[0]
    if not len(below) or below[-1] + 1 == number:
        return math.nan
    at = int(below[-1])
    part = (GIANT - largest[at]) / (largest[at + 1] - largest[at])
    return float(links[at] + part * (links[at + 1] - links[at]))


LAWS: dict[str, Callable[[Floats, float], Floats]] = {
    "logarithm": lambda t, _: np.log(t),
    "line": lambda t, _: t,
    "delayed logarithm": lambda t, tau: np.log1p(t / tau),
    "exponential": lambda t, tau: np.exp(-t / tau),
}  #: Function f(t, τ) of each law a + b f(t, τ), by name; the first two do not depend on τ


def residual(law: str, times: Floats, values: Floats) -> float:
    """Fit a law a + b f(t, τ), see `LAWS`, to values (n,) at times (n,) [s]; return the rms residual."""

    def left(parameters: Floats) -> Floats:
        shape = LAWS[law](times, float(np.exp(parameters[0])))
        matrix = np.stack([np.ones_like(times), shape], axis=1)
        solved, *_ = np.linalg.lstsq(matrix, values, rcond=None)
        return np.asarray(matrix @ solved - values, dtype=np.float64)

    if law in ("logarithm", "line"):
        return float(np.sqrt(np.mean(left(np.zeros(1)) ** 2)))
    first, last = math.log(times[0] / 3), math.log(10 * times[-1])
    starts = np.linspace(first, last, 6)[1:-1]
    tries = (least_squares(left, [start], bounds=([first], [last])) for start in starts)
    return float(np.sqrt(np.mean(min(tries, key=lambda found: float(found.cost)).fun ** 2)))


def grows(table: pd.DataFrame) -> Outcome:
    """Judge whether links grow with the logarithm of time at every opening angle."""
    effects = [
        Effect(label=f"{opening:g}°: links per body and decade", value=mean_over_seeds(rows[GROWTH].tolist()))
        for opening, rows in table.groupby(OPENING)
    ]
    return Outcome(effects=effects)


def logarithm_best(table: pd.DataFrame) -> list[Effect]:
    """Judge whether logarithms fit better than a line and an exponential with as many parameters."""
    laws = {
        "a + b ln t over that of a line": (AGAINST_LINE, -1),
        "a + b ln(1 + t/τ) over that of a + b exp(-t/τ)": (DELAYED, -1),
        "a + b ln t over that of a + b exp(-t/τ), which has a parameter more": (AGAINST_END, 0),
    }
    return [
        Effect(label=f"ln of the residual of {law}", value=mean_over_seeds(table[column].tolist()), sign=sign)
        for law, (column, sign) in laws.items()
    ]


def percolates(table: pd.DataFrame) -> Outcome:
    """Judge whether vibration makes a giant cluster at every opening angle."""
    effects = [
        Effect(
            label=f"{opening:g}°: largest cluster in the end",
            value=mean_over_seeds(rows[SHARE].tolist()),
            threshold=GIANT,
        )
        for opening, rows in table.groupby(OPENING)
    ]
    return Outcome(effects=effects, note=f"poured, by angle: {means_by(table, SHARE_POURED, OPENING, '.2f')}")


def as_at_random(table: pd.DataFrame) -> Outcome:
    """Judge whether the critical numbers of piles and of C shapes placed at random agree within `NEAR`."""
    ratio = (np.log(table[CRITICAL]) - np.log(table[RANDOM])).dropna()
    mean = mean_over_seeds(ratio.tolist())
    both = f"in piles by angle: {means_by(table, CRITICAL, OPENING, '.2f')}; at random: "
    note = both + means_by(table, RANDOM, OPENING, ".2f")
    effect = Effect(label="ln of the ratio of critical numbers, piles over random places", value=mean, sign=0)
    return Outcome(effects=[effect], note=note, verdict=within(mean.value, mean.half_width, NEAR))


def depends_on_opening(table: pd.DataFrame, *, quantity: str, label: str) -> Outcome:
    """Judge whether the slope of a column against the opening angle is not 0; `label`: its name in texts."""
    slope = slope_within(table[OPENING].tolist(), table[quantity].tolist(), ["all"] * len(table))
    effect = Effect(label=f"{label} against the opening angle", value=slope, sign=0, unit=" per degree")
    note = f"by angle: {means_by(table, quantity, OPENING, '.3g')}"
    clear = abs(slope.value) > slope.half_width
    return Outcome(effects=[effect], note=note, verdict=decide(clear, data=not math.isnan(slope.value)))


FINDINGS = (
    Finding(
        id="links-grow",
        says="The number of links grows with the logarithm of time under vibration",
        outcome=grows,
        found_if="the slope of the links against log t is above 0 at every opening angle",
    ),
    Finding(
        id="logarithm",
        says="The growth is logarithmic",
        outcome=logarithm_best,
        found_if="a + b ln t leaves less than a + b t, and a + b ln(1 + t/τ) less than a + b exp(-t/τ), mean of runs",
    ),
    Finding(
        id="percolates",
        says="The network of links percolates: it forms a giant cluster",
        outcome=percolates,
        found_if=f"after the vibration the largest cluster has over {GIANT:.0%} of the bodies, at every angle",
    ),
    Finding(
        id="as-rings-at-random",
        says="Continuum percolation of rings describes the critical number of links",
        outcome=as_at_random,
        found_if="the ratio of the critical number in piles to that of C shapes at random places, mean over runs, is "
        f"within a factor of {math.exp(NEAR):.3g}, at 95 %",
    ),
    Finding(
        id="critical-with-opening",
        says="The opening angle changes the critical number of links",
        outcome=partial(depends_on_opening, quantity=CRITICAL, label="critical links per body"),
        found_if="its slope against the angle is not 0, with either sign: the abstract states none",
    ),
    Finding(
        id="growth-with-opening",
        says="The opening angle changes the network: wider mouths link faster or slower",
        outcome=partial(depends_on_opening, quantity=GROWTH, label="links per body and decade"),
        found_if="the slope of the growth per decade against the angle is not 0, with either sign",
    ),
)

_BY_OPENING = one_by_one(OPENING, "{:g}°".format, last=0.75)

FIGURES = (
    Histories(
        name="links_time",
        quantities={LAST: "links per body [-]", SHARE: "largest cluster [-]"},
        x=TIME,
        x_label="time since vibration began [s]",
        split=_BY_OPENING,
        log=True,
    ),
    Means(
        name="critical",
        quantities=[QUANTITIES[name] for name in (CRITICAL, GROWTH)],
        x=OPENING,
        x_label="opening angle [degree]",
        split=lambda table: [Series(rows=table, label="piles", properties=marker("o", style.BLUE, style.BLUE))],
    ),
)

STUDY = Study(
    name="c-shapes",
    title="C shapes under vibration, against the findings of Kim, Wu and Han",
    measure=measure,
    keys=(Key(column=OPENING, label="opening", form="g", unit="°"),),
    quantities=tuple(QUANTITIES.values()),
    findings=FINDINGS,
    figures=FIGURES,
    same_count=(),
    order=(OPENING, SEED),
    count_values=True,
    one_engine=True,
    remarks=(
        "A link: two C shapes, closed straight across their mouths, with a linking number other than 0. Links per "
        "body: number of links over that of bodies, half the mean degree. A random graph, whose links disregard "
        "places, has half of its bodies in one cluster at 0.69 links per body.",
    ),
    reference=Reference(
        statement="abstract of Kim, Wu and Han, Nature Communications 2025, arXiv 2509.00216; no data of theirs",
        facts={"doi": "10.1038/s41467-025-66228-3", "arxiv": "2509.00216", "what": "statements in the abstract"},
    ),
    pictured={"opening_deg": 60},
)
