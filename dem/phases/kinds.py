"""The kinds of phases that there are: the one place where a new one is entered."""

from __future__ import annotations

from typing import Annotated, get_args

from pydantic import Field

from dem.phases.actuate import Actuate
from dem.phases.arrange import Arrange
from dem.phases.deposit import Deposit
from dem.phases.internal_oscillation import InternalOscillation
from dem.phases.pull_hook import PullHook
from dem.phases.relax import Relax
from dem.phases.remove_container import RemoveContainer
from dem.phases.shake import Shake
from dem.phases.shape_change import ShapeChange
from dem.phases.strain import Strain
from dem.phases.take_over import TakeOver

AnyPhase = Annotated[
    Deposit
    | TakeOver
    | Relax
    | Shake
    | Actuate
    | ShapeChange
    | InternalOscillation
    | RemoveContainer
    | PullHook
    | Arrange
    | Strain,
    Field(discriminator="type"),
]
KINDS = get_args(get_args(AnyPhase)[0])
