"""What is known of the errors of a scene's settings: the ladder that `smarticles accuracy` measured."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from dem.errors import InputError
from dem.plan.choice import QUANTITIES, Error, read_table
from dem.setting.fidelity import fidelities
from smarticles.reporting.page import Block, Table, Words
from smarticles.reporting.tables import word

if TYPE_CHECKING:
    from dem.scene.scene import Scene


def accuracy_blocks(scene: Scene | None, table: Path | None) -> list[Block]:
    """The knobs of a scene's fidelity, and what its named fidelity was measured to err by.

    Args:
        scene: None where it cannot be read: then there is nothing to tell.
        table: of `smarticles accuracy`; None: the one that ships.
    """
    if scene is None:
        return []
    named = fidelities(scene.engine)[scene.fidelity.base]
    knobs = scene.fidelity.model_dump(exclude={"base"})
    changed = [knob for knob, value in knobs.items() if knob in named and value != named[knob]]
    rows = [[knob, word(value), word(named.get(knob))] for knob, value in knobs.items()]
    blocks: list[Block] = [
        Table(
            caption=f"Fidelity {scene.fidelity.base} on {scene.engine}, knob by knob",
            header=["knob", "here", f"{scene.fidelity.base} by name"],
            rows=rows,
        )
    ]
    try:
        known = read_table(table, of=tuple(QUANTITIES))
    except InputError as error:
        return [*blocks, Words(lines=[f"How large its errors are is not known here: {error}"], tone="note")]
    here = [one for one in known.fidelities if (one.engine, one.fidelity) == (scene.engine, scene.fidelity.base)]
    measured_on = (
        f"measured with {known.count} smarticles of l/w = {known.aspect_ratio:g}, {known.activity}, against "
        f"{known.reference}; ± is the half-width of the 95 % interval over seeds"
    )
    blocks.append(
        Table(
            caption=f"Relative errors of named fidelities, {measured_on}",
            header=["engine", "fidelity", "seeds", *(QUANTITIES.values()), ""],
            rows=[
                [one.engine, one.fidelity, str(one.seeds), *map(_told, one.errors), "this one" if one in here else ""]
                for one in known.fidelities
            ],
        )
    )
    notes = []
    if not here:
        notes.append(f"Fidelity {scene.fidelity.base} on {scene.engine} is not among those measured.")
    if changed:
        notes.append(f"This scene changes {', '.join(changed)}, which the table does not know of.")
    notes.append("These errors were measured on that pile; another pile, activity or quantity may err by more.")
    return [*blocks, Words(lines=notes, tone="note")]


def _told(error: Error) -> str:
    band = "" if error.band != error.band else f" ± {100 * error.band:.1f}"
    return "-" if error.value != error.value else f"{100 * error.value:+.1f}{band} %"
