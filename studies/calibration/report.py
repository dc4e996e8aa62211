"""Write the results of a calibration: tables, figures, a text, and a preset of contact parameters."""

import hashlib
import importlib.metadata
from pathlib import Path

import numpy as np
import pandas as pd
import yaml
from matplotlib.axes import Axes
from scipy.stats import halfnorm

from dem.setting.contact import Contact
from postprocess.report import figures as style
from postprocess.report.tables import table_lines, whole_file, write_table
from studies.calibration.emulator import Array
from studies.calibration.inference import CUTOFF, ENOUGH_TIMES, NOT_IDENTIFIED, WEAKLY, Result
from studies.calibration.problem import Problem
from studies.framework.figures import panels
from studies.framework.provenance import make_folder

PRESET = "contact.yaml"  #: Name of the file of contact parameters


def write(result: Result, output: Path, command: str) -> list[str]:
    """Write all results to a folder; return the text of `calibration.md` as lines."""
    make_folder(output)
    problem, posterior, fit = result.problem, result.posterior(), result.predictive()
    tables = {"posterior": posterior, "fit": fit, "sensitivity": result.sensitivity(), "waves": result.waves}
    tables |= {"emulators": _emulators(result), "runs": result.runs}
    tables["draws"] = pd.DataFrame(result.draws, columns=[*problem.names, "discrepancy"])
    for name, table in tables.items():
        if len(table):
            write_table(table, output / f"{name}.csv", overwrite=True)
    with style.style():
        _draw_pairs(result, output / "pairs")
        _draw_fit(result, fit, output / "fit")
    lines = [f"# Calibration {problem.content.name}", "", *_statements(result, posterior, fit), ""]
    titles = {"posterior": "Posterior", "fit": "Data against the posterior, bands of 95 %", "waves": "Waves"}
    titles |= {"sensitivity": "Sobol indices over the priors", "emulators": "Emulators"}
    for name, title in titles.items():
        if len(tables[name]):
            lines += [f"## {title}", "", *_lines(tables[name]), ""]
    preset = contact_preset(result)
    if preset is not None:
        with whole_file(output / PRESET) as temporary:
            temporary.write_text(preset, encoding="utf-8")
        lines += [f"Contact parameters for scenes: `contact: {{preset: {PRESET}}}`.", ""]
    lines += ["---", "", *(f"{line}  " for line in _footer(problem, command))]
    with whole_file(output / "calibration.md") as temporary:
        temporary.write_text("\n".join([*lines, ""]), encoding="utf-8")
    return lines


def _statements(result: Result, posterior: pd.DataFrame, fit: pd.DataFrame) -> list[str]:
    content, found = result.problem.content, result.diagnostics
    verdicts = zip(posterior["parameter"][:-1], posterior["verdict"][:-1], strict=True)
    unsettled = [f"{name}: {verdict}" for name, verdict in verdicts if verdict != "identified"]
    lines = [f"**Warning: {text}.**" for text in result.warnings]
    lines.append(f"Not settled by the data: {'; '.join(unsettled) or 'none of the parameters'}.")
    for fitted, what in ((True, "fitted"), (False, "predicted only")):
        part = fit[fit["fitted"] == fitted]
        if len(part) and "covered" in part and part["covered"].notna().any():
            part = part[part["covered"].notna()]
            error = float(np.sqrt(np.mean(part["deviation [%]"].astype(float) ** 2)))
            inside = f"{int(part['covered'].sum())} of {len(part)} in their 95 % bands"
            lines.append(f"Data {what}: {inside}, root mean square deviation of the medians {error:.1f} %.")
    time, steps = found["autocorrelation time"], found["steps over autocorrelation time"]
    return [
        *lines,
        "Assumed: the model's discrepancy is normal and independent from datum to datum. Its standard deviation over "
        f"the mean size of the measure has a half-normal prior of scale {content.discrepancy:g}. Emulators' errors are "
        f"independent. Points with an implausibility above {CUTOFF:g} are ruled out between waves.",
        f"Sampled by emcee: autocorrelation time {time:.0f} steps, {steps:.0f} of them ({ENOUGH_TIMES} are enough), "
        f"acceptance {found['acceptance']:.2f}, {found['effective draws']:.0f} effective draws. A parameter whose 95 % "
        f"interval is wider than {WEAKLY:g} times that of its prior is weakly identified, from {NOT_IDENTIFIED:g} not.",
    ]


def _emulators(result: Result) -> pd.DataFrame:
    rows = []
    for datum, emulator in zip(result.problem.data, result.emulators, strict=True):
        if emulator is None:
            continue
        row = {**result.problem.conditions[datum.condition], "measure": datum.measure, "runs": len(emulator.inputs)}
        row |= {"scatter of seeds [%]": 100 * emulator.noise / abs(emulator.mean) if emulator.mean else np.nan}
        row |= {"explained, left out one by one": emulator.explained}
        row |= {"within 2 sd [%]": 100 * float(np.mean(np.abs(emulator.loo) < 2))}
        names = [f"length of {name}" for name in result.problem.names]
        row |= dict(zip(names, emulator.lengths, strict=True))
        rows.append(row)
    return pd.DataFrame(rows)


def _lines(table: pd.DataFrame) -> list[str]:
    cells = [
        [f"{cell:.4g}" if isinstance(cell, float) else str(cell) for cell in row] for row in table.to_numpy(object)
    ]
    return table_lines([str(column) for column in table.columns], cells)


