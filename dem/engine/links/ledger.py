"""Energy ledger of the engine links, from sums that kernels add up in every step."""

from collections.abc import Callable

from dem.body.filament import FilamentEnergies
from dem.engine.interface import Filaments
from dem.engine.links.stepping import LOST, WORK
from dem.engine.links.world import World

NONE = FilamentEnergies(*(0.0,) * len(FilamentEnergies._fields))  #: Energies of a pile without filaments


class LinksLedger:
    """`dem.engine.interface.EnergyLedger` on links."""

    def __init__(self, world: World, filaments: Filaments | None) -> None:
        self._world = world
        self._filaments = filaments
        self.added = 0.0

    @property
    def _energies(self) -> FilamentEnergies:
        return NONE if self._filaments is None else self._filaments.energies

    @property
    def container_work(self) -> float:
        return float(self._world.totals[WORK]) + self._energies.gripped

    @property
    def dissipated(self) -> float:
        """Energy dissipated since the start [J]: by welding, by stopping and by drag.

        If dissipation is recorded, that of contacts and of internal damping of filaments is added.
        """
        energies = self._energies
        return float(self._world.totals[LOST]) + energies.damped + energies.dragged

    @property
    def given(self) -> float:
        return self.added + self.container_work + self._energies.active

    @property
    def deformation(self) -> float:
        """Elastic energy of filaments, or of the joints of linkages [J]; 0 without either."""
        return self._energies.elastic

    def elastic(self) -> tuple[float, float]:
        """Return the elastic energy of all contacts, and that of filaments or of the joints of linkages [J]."""
        return self._world.contacts().elastic_energy, self.deformation

    def take_in(self) -> None:
        self._world.list_near()
        self.added += self.elastic()[0]

    def removed(self, remove: Callable[[], None]) -> None:
        """Call `remove`, a function that removes contacts, and count their elastic energy as dissipated.

        The energy is not counted if dissipation is not recorded.
        """
        counted = self._world.ledger is not None
        stored = self.elastic()[0] if counted else 0.0
        remove()
        if counted:
            self._world.totals[LOST] += stored - self.elastic()[0]
