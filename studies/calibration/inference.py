"""Run waves of designed points, each in a smaller region, and sample the parameters' posterior.

The measured value of datum j is z_j = f_j(θ) + δ_j + ε_j: f_j is what the simulation gives on average over seeds; ε_j
is normal with the standard deviation that the data state; δ_j, the discrepancy of the model, is normal with standard
deviation σ s_j, independent from datum to datum. s_j is the mean size of the measure. σ is inferred, with a half-normal
prior (`discrepancy` of the file). Emulators give mean and variance of f_j(θ); their errors are taken as independent.

Sources:
    Kennedy and O'Hagan, J. R. Stat. Soc. B 63, 425 (2001): emulator and discrepancy. Vernon, Goldstein and Bower,
    Bayesian Analysis 5, 619 (2010): history matching. Foreman-Mackey et al., PASP 125, 306 (2013): emcee.
"""

from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
import pandas as pd
from scipy.stats import qmc

from studies.calibration.emulator import Array, Emulator, fit
from studies.calibration.problem import CONDITION, Problem
from templates.sweep.render import Value

CUTOFF = 3.0  #: Largest implausibility that keeps a point [-]: three standard deviations, after Pukelsheim (1994)
CANDIDATES = 13  #: Base-2 logarithm of the number of points at which a region is examined
WALKERS_PER_DIMENSION, CHUNK, MOST_STEPS = 8, 500, 8000
ENOUGH_TIMES = 50  #: emcee's autocorrelation time is reliable if steps exceed it by this factor [-]
DRAWS = 4000  #: Approximate number of draws of the posterior that are kept
NOT_IDENTIFIED, WEAKLY = 0.75, 0.5  #: Posterior width over prior width above which these verdicts hold [-]
#: A posterior is at an edge if one end of its prior's range, a fraction `EDGE`, has more than `EDGE_SHARE` of the draws
EDGE, EDGE_SHARE = 0.05, 0.15
_BANDS = (2.5, 50.0, 97.5)

Measured = Mapping[str, float]  #: Values of the measures of a run; an absent measure was not found


class Simulator(Protocol):
    """Source of runs: a sweep of scenes, a Python function, or a table of runs made elsewhere."""

    def planned(self, wave: int) -> Array | None:
        """Return the parameters (n, d) of a wave that was begun earlier; None if it was not."""

    def run(self, wave: int, theta: Array) -> Sequence[tuple[Mapping[str, Value], Measured | None]] | None:
        """Compute a wave at parameters (n, d); return variables and measures of all runs.

        The measures of a run that failed are None. The whole is None if runs are still in a queue.
        """


