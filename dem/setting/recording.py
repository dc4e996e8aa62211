"""What a run records, and how often."""

from typing import Literal

from pydantic import Field

from dem.setting.part import Duration, Part


class Recording(Part):
    """Quantities that a run records, and the intervals between two records."""

    frame_interval_s: Duration = Field(
        0.04,
        description="time between VTK frames [s], besides the one at the end of each phase; not a multiple of the "
        "shaking period, to sample all its phases",
    )
    frames: Literal["vtu", "vtkhdf"] = Field(
        "vtu",
        description="files of the frames. vtu: one per frame. vtkhdf: one for all, which ParaView reads from 5.12 on, "
        "with the radius of each body",
    )
    sphere_interval_s: Duration | None = Field(
        None,
        description="time between VTK files of the spheres that represent the smarticles, for ParaView's glyphs [s]; "
        "null: no such files",
    )
    contact_forces: bool = Field(
        False,
        strict=True,
        description="whether to record the forces at all contacts (force chains) with each frame, in a separate file",
    )
    series_interval_s: Duration = Field(0.004, description="time between samples of the HDF5 series [s]")
    energy: bool = Field(
        False,
        strict=True,
        description="whether to record energies and the work of the container, in addition to the work of motors",
    )
    dissipation_interval_s: Duration | None = Field(
        None,
        description="time between samples of the power that contacts dissipate [s], which closes the energy ledger; "
        "null: no samples. A sample costs 10 µs per contact, as much as about twenty steps of a small pile; 2e-4 s is "
        "short enough",
    )
    checkpoint_interval_s: Duration | None = Field(
        0.4,
        description="simulated time between checkpoints [s]; null: none. At a checkpoint the run reloads itself, so "
        "that a resumed run has the same bits; runs with other intervals differ in their last bits",
    )

    def samples_in(self, interval_s: float | None) -> int:
        """Return how often the series is sampled in an interval [s], rounded; 0 for None."""
        return round((interval_s or 0.0) / self.series_interval_s)

    @property
    def energies(self) -> bool:
        """Whether energies are recorded: if `energy` is true, or dissipation is sampled."""
        return self.energy or self.dissipation_interval_s is not None
