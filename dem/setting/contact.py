"""Contact parameters of a scene."""

from pydantic import Field

from dem.setting.part import Part


class Contact(Part):
    """Friction, restitution and damping at contacts of smarticles with each other and the container."""

    friction_smarticle: float = Field(0.4, ge=0, le=10, description="Coulomb coefficient, smarticle-smarticle [1]")
    friction_wall: float = Field(0.4, ge=0, le=10, description="Coulomb coefficient, smarticle-container [1]")
    restitution: float = Field(
        0.7,
        ge=0.01,
        le=1,
        description="normal coefficient of restitution of a single contact at the typical effective mass, the harmonic "
        "mean over the smarticle's spheres and directions [1]; 0.7: steel on steel below 1 m/s",
    )
    tangential_stiffness_ratio: float = Field(
        0.82, ge=1e-3, le=1, description="ks/kn [1]; Mindlin's 2(1-ν)/(2-ν) is 0.82 for steel, ν = 0.3"
    )
    tangential_damping_ratio: float = Field(
        0.9,
        ge=0,
        le=1,
        description="cs/cn of a sticking contact [1]; √(ks/kn) = 0.9 damps both directions by the same ratio",
    )
