"""Draw the runs of the demo beside the published table of their scenes, and describe them.

    python -m studies.demo DIR

DIR is the directory of the sweep `studies/demo/sweep.yaml`. Writes DIR/picture.png and DIR/figure.png.
"""

import argparse
from collections.abc import Sequence
from pathlib import Path

import pandas as pd

from dem.display import progress_of
from dem.errors import InputError
from dem.record.run import Run, open_run
from dem.terminal import folded, printable, screen_width
from postprocess.pictures.canvas import Style, Subject
from postprocess.pictures.render import pictures
from postprocess.report import figures as style
from postprocess.report.tables import whole_file
from postprocess.statistics.points import ASPECT, SEED, marked
from studies.framework.figures import ASPECT_LABEL, CROSSINGS_LABEL, Analysis, Means, Series, by_procedure, marker
from studies.framework.procedures import (
    CROSSINGS,
    EXTERNAL,
    HEIGHT,
    INTERNAL,
    PROCEDURE,
    SHAPE,
    STATIC,
    procedure_row,
    samples,
)
from studies.framework.runs import Quantity, read_runs
from studies.registry import shipped
from templates.sweep.folder import open_folder

TABLE = "procedures-main-rigid"  #: Folder under results/ whose scenes the demo computes anew
RESULTS = Path(__file__).parents[2] / "results"

_SIZE = (640, 640)  # of the picture of one pile [pixel]
_AXES = {CROSSINGS: CROSSINGS_LABEL, HEIGHT: "height of the centre of mass\nover that before $h/h_0$ [-]"}
_RING = {**marker("o", style.BLACK, "none"), "markersize": 7.0, "linestyle": "none", "zorder": 5}
_DOT = {**marker(".", style.GREY, style.GREY), "markersize": 2.5, "linestyle": "none", "zorder": 1}


class Compared:
    """Numbers of the demo beside those of the published runs: a row per procedure, aspect ratio and seed."""

    def __init__(self, demo: pd.DataFrame, published: pd.DataFrame) -> None:
        self.demo, self.seeds = samples(demo), samples(published)
        self.means = shipped(TABLE).load().points(self.seeds)

    def text(self, procedure: str, column: str = CROSSINGS) -> str:
        """Return the demo's number, and mean, standard error and range of the published seeds of its point."""
        own = self.demo[self.demo[PROCEDURE] == procedure].iloc[0]
        mean, seeds = (
            table[(table[PROCEDURE] == procedure) & (table[ASPECT] == own[ASPECT])]
            for table in (self.means, self.seeds)
        )
        value, error = mean[column].item(), mean[marked(column, "SE")].item()
        low, high = seeds[column].min(), seeds[column].max()
        return f"{own[column]:.2f} ({value:.2f} ± {error:.2f}, {low:.2f} to {high:.2f})"

    def sentences(self) -> list[str]:
        """Describe the piles in three sentences."""
        aspect, count = self.demo[ASPECT].iloc[0], self.seeds[SEED].nunique()
        return [
            f"As poured, ⟨N⟩ = {self.text(STATIC)} links of others pass through the plane of a smarticle of "
            f"l/w = {aspect:.1f}; in brackets: mean ± standard error, and range, of {count} published seeds.",
            f"One change of shape, straight and back, raises ⟨N⟩ to {self.text(SHAPE)} and the centre of mass to "
            f"{self.text(SHAPE, HEIGHT)} times its height before.",
            f"Shaking for 20 s raises ⟨N⟩ to {self.text(EXTERNAL)}, and oscillating the barbs for 5 s to "
            f"{self.text(INTERNAL)}, while the centre of mass sinks to {self.text(EXTERNAL, HEIGHT)} and "
            f"{self.text(INTERNAL, HEIGHT)} times its height.",
        ]

    def draw(self, path: Path) -> Path:
        """Draw the demo's numbers among the published ones over l/w; return the path of the figure."""
        parts = {"means": self.means, "seeds": self.seeds, "demo": self.demo}
        points = pd.concat([part.assign(part=name) for name, part in parts.items()], ignore_index=True)

        def split(table: pd.DataFrame) -> list[Series]:
            means, seeds, demo = (table[table["part"] == name] for name in parts)
            return [
                *by_procedure(apart=0.004)(means),
                Series(rows=seeds, label="seeds of these", properties=_DOT),
                Series(rows=demo, label="this demo", properties=_RING),
            ]

        means = Means(
            name=path.name,
            quantities=[Quantity(column=column, axis=axis) for column, axis in _AXES.items()],
            x=ASPECT,
            x_label=ASPECT_LABEL,
            split=split,
            notes=[f"Published: results/{TABLE}, engine links, fidelity standard. This demo: one of its seeds, anew."],
        )
        with style.style():
            files = means.draw(path, Analysis(tables={"points": points}, runs={}, footer=[]))
        return next(file for file in files if file.suffix == ".png")


def picture(runs: Sequence[Run], path: Path) -> Path:
    """Draw the pile as it was poured, and at the end of each run, side by side; return the path."""
    piles = [Subject(run.path) for run in (runs[0], *runs)]
    poured = piles[0].frames.in_phase(1)[-1].number
    shown = [[poured], *([len(pile.frames) - 1] for pile in piles[1:])]
    look = Style.of([pile.run for pile in piles], color_by="crossings", size=_SIZE, view=None)
    with whole_file(path, overwrite=True) as temporary:
        next(pictures(piles, shown, look)).save(temporary)
    return path


def runs_of(directory: Path, published: pd.DataFrame) -> list[Run]:
    """Open the runs of the demo's sweep; InputError if one is missing or is none of the published scenes."""
    folder = open_folder(directory)
    for entry in folder.entries:
        if entry.scene_sha256 not in set(published["scene_sha256"]):
            raise InputError(
                f"{directory}: {entry.name} is no scene of results/{TABLE}; give the sweep studies/demo/sweep.yaml"
            )
        if not folder.is_done(entry):
            raise InputError(f"{directory}: {entry.name} is not done; go on with: smarticles resume {directory}")
    return [open_run(folder.run(entry)) for entry in folder.entries]


def main(arguments: Sequence[str] | None = None) -> None:
    """Draw picture and figure of the demo, and print their paths and the sentences."""
    parser = argparse.ArgumentParser(prog="python -m studies.demo", description=(__doc__ or "").split("\n\n")[0])
    parser.add_argument("directory", type=Path, metavar="DIR", help="directory of the demo's sweep")
    directory: Path = parser.parse_args(arguments).directory
    try:
        published = read_runs(RESULTS / TABLE)
        runs = runs_of(directory, published)
    except InputError as error:
        parser.error(str(error))
    with progress_of("drawing"):
        compared = Compared(pd.DataFrame([procedure_row(run) for run in runs]), published)
        drawn, figure = picture(runs, directory / "picture.png"), compared.draw(directory / "figure")
    with printable():
        for line in (f"picture: {drawn}", f"figure: {figure}", *compared.sentences()):
            print(folded(line, width=screen_width()))


if __name__ == "__main__":
    main()