@dataclass(frozen=True, kw_only=True, eq=False)
class Result:
    """Outcome of a calibration."""

    problem: Problem
    runs: pd.DataFrame  #: All runs: wave, variables, measures (NaN: failed)
    waves: pd.DataFrame  #: A row per wave: numbers of points, runs and failures; part of the prior not ruled out [%]
    emulators: Sequence[Emulator | None]  #: Emulator of each datum; None if the datum's condition was not run
    draws: Array  #: (m, d + 1) draws of the posterior: parameters, and σ of the discrepancy
    best: Array  #: (d + 1,) draw with the largest posterior density
    diagnostics: Mapping[str, float]  #: Of emcee: autocorrelation time, steps over it, acceptance, effective draws
    warnings: Sequence[str]  #: What a reader must know before using the posterior

    @property
    def theta(self) -> Array:
        """Draws of the parameters, (m, d)."""
        return self.draws[:, :-1]

    def posterior(self) -> pd.DataFrame:
        """Tabulate the posterior: a row for each parameter, and one for the discrepancy.

        The column `width` is the width of the posterior's 95 % interval over that of the prior's [-].
        """
        names = [*self.problem.names, "discrepancy"]
        low, median, high = np.percentile(self.draws, _BANDS, axis=0)
        lower, upper = self.problem.bounds
        rows = []
        for k, name in enumerate(names):
            width, verdict = np.nan, "relative to the mean size of each measure"
            if k < len(lower):
                prior = self.problem.content.free[name].distribution
                width = float(high[k] - low[k]) / float(prior.ppf(0.975) - prior.ppf(0.025))
                near = EDGE * (upper[k] - lower[k])
                ends = {"lower": self.draws[:, k] < lower[k] + near, "upper": self.draws[:, k] > upper[k] - near}
                edges = [end for end, there in ends.items() if there.mean() > EDGE_SHARE]
                verdict = "weakly identified" if width > WEAKLY else "identified"
                verdict = f"at the {edges[0]} end of its prior; widen it" if edges else verdict
                verdict = "not identified" if width > NOT_IDENTIFIED else verdict
            row = {"parameter": name, "median": median[k], "low 95 %": low[k], "high 95 %": high[k]}
            rows.append({**row, "best": self.best[k], "width": width, "verdict": verdict})
        return pd.DataFrame(rows)

    def predictive(self) -> pd.DataFrame:
        """Tabulate each datum with median and 95 % band of the values that the model predicts for it.

        The band contains the posterior of the parameters, the variance of the emulator, the discrepancy of the model
        and the error of the measurement. `covered` says whether the datum lies within it. Data without an emulator have
        no band.
        """
        random = np.random.default_rng(self.problem.content.first_seed)
        inputs, sizes = self.problem.scaled(self.theta), self.problem.sizes
        rows = []
        for datum, emulator, size in zip(self.problem.data, self.emulators, sizes, strict=True):
            row: dict[str, object] = dict(self.problem.conditions[datum.condition])
            row |= {"measure": datum.measure, "value": datum.value, "error": datum.error, "fitted": datum.fitted}
            if emulator is not None:
                mean, variance = emulator.predict(inputs)
                spread = np.sqrt(variance + (size * self.draws[:, -1]) ** 2)
                model = mean + spread * random.standard_normal(len(mean))
                low, median, high = np.percentile(model + datum.error * random.standard_normal(len(mean)), _BANDS)
                row |= {"median": median, "low 95 %": low, "high 95 %": high}
                row |= {"deviation [%]": 100 * (median / datum.value - 1) if datum.value else np.nan}
                row["covered"] = bool(low <= datum.value <= high)
            rows.append(row)
        return pd.DataFrame(rows)

    def sensitivity(self) -> pd.DataFrame:
        """Tabulate Sobol indices of each emulator's mean for parameters drawn from their priors (SALib).

        They are shares of the variance that the emulator explains, whose share of the runs' variance is `explained`.
        Emulators that explain no more than noise might, `Emulator.resolved`, have no indices.
        """
        from SALib.analyze import sobol as analysis  # noqa: PLC0415  (an extra)
        from SALib.sample import sobol as sampling  # noqa: PLC0415

        names = self.problem.names
        if len(names) < 2:
            return pd.DataFrame()
        space = {"num_vars": len(names), "names": list(names), "bounds": [[0.0, 1.0]] * len(names)}
        unit = sampling.sample(space, 1024, calc_second_order=False, seed=self.problem.content.first_seed)
        inputs = self.problem.scaled(self.problem.from_unit(unit))
        rows = []
        for datum, emulator in zip(self.problem.data, self.emulators, strict=True):
            if emulator is None or not emulator.resolved:
                continue
            mean, _ = emulator.predict(inputs)
            found = analysis.analyze(space, mean, calc_second_order=False, seed=self.problem.content.first_seed)
            for k, name in enumerate(names):
                row = {**self.problem.conditions[datum.condition], "measure": datum.measure, "parameter": name}
                row |= {"first order": found["S1"][k], "first order 95 %": found["S1_conf"][k]}
                row |= {"total": found["ST"][k], "total 95 %": found["ST_conf"][k]}
                rows.append(row | {"explained, left out one by one": emulator.explained})
        return pd.DataFrame(rows)


