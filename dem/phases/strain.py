"""The phase that pulls a chain apart."""

from collections.abc import Iterator, Mapping
from typing import ClassVar, Literal

from pydantic import Field

from dem.body.chain import parted
from dem.engine.effect import EffectName
from dem.engine.interface import Engine
from dem.errors import rounded_up
from dem.phases.actuated import ActuatedPhase, Gait
from dem.phases.arrange import chain_of
from dem.phases.phase import CHECK_INTERVAL, SceneView, Stage
from dem.physics.contact import StringLaw
from dem.setting.motion import Hold
from dem.setting.motor import Motor
from dem.setting.part import Length, Part, Speed, Stiffness
from dem.setting.smarticle import Smarticle


class Strain(Part, ActuatedPhase):
    """Pull a chain apart by two strings at its ends, while motors hold the barbs' angles.

    Each string is tied to an outer barb; its far end is on the chain's axis. One far end is fixed, the other one moves
    along x. Strings pull and never push.
    """

    planar: ClassVar[bool | None] = True
    type: Literal["strain"]
    speed_m_per_s: Speed = Field(0.005, description="speed of the moving end [m/s]")
    distance_m: Length = Field(
        ..., description="largest distance by which this end moves [m]; the phase ends earlier when the chain parts"
    )
    tied_at: Literal["tip", "axis"] = Field(
        "tip",
        description="where strings are tied: at the tips of the outer barbs, or where these cross the chain's axis",
    )
    string_length_m: Length = Field(0.1, description="unstretched length of each string [m]")
    string_stiffness_N_per_m: Stiffness = Field(5000.0, description="stiffness of each string while taut [N/m]")
    string_damping_N_s_per_m: float = Field(1.0, ge=0, le=1e6, description="damping of each string while taut [N s/m]")

    @property
    def duration_s(self) -> float:
        """Longest duration of the phase [s]; it ends earlier when the chain parts."""
        return self.distance_m / self.speed_m_per_s

    def check(self, scene: SceneView, index: int) -> Iterator[str]:
        yield from super().check(scene, index)
        chain = chain_of(scene)
        if self.string_length_m < chain.width:
            yield (
                f"phases.{index}.string_length_m: {self.string_length_m:g} m does not reach the axis from a barb of a "
                f"chain that is h = {chain.width:.4g} m wide; use at least {rounded_up(chain.width, 4)} m"
            )

    def pushing_speed(self, gravity: float) -> float:
        return self.speed_m_per_s

    @property
    def pulled_by(self) -> tuple[float, float]:
        return self.string_stiffness_N_per_m, self.string_damping_N_s_per_m

    def gait(self, smarticle: Smarticle, motor: Motor) -> Gait:
        hold = Hold(type="hold")
        return Gait(motions=(hold, hold), duration=self.duration_s)

    def source_of(self, key: str) -> tuple[str, float | None]:
        return "distance_m", self.distance_m

    def calls(self, scene: SceneView, index: int) -> Mapping[EffectName, str]:
        return {
            **super().calls(scene, index),
            EffectName.STRINGS: f"phase {index} pulls at {1e3 * self.speed_m_per_s:.3g} mm/s, tied at the "
            f"{self.tied_at}, {self.string_stiffness_N_per_m:g} N/m each",
        }

    def proceed(self, stage: Stage, engine: Engine) -> float:
        chain, update = chain_of(stage.scene), stage.memory["look"]
        every = max(1, round(CHECK_INTERVAL / stage.scene.fidelity.control_interval_s))
        if update == 0:
            engine.motors.articulate()
            law = StringLaw(
                length=self.string_length_m,
                stiffness=self.string_stiffness_N_per_m,
                damping=self.string_damping_N_s_per_m,
            )
            engine.strings.tie(chain.ties(self.tied_at), law, (0.0, self.speed_m_per_s))
        broken = update % every == 0 and parted(engine.state().smarticles, 2 * chain.particle.radius)
        wait = 0.0 if broken else self.follow(stage, engine, every)
        if not wait:
            engine.strings.untie()
        return wait
