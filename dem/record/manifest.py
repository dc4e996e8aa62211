"""Old names of what a run is, until studies and pictures have moved to `Run` (today)."""
# ruff: noqa: D102

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from dem.record.document import Phase as PhaseRecord
from dem.record.run import Run

__all__ = ["PhaseRecord", "RunManifest", "read_run"]


class RunManifest(Run):
    """A run by the names that it had: use `Run`, `run.manifest` and `run.status`."""

    @property
    def directory(self) -> Path:
        return self.path

    @property
    def cause(self) -> str | None:
        return self.status.cause

    @property
    def end_time(self) -> float | None:
        return self.status.time_s

    @property
    def steps(self) -> int | None:
        return self.status.steps

    @property
    def wall_time(self) -> float | None:
        return self.status.wall_s

    @property
    def processor_time(self) -> float | None:
        return self.status.cpu_s

    def walled(self, phase: int) -> bool:
        return self.manifest.walled(phase)

    def fills_cylinder(self, phase: int) -> bool:
        return self.manifest.fills_cylinder(phase)

    @property
    def name(self) -> str:
        return self.manifest.name

    @property
    def scene_sha256(self) -> str:
        return self.manifest.scene_sha256

    @property
    def seed(self) -> int:
        return self.manifest.seed

    @property
    def command(self) -> str:
        return self.manifest.command

    @property
    def started(self) -> str:
        return self.manifest.started

    @property
    def versions(self) -> Mapping[str, str]:
        return self.manifest.versions

    @property
    def threads(self) -> int:
        return self.manifest.threads

    @property
    def fidelity(self) -> str:
        return self.manifest.fidelity

    @property
    def count(self) -> int:
        return self.manifest.count

    @property
    def aspect_ratio(self) -> float:
        return self.manifest.aspect_ratio

    @property
    def middle_length(self) -> float:
        return self.manifest.middle_length_m

    @property
    def barb_length(self) -> float:
        return self.manifest.barb_length_m

    @property
    def thickness_normal(self) -> float:
        return self.manifest.thickness_normal_m

    @property
    def thickness_in_plane(self) -> float:
        return self.manifest.thickness_in_plane_m

    @property
    def middle_thickness_in_plane(self) -> float | None:
        return self.manifest.middle_thickness_in_plane_m

    @property
    def smarticle_mass(self) -> float:
        return self.manifest.smarticle_mass_kg

    @property
    def solid_volume(self) -> float:
        return self.manifest.solid_volume_m3

    @property
    def container_radius(self) -> float:
        return self.manifest.container_radius_m

    @property
    def packing_radius(self) -> float | None:
        return self.manifest.packing_radius_m

    @property
    def container_tiers(self) -> int:
        return self.manifest.container_tiers

    @property
    def planar(self) -> bool:
        return self.manifest.planar

    @property
    def channel_width(self) -> float | None:
        return self.manifest.channel_width_m

    @property
    def engine(self) -> str:
        return self.manifest.engine

    @property
    def sphere_diameter(self) -> float:
        return self.manifest.sphere_diameter_m

    @property
    def spheres_per_smarticle(self) -> int:
        return self.manifest.spheres_per_smarticle

    @property
    def time_step(self) -> float:
        return self.manifest.time_step_s

    @property
    def taken_over(self) -> Mapping[str, Any] | None:
        return self.manifest.taken_over

    @property
    def thicknesses_in_plane(self) -> tuple[float, float, float]:
        return self.manifest.thicknesses_in_plane_m

    @property
    def bulge(self) -> float:
        return self.manifest.bulge_m

    @property
    def measured_radius(self) -> float:
        return self.manifest.measured_radius_m


def read_run(directory: Path | str) -> RunManifest:
    """Open a run by the names that it had."""
    run = RunManifest(Path(directory))
    _ = run.phases
    return run