def calibrate(
    problem: Problem,
    simulator: Simulator,
    say: Callable[[str], None] = print,
    shown: Callable[[str], AbstractContextManager[object]] = nullcontext,
) -> Result | None:
    """Run all waves and sample the posterior; return None if runs of a wave are still in a queue.

    The first wave has points of a Sobol sequence in the priors. Each further wave has those points of a finer sequence
    that the runs so far do not rule out. A condition is a combination of the data's variables, such as l/w and count;
    conditions without data to fit are run in the last wave only.

    `say` prints a line about each wave, `shown` shows the computations between runs. InputError if the budget is too
    small, or too few runs finished for an emulator.
    """
    size = problem.points_per_wave
    emulators: list[Emulator | None] = []
    tables: list[pd.DataFrame] = []
    waves: list[dict[str, float]] = []
    warnings: list[str] = []
    share, candidates, distances = 1.0, _candidates(problem), np.empty(0)
    for wave in range(1, problem.content.waves + 1):
        theta = simulator.planned(wave)
        if theta is None:
            theta = first_points(problem, size)
            if wave > 1:
                # The first candidates that are not ruled out, evenly in their region as parts of a Sobol sequence are;
                # if too few are left, the least implausible ones.
                limit = max(CUTOFF, float(np.partition(distances, size - 1)[size - 1]))
                theta = _rounded(candidates[distances <= limit][:size])
        found = simulator.run(wave, theta)
        if found is None:
            return None
        missing = [values for values, measured in found if not measured]
        tables.append(pd.DataFrame([{"wave": wave, **values, **(measured or {})} for values, measured in found]))
        with shown(f"wave {wave}: fitting emulators"):
            emulators = emulate(problem, pd.concat(tables, ignore_index=True))
            distances = implausibility(problem, emulators, candidates)
        before, share = share, float(np.mean(distances < CUTOFF))
        waves.append({"wave": wave, "points": len(theta), "runs": len(found), "failed": len(missing)})
        waves[-1] |= {"prior not ruled out before [%]": 100 * before, "and after [%]": 100 * share}
        say(f"wave {wave}: {len(theta)} points, {len(found)} runs, {len(missing)} of them failed and left out; "
            f"{100 * share:.3g} % of the prior is not ruled out")  # fmt: skip
    if share == 0.0:
        warnings.append(
            f"no parameters reach all data within {CUTOFF:g} standard deviations: the discrepancy is larger than "
            f"assumed ({100 * problem.content.discrepancy:g} %), the priors are too narrow, or data are wrong"
        )
    with shown("sampling the posterior"):
        chain, best, diagnostics = sample(problem, emulators)
    if diagnostics["steps over autocorrelation time"] < ENOUGH_TIMES:
        warnings.append(f"the chain has not converged: fewer than {ENOUGH_TIMES} autocorrelation times")
    for datum, emulator in zip(problem.data, emulators, strict=True):
        if emulator is None:
            continue
        label = datum.label(problem.conditions)
        if np.mean(np.abs(emulator.loo) < 2) < 0.8:  # 95 % are expected
            warnings.append(f"the emulator of {label} predicts left-out runs badly")
        if not emulator.resolved:
            explained, noise = (f"{100 * max(0.0, one):.0f} %" for one in (emulator.explained, emulator.noise_explains))
            warnings.append(
                f"no effect of any parameter on {label} is seen beyond the scatter: its emulator explains "
                f"{explained} of the variance of the runs, noise alone might {noise}; it has no Sobol indices"
            )
    return Result(
        problem=problem,
        runs=pd.concat(tables, ignore_index=True),
        waves=pd.DataFrame(waves),
        emulators=emulators,
        draws=chain,
        best=best,
        diagnostics=diagnostics,
        warnings=warnings,
    )


def _candidates(problem: Problem) -> Array:
    """Return a Sobol sequence (2^CANDIDATES, d) of parameters in the priors."""
    sequence = qmc.Sobol(len(problem.names), rng=problem.content.first_seed + 1)
    return problem.from_unit(sequence.random_base2(CANDIDATES))


def first_points(problem: Problem, size: int) -> Array:
    """Return the first `size` points of a Sobol sequence in the priors, (size, d)."""
    sequence = qmc.Sobol(len(problem.names), rng=problem.content.first_seed)
    return _rounded(problem.from_unit(sequence.random_base2((size - 1).bit_length())[:size]))


def _rounded(theta: Array) -> Array:
    """Return parameters with five significant digits, which scene files show in full."""
    return np.array([[float(f"{value:.5g}") for value in row] for row in theta])


def emulate(problem: Problem, runs: pd.DataFrame) -> list[Emulator | None]:
    """Fit the emulator of each datum to a table of runs; None for data that are predicted in a later wave."""
    found: list[Emulator | None] = []
    for datum in problem.data:
        part = runs[runs[CONDITION] == datum.condition]
        values = part[datum.measure].to_numpy(np.float64) if datum.measure in part else np.empty(0)
        finite = np.isfinite(values)
        if not datum.fitted and not finite.any():
            found.append(None)
            continue
        inputs = problem.scaled(part[list(problem.names)].to_numpy(np.float64)[finite]) if len(values) else np.empty(0)
        found.append(fit(inputs, values[finite], datum.label(problem.conditions)))
    return found


def _residuals(problem: Problem, emulators: Sequence[Emulator | None], theta: Array) -> tuple[Array, Array, Array]:
    """Return deviations of the J fitted data from the emulators at parameters (n, d), and variances.

    Returns data less emulator means (n, J), variances of measurement and emulator together (n, J), and mean sizes s_j
    of the measures (J,).
    """
    inputs, sizes = problem.scaled(theta), problem.sizes
    used = [(d, e, s) for d, e, s in zip(problem.data, emulators, sizes, strict=True) if d.fitted and e is not None]
    predicted = [emulator.predict(inputs) for _, emulator, _ in used]
    errors = np.stack([datum.value - mean for (datum, _, _), (mean, _) in zip(used, predicted, strict=True)], axis=1)
    variances = [datum.error**2 + variance for (datum, _, _), (_, variance) in zip(used, predicted, strict=True)]
    return errors, np.stack(variances, axis=1), np.array([size for _, _, size in used])


