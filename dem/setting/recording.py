"""What a run writes, and how often, as a scene states it."""

from __future__ import annotations

from pydantic import Field

from dem.setting.part import Duration, Part


class Recording(Part):
    """What is written, and how often."""

    frame_interval_s: Duration = Field(
        0.04,
        description="time between VTK frames [s]; not a multiple of the shaking period, to sample all its phases",
    )
    sphere_interval_s: Duration | None = Field(
        None,
        description="time between VTK files of the spheres that stand for the smarticles, for ParaView's glyphs [s]; "
        "null: none",
    )
    contact_forces: bool = Field(
        False,
        strict=True,
        description="whether to record with each frame, in a file of its own, the forces at all contacts: force chains",
    )
    series_interval_s: Duration = Field(0.004, description="time between samples of the HDF5 series [s]")
    energy: bool = Field(
        False,
        strict=True,
        description="whether to record energies and the work of the container as well as the motors'",
    )
    dissipation_interval_s: Duration | None = Field(
        None,
        description="time between samples of what contacts dissipate [s], which closes the energy ledger; null: "
        "none. A sample costs 10 µs per contact, as much as some twenty steps of a small pile; 2e-4 s is dense enough",
    )
    checkpoint_interval_s: Duration | None = Field(
        0.4,
        description="simulated time between checkpoints [s]; null: none. At a checkpoint the run reloads itself, so "
        "that a resumed run has the same bits; runs with other intervals differ in their last bits",
    )

    def samples_in(self, interval_s: float | None) -> int:
        """Samples of the series in one of the other intervals [s]; 0 for none."""
        return round((interval_s or 0.0) / self.series_interval_s)

    @property
    def energies(self) -> bool:
        """Whether energies are recorded: asked for, or needed by the energy ledger."""
        return self.energy or self.dissipation_interval_s is not None
