"""The liquid that filaments are immersed in."""

from pydantic import Field

from dem.body.filament import Liquid as Immersing
from dem.setting.part import Part


class Liquid(Part):
    """A liquid at rest in the whole container, with buoyancy and drag of filaments, but without surface."""

    density_kg_per_m3: float = Field(1000.0, ge=0, le=25000, description="density [kg/m³]")
    viscosity_Pa_s: float = Field(1e-3, ge=0, le=1e4, description="dynamic viscosity [Pa s]")

    @property
    def immersing(self) -> Immersing:
        """The same liquid as an object that filaments use, `dem.body.filament.Liquid`."""
        return Immersing(viscosity=self.viscosity_Pa_s, density=self.density_kg_per_m3)
