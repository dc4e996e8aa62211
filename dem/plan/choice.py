"""The engine and fidelity that a scene needs, from what was measured: a limit of the error, of the hours, or of both.

The table is the one that `smarticles accuracy` writes: what each named fidelity errs by on some scene, and how its
processor times compare with the planned wall times. The hours are those planned for this scene, times that ratio. One
with the knob `engine` tells of both engines, against the same reference; one with the knob `fidelity` of a single one.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from dem.errors import InputError
from dem.plan.measured import FINER, FINEST, AccuracyTable, Measured
from dem.plan.outlook import Plan, plan
from dem.scene.reading import parse_scene
from dem.scene.scene import Scene


@dataclass(frozen=True, kw_only=True)
class Expectation:
    """What a fidelity is expected to bring on the scene at hand.

    Args:
        measured: its errors, on the scene of the table.
        hours: wall time on this scene, on one core of the table's machine [h].
    """

    measured: Measured
    hours: float


@dataclass(frozen=True, kw_only=True)
class Choice:
    """The engine and fidelity chosen.

    Args:
        planned: the plan of the scene with it, its wall times corrected by what was measured.
        expected: what it is expected to bring.
        why: which limit it answers.
        notes: what is to be known about it, one line each.
    """

    planned: Plan
    expected: Expectation
    why: str
    notes: tuple[str, ...]

    @property
    def fidelity(self) -> str:
        """Its name."""
        return self.expected.measured.fidelity

    @property
    def engine(self) -> str:
        """The engine it is on."""
        return self.expected.measured.engine

    def to_dict(self) -> dict[str, Any]:
        """Plain data for `--json`; an unknown number is null."""
        errors = [
            {"of": error.of, "value": _known(error.value), "band": _known(error.band)}
            for error in self.expected.measured.errors
        ]
        return {
            "engine": self.engine,
            "fidelity": self.fidelity,
            "expected_hours": self.expected.hours,
            "errors": errors,
            "seeds": self.expected.measured.seeds,
            "why": self.why,
            "notes": list(self.notes),
        }

    def to_text(self) -> str:
        """A few lines for the terminal."""
        measured = self.expected.measured
        errors = "none by definition" if measured.is_reference else ", ".join(map(str, measured.errors))
        lines = [
            f"engine {self.engine}, fidelity {self.fidelity}: {self.why}",
            f"expected: {self.expected.hours:.2g} h of one core, error {errors} ({measured.seeds} seeds)",
            *(f"note: {note}" for note in self.notes),
        ]
        return "\n".join([*lines, f"use it: --engine {self.engine} --set fidelity={self.fidelity}"])


def _known(number: float) -> float | None:
    return None if math.isnan(number) else number


def choose(
    scene: Scene, table: AccuracyTable, *, max_error: float | None = None, max_hours: float | None = None
) -> Choice:
    """Engine and fidelity for a scene: the cheapest within the error, else the most exact within the hours.

    Args:
        scene: the scene; its own engine and fidelity do not matter.
        table: what was measured.
        max_error: largest relative error of what `table` was read for, against the reference fidelity [1].
        max_hours: longest wall time on one core [h].

    Raises:
        InputError: no fidelity keeps the limit, or the two contradict each other; the message says which gives way.
    """
    plans: dict[str, Plan] = {}
    expected: list[Expectation] = []
    refused: list[InputError] = []
    for one in table.fidelities:
        try:
            plans[one.name] = plan(_with_fidelity(scene, one)).corrected(one.ratio)
        except InputError as error:  # such as two rows in a section that is square
            refused.append(error)
            continue
        expected.append(Expectation(measured=one, hours=plans[one.name].wall_s / 3600))
    if not expected:
        raise refused[0]
    picked, why = pick(expected, max_error=max_error, max_hours=max_hours)
    return Choice(
        planned=plans[picked.measured.name],
        expected=picked,
        why=why,
        notes=(*map(str, refused), *_notes(scene, table, picked.measured, max_error)),
    )


def _with_fidelity(scene: Scene, measured: Measured) -> Scene:
    data = {**scene.model_dump(mode="json"), "engine": measured.engine, "fidelity": measured.fidelity}
    return parse_scene(data, source=f"{scene.name} at fidelity {measured.name}")


def pick(
    expected: Sequence[Expectation], *, max_error: float | None, max_hours: float | None
) -> tuple[Expectation, str]:
    """What keeps the limits, and in words which one; arguments and errors as `choose`, fidelities coarse to fine.

    Of those that the hours allow the most exact is taken: the reference, else the finest of an engine, and of several
    engines' finest the one whose error is known and least.
    """
    quick = [one for one in expected if max_hours is None or one.hours <= max_hours]
    if max_error is None:
        if quick:
            return _most_exact(quick), f"the most exact within --max-hours {max_hours:g}"
        least = min(expected, key=lambda one: one.hours)
        msg = (
            f"--max-hours {max_hours:g}: even {least.measured.name} is expected to take {least.hours:.2g} h; "
            f"give --max-hours {_above(least.hours)} or a smaller scene"
        )
        raise InputError(msg)
    exact = [one for one in expected if abs(one.measured.worst.value) <= max_error]
    if not exact:
        known = [one for one in expected if not math.isnan(one.measured.worst.value)]
        best = min(known, key=lambda one: abs(one.measured.worst.value)).measured
        msg = (
            f"--max-error {max_error:g}: no fidelity of the table is known to be within; the best is {best.name}, "
            f"{best.worst}; give --max-error {_above(abs(best.worst.value))} or a table with finished reference runs"
        )
        raise InputError(msg)
    need = min(exact, key=lambda one: one.hours)
    if max_hours is None or need.hours <= max_hours:
        limits = f"--max-error {max_error:g}" + ("" if max_hours is None else f" and --max-hours {max_hours:g}")
        return need, f"the cheapest within {limits}"
    msg = (
        f"--max-error {max_error:g} and --max-hours {max_hours:g} contradict each other: {need.measured.name}, the "
        f"cheapest within the error, is expected to take {need.hours:.2g} h; accuracy goes first, so the hours give "
        f"way: --max-hours {_above(need.hours)}"
    )
    known = [one for one in quick if not math.isnan(one.measured.worst.value)]
    if known:
        best = min(known, key=lambda one: abs(one.measured.worst.value)).measured
        msg += f"; or accept {best.name} ({best.worst}) with --max-error {_above(abs(best.worst.value))}"
    raise InputError(msg)


def _most_exact(able: Sequence[Expectation]) -> Expectation:
    finest = {one.measured.engine: one for one in able}.values()
    return min(finest, key=lambda one: (not one.measured.is_reference, _or_inf(abs(one.measured.worst.value))))


def _or_inf(number: float) -> float:
    return math.inf if math.isnan(number) else number


def _above(number: float) -> str:
    """A number rounded up to two digits."""
    if number <= 0:
        return "0"
    unit = 10.0 ** (math.floor(math.log10(number)) - 1)
    return f"{math.ceil(number / unit - 1e-9) * unit:.3g}"


def _notes(scene: Scene, table: AccuracyTable, measured: Measured, max_error: float | None) -> tuple[str, ...]:
    notes = []
    if not measured.is_reference:
        others = ", ".join(str(error) for error in measured.others if not math.isnan(error.value))
        if others:
            notes.append(f"not asked for (--of): {others}")
        bounds = [abs(error.value) + error.band for error in measured.errors]
        if any(math.isnan(bound) for bound in bounds):
            notes.append("the scatter between seeds is not known, so the error is not assured; measure with more seeds")
        elif max_error is not None and max(bounds) > max_error:
            notes.append(
                f"not assured: the scatter of {measured.seeds} seeds allows an error up to {max(bounds):.2g}, more "
                f"than --max-error {max_error:g}; measure with more seeds"
            )
    if not table.reference.endswith((FINEST, FINER)):
        notes.append(f"errors are against {table.reference}: the table has no finished runs of {FINEST}")
    here = {
        "l/w": (f"{scene.smarticle.aspect_ratio:g}", f"{table.aspect_ratio:g}"),
        "N": (str(scene.count), str(table.count)),
        "activity": (_activity(scene), table.activity),
    }
    for name, (own, there) in here.items():
        if own != there:
            notes.append(f"errors were measured at {name} {there}, this scene has {own or 'none'}")
    return (*notes, f"table: {table.path}")


def _activity(scene: Scene) -> str:
    kinds = dict.fromkeys(phase.type for phase in scene.phases)
    return " ".join(kind for kind in kinds if kind not in ("deposit", "take-over", "relax"))
