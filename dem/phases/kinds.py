"""All kinds of phases; a new kind is added here."""

from typing import Annotated, get_args

from pydantic import Field

from dem.phases.actuate import Actuate, InternalOscillation, ShapeChange
from dem.phases.arrange import Arrange
from dem.phases.compress import Compress
from dem.phases.deposit import Deposit
from dem.phases.lift import Lift, Release
from dem.phases.place import Place
from dem.phases.pull_hook import PullHook
from dem.phases.relax import Relax
from dem.phases.remove_container import RemoveContainer
from dem.phases.shake import Shake
from dem.phases.strain import Strain
from dem.phases.take_over import TakeOver
from dem.phases.tension import Tension
from dem.phases.undulate import Undulate
from dem.phases.wriggle import Wriggle

AnyPhase = Annotated[
    Deposit
    | Place
    | TakeOver
    | Relax
    | Shake
    | Actuate
    | ShapeChange
    | InternalOscillation
    | RemoveContainer
    | PullHook
    | Arrange
    | Strain
    | Wriggle
    | Undulate
    | Lift
    | Release
    | Compress
    | Tension,
    Field(discriminator="type"),
]
KINDS = get_args(get_args(AnyPhase)[0])