def _footer(problem: Problem, command: str) -> list[str]:
    digests = [hashlib.sha256(text.encode()).hexdigest()[:12] for text in (problem.text, problem.data_text)]
    names = ("smarticles", "scikit-learn", "emcee", "SALib")
    versions = ", ".join(f"{name} {importlib.metadata.version(name)}" for name in names)
    return [
        f"Command: {command}",
        f"Calibration file: {problem.path.name}, SHA-256 {digests[0]}",
        f"Data: {problem.content.data}, SHA-256 {digests[1]}",
        f"Versions: {versions}",
    ]


def _contacts(problem: Problem, theta: Array) -> list[dict[str, float]]:
    """Return the contact parameters by name, for free parameters `theta` (d,).

    The list has one entry per condition, from its scene. Without scenes it has one entry: the free parameters that are
    contact parameters.
    """
    if problem.content.template or problem.content.scene:
        _, points = problem.sweep(problem.content.waves, theta[None, :])
        return [point.scene.contact.model_dump() for point in points]
    parameters = dict(zip(problem.names, map(float, theta), strict=True))
    return [{name: value for name, value in parameters.items() if name in Contact.model_fields}]


def contact_preset(result: Result) -> str | None:
    """Return the text of a preset with the medians of the posterior.

    None if no free parameter is a contact parameter, or contact parameters differ between conditions.
    """
    problem, posterior = result.problem, result.posterior().iloc[:-1]
    low, high = problem.bounds
    found = _contacts(problem, np.array([float(f"{value:.4g}") for value in posterior["median"]]))
    moved = _contacts(problem, low)[0] != _contacts(problem, high)[0]
    if not moved or any(one != found[0] for one in found):
        return None
    heads = [f"# Contact parameters by `smarticles calibrate`: medians of the posterior of {problem.content.name}."]
    for _, row in posterior.iterrows():
        heads.append(f"# {row['parameter']}: 95 % {row['low 95 %']:.3g} to {row['high 95 %']:.3g}, {row['verdict']}")
    return "\n".join([*heads, str(yaml.safe_dump(found[0], sort_keys=False))])


def _draw_pairs(result: Result, path: Path) -> None:
    """Draw the posterior: histograms with the priors on the diagonal, pairs of parameters below it."""
    names = [*result.problem.names, "discrepancy"]
    count = len(names)
    figure = style.blank_figure(1.4 * count + 0.6, 1.4 * count + 0.4)
    grid = figure.subplots(count, count, squeeze=False)
    for row in range(count):
        for column in range(count):
            axes, across = grid[row, column], result.draws[:, column]
            if column > row:
                axes.set_visible(False)
            elif column < row:
                axes.hist2d(across, result.draws[:, row], bins=40, cmap="Blues")
            else:
                axes.hist(across, bins=40, density=True, color=style.SKY)
                axes.set_yticks([])
                _draw_prior(result.problem, column, axes)
            if row == count - 1:
                axes.set_xlabel(names[column])
            if column == 0 and row:
                axes.set_ylabel(names[row])
    style.add_footer(figure, ["Posterior; line: prior."])
    style.save(figure, path, formats=("png", "svg"))


def _draw_prior(problem: Problem, column: int, axes: Axes) -> None:
    places = np.linspace(*axes.get_xlim(), 200)
    if column < len(problem.names):
        density = problem.content.free[problem.names[column]].distribution.pdf(places)
    else:
        density = halfnorm(scale=problem.content.discrepancy).pdf(places)
    axes.plot(places, density, color=style.ORANGE)


def _draw_fit(result: Result, fit: pd.DataFrame, path: Path) -> None:
    """Draw data and predictive bands, one panel for each measure."""
    first = next(iter(result.problem.conditions[0]), "")
    measures = list(dict.fromkeys(fit["measure"]))
    figure, axes = panels(len(measures), columns=2)
    for panel, measure in zip(axes, measures, strict=True):
        part = fit[fit["measure"] == measure]
        numeric = bool(first) and pd.api.types.is_numeric_dtype(part[first])
        part = part.sort_values(first) if numeric else part
        x = (part[first] if numeric else pd.Series(range(len(part)), index=part.index)).to_numpy(np.float64)
        if "median" in part:
            panel.fill_between(x, part["low 95 %"], part["high 95 %"], color=style.SKY, alpha=0.4, linewidth=0)
            panel.plot(x, part["median"], color=style.BLUE)
        for fitted, colour in ((True, style.BLACK), (False, "white")):
            kept = (part["fitted"] == fitted).to_numpy()
            panel.errorbar(x[kept], part["value"][kept], yerr=1.96 * part["error"][kept], fmt="o", color=style.BLACK,
                           markerfacecolor=colour)  # fmt: skip
        column, _, phase = (text.strip() for text in measure.partition("@"))
        after = {"": "", "-1": ", last phase"}.get(phase, f", phase {phase}")
        panel.set(xlabel=first if numeric else "condition", ylabel=column + after)
    band = "Band: 95 % of what a measurement would give, error included; line: its median; open points: predicted only."
    style.add_footer(figure, [band, "Error bars: 95 % confidence of the data, 1.96 times their error."])
    style.save(figure, path, formats=("png", "svg"))
