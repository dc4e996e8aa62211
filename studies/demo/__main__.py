"""Draw the runs of the demo on the published table that has their scenes, and describe them.

    python -m studies.demo DIR

DIR is the directory of the sweep `studies/demo/sweep.yaml`. The figure is DIR/figure.png.
"""

import argparse
from collections.abc import Sequence
from pathlib import Path

import pandas as pd

from postprocess.report import figures as style
from postprocess.statistics.points import ASPECT, SEED, marked
from studies.framework.figures import ASPECT_LABEL, Analysis, Means, Series, by_procedure, marker
from studies.framework.procedures import CROSSINGS, EXTERNAL, HEIGHT, INTERNAL, PROCEDURE, SHAPE, STATIC, samples
from studies.framework.runs import collect_runs, read_runs
from studies.registry import shipped
from templates.sweep.folder import open_folder

TABLE = "procedures-main-rigid"  #: Folder under results/
RESULTS = Path(__file__).parents[2] / "results"

_STUDY = shipped(TABLE).load()
_RING = {**marker("o", style.BLACK, "none"), "markersize": 7.0, "linestyle": "none", "zorder": 5}
_DOT = {**marker(".", style.GREY, style.GREY), "linestyle": "none"}


class Compared:
    """Runs of the demo beside the published runs of their study, one row per procedure, aspect ratio and seed."""

    def __init__(self, demo: pd.DataFrame, published: pd.DataFrame) -> None:
        self.points = _STUDY.points(samples(published))
        self.seeds, self.demo = samples(published), samples(demo).set_index(PROCEDURE)

    def text(self, procedure: str, column: str = CROSSINGS) -> str:
        """Return the demo's number, with mean, standard error and range of the published seeds at its aspect ratio."""
        row = self.demo.loc[procedure]
        point, seeds = (
            table[(table[PROCEDURE] == procedure) & (table[ASPECT] == row[ASPECT])]
            for table in (self.points, self.seeds)
        )
        mean, error = point[column].item(), point[marked(column, "SE")].item()
        low, high = seeds[column].min(), seeds[column].max()
        return f"{row[column]:.2f} ({mean:.2f} ± {error:.2f}, {low:.2f} to {high:.2f})"

    def sentences(self) -> list[str]:
        """Describe the piles in three sentences."""
        count = self.seeds[SEED].nunique()
        return [
            f"Poured smarticles of l/w = {self.demo[ASPECT].iloc[0]:g} are crossed by ⟨N⟩ = {self.text(STATIC)} links of "
            f"others each; in brackets mean ± standard error and range of {count} published seeds.",
            f"One change of shape, straight and back, raises ⟨N⟩ to {self.text(SHAPE)}, and the centre of mass to "
            f"{self.text(SHAPE, HEIGHT)} of its height before.",
            f"20 s of shaking raise ⟨N⟩ to {self.text(EXTERNAL)}, 5 s of internal oscillation to {self.text(INTERNAL)}, "
            f"and both lower the centre of mass: to {self.text(EXTERNAL, HEIGHT)} and {self.text(INTERNAL, HEIGHT)}.",
        ]

    def draw(self, path: Path) -> Path:
        """Draw the demo's numbers on the published means over l/w; return the path of the picture."""
        demo = self.demo.reset_index()
        table = pd.concat(
            [part.assign(part=name) for name, part in (("mean", self.points), ("seed", self.seeds), ("demo", demo))]
        )

        def split(points: pd.DataFrame) -> list[Series]:
            parts = dict(iter(points.groupby("part")))
            return [
                *by_procedure(apart=0.004)(parts["mean"]),
                Series(rows=parts["seed"], label="seeds of these means", properties=_DOT),
                Series(rows=parts["demo"], label="this demo", properties=_RING),
            ]

        quantities = [one for one in _STUDY.quantities if one.column in (CROSSINGS, HEIGHT)]
        means = Means(
            name="demo",
            quantities=quantities,
            x=ASPECT,
            x_label=ASPECT_LABEL,
            split=split,
            notes=[f"Means: results/{TABLE}, links, fidelity standard. This demo: one seed, computed anew."],
        )
        with style.style():
            written = means.draw(path, Analysis(tables={"points": table.reset_index(drop=True)}, runs={}, footer=[]))
        return next(one for one in written if one.suffix == ".png")


def main(arguments: Sequence[str] | None = None) -> None:
    """Draw the figure of the demo, and print its path and the sentences."""
    parser = argparse.ArgumentParser(prog="python -m studies.demo", description=(__doc__ or "").split("\n\n")[0])
    parser.add_argument("directory", type=Path, metavar="DIR", help="directory of the demo's sweep")
    folder = open_folder(parser.parse_args(arguments).directory)
    found = collect_runs(TABLE, [folder.run(entry) for entry in folder.entries], _STUDY.measured)
    compared = Compared(found.table(), read_runs(RESULTS / TABLE))
    print(f"figure: {compared.draw(folder.path / 'figure')}", *compared.sentences(), sep="\n")


if __name__ == "__main__":
    main()