def implausibility(problem: Problem, emulators: Sequence[Emulator | None], theta: Array) -> Array:
    """Return the implausibility (n,) [-] of parameters (n, d), given the fitted data.

    It is the largest ratio over the data: distance of the datum from the emulator's mean, over the standard deviation
    of measurement, emulator and discrepancy together. The discrepancy has the standard deviation σ s_j, where s_j is
    the mean size of the measure, and σ is the scale of its prior.
    """
    errors, variances, sizes = _residuals(problem, emulators, theta)
    found: Array = np.max(np.abs(errors) / np.sqrt(variances + (problem.content.discrepancy * sizes) ** 2), axis=1)
    return found


def log_posterior(problem: Problem, emulators: Sequence[Emulator | None], draws: Array) -> Array:
    """Return ln of the posterior density (n,), up to a constant, at parameters and σ (n, d + 1)."""
    theta, sigma = draws[:, :-1], draws[:, -1]
    found = problem.log_prior(theta) - 0.5 * (sigma / problem.content.discrepancy) ** 2
    inside = np.isfinite(found) & (sigma >= 0)
    found[~inside] = -np.inf
    if inside.any():
        errors, variances, sizes = _residuals(problem, emulators, theta[inside])
        variances = variances + (sigma[inside, None] * sizes) ** 2
        found[inside] -= 0.5 * np.sum(errors**2 / variances + np.log(variances), axis=1)
    return found


def sample(problem: Problem, emulators: Sequence[Emulator | None]) -> tuple[Array, Array, dict[str, float]]:
    """Sample the posterior by emcee.

    Returns thinned draws (m, d + 1) of the parameters and σ; the draw with the largest posterior density, (d + 1,); and
    diagnostics by name: autocorrelation time in steps, steps over it, acceptance, and number of effective draws.
    """
    import emcee  # noqa: PLC0415  (an extra)

    random = np.random.default_rng(problem.content.first_seed)
    candidates = _candidates(problem)
    sigma = np.abs(random.normal(0.0, problem.content.discrepancy, len(candidates)))
    start = np.column_stack([candidates, sigma])
    # Candidates are drawn from the prior. The largest of likelihood times Gumbel noise are draws of the posterior.
    weight = log_posterior(problem, emulators, start) - _log_prior(problem, start)
    walkers = WALKERS_PER_DIMENSION * start.shape[1]
    start = start[np.argsort(weight + random.gumbel(size=len(weight)))[-walkers:]]
    moves: list[tuple[Any, float]] = [(emcee.moves.DEMove(), 0.8), (emcee.moves.DESnookerMove(), 0.2)]
    sampler = emcee.EnsembleSampler(
        walkers, start.shape[1], lambda draws: log_posterior(problem, emulators, draws), vectorize=True, moves=moves
    )
    state = emcee.State(start, random_state=np.random.RandomState(problem.content.first_seed % 2**32).get_state())
    time = np.inf
    while sampler.iteration < MOST_STEPS and sampler.iteration < ENOUGH_TIMES * time:
        state = sampler.run_mcmc(state, CHUNK)
        time = float(np.max(sampler.get_autocorr_time(tol=0)))
    burn = sampler.iteration // 5
    draws, density = sampler.get_chain(discard=burn, flat=True), sampler.get_log_prob(discard=burn, flat=True)
    diagnostics = {
        "autocorrelation time": time,
        "steps over autocorrelation time": sampler.iteration / time,
        "acceptance": float(np.mean(sampler.acceptance_fraction)),
        "effective draws": len(draws) / time,
    }
    return draws[:: max(len(draws) // DRAWS, 1)], draws[np.argmax(density)], diagnostics


def _log_prior(problem: Problem, draws: Array) -> Array:
    """Return ln of the prior density (n,), up to a constant, of parameters and σ (n, d + 1)."""
    found: Array = problem.log_prior(draws[:, :-1]) - 0.5 * (draws[:, -1] / problem.content.discrepancy) ** 2
    return found


def require_extra() -> None:
    """Import the libraries of the extra `calibrate`, so that a missing one is reported before any run."""
    import emcee  # noqa: F401, PLC0415
    import SALib  # noqa: F401, PLC0415
    import sklearn  # noqa: F401, PLC0415
