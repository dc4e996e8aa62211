"""Read run directories and compute measures, tables, figures and pictures of them.

Readers take a run directory (see docs/reference/files.md). Measures are functions of NumPy arrays and return frozen
results. Lengths are in metres, times in seconds. Vertices are an array (N, 4, 3) [m] with barb tip, hinge, hinge and
barb tip of each smarticle; measures reject other shapes with `InputError`. The functions `heights`, `entanglement` and
`linking` are imported from their modules `postprocess.measures.heights`, `.entanglement` and `.linking`.
"""

from dem.record.forces import RecordedForces, read_forces
from dem.record.frame import Frame, read_frame
from dem.record.frames import FrameSequence, read_frames
from dem.record.run import Run, open_run
from dem.record.series import Series, read_series
from postprocess.geometry.links import UndefinedMeasureError, centres_of_mass
from postprocess.measures.contacts import ContactPairs, contact_pairs, pairs_in_contact
from postprocess.measures.entanglement import CrossingPairs, crossing_pairs, has_plane, link_crossings
from postprocess.measures.force_chains import force_chains, force_participation, strong_contacts
from postprocess.measures.heights import material_height
from postprocess.measures.linking import gauss_integral
from postprocess.measures.nematic import NematicOrder, nematic_order
from postprocess.measures.packing import DEFINITIONS, PackingFraction, packing_fraction
from postprocess.measures.profile import PackingProfile, packing_profile, profile_table
from postprocess.measures.table import PackingChange, measure_run, packing_change, summarise_run
from postprocess.report.tables import write_table
from postprocess.statistics.seeds import Mean, mean_with_error

__all__ = [
    "DEFINITIONS",
    "ContactPairs",
    "CrossingPairs",
    "Frame",
    "FrameSequence",
    "Mean",
    "NematicOrder",
    "PackingChange",
    "PackingFraction",
    "PackingProfile",
    "RecordedForces",
    "Run",
    "Series",
    "UndefinedMeasureError",
    "centres_of_mass",
    "contact_pairs",
    "crossing_pairs",
    "force_chains",
    "force_participation",
    "gauss_integral",
    "has_plane",
    "link_crossings",
    "material_height",
    "mean_with_error",
    "measure_run",
    "nematic_order",
    "open_run",
    "packing_change",
    "packing_fraction",
    "packing_profile",
    "pairs_in_contact",
    "profile_table",
    "read_forces",
    "read_frame",
    "read_frames",
    "read_series",
    "strong_contacts",
    "summarise_run",
    "write_table",
]
