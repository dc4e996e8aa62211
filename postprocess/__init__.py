"""Read run directories and compute measures, tables, figures and pictures of them.

Readers take a run directory (see docs/reference/files.md). Measures are functions of NumPy arrays and return frozen
results. Lengths are in metres, times in seconds. Vertices are an array (N, 4, 3) [m] with barb tip, hinge, hinge and
barb tip of each smarticle; measures reject other shapes with `InputError`. The functions `heights`, `entanglement` and
`linking` are imported from their modules `postprocess.measures.heights`, `.entanglement` and `.linking`.

Measures of bodies of any shape take `segments` (M, 2, 3) [m], the ends of all straight parts, and `body` (M,), the
number of the body of each; `segments_of` returns both for a frame, `read_centrelines` for a file.
"""

from dem.record.forces import RecordedForces, read_forces
from dem.record.frame import Frame, read_frame
from dem.record.frames import FrameSequence, read_frames
from dem.record.kinematics import RecordedPoses
from dem.record.run import Run, open_run
from dem.record.series import Series, read_series
from postprocess.geometry.centrelines import Centrelines, read_centrelines
from postprocess.geometry.links import UndefinedMeasureError, centres_of_mass
from postprocess.geometry.segments import Segments, extents, segments_of
from postprocess.measures.caging import Cages, cages, caging_number
from postprocess.measures.closed_linking import ClosedLinking, closed_linking, writhe, writhes
from postprocess.measures.clusters import Clusters, spans
from postprocess.measures.contacts import ContactPairs, contact_pairs, pairs_in_contact
from postprocess.measures.crossing_number import (
    CrossingNumbers,
    average_crossing_numbers,
    crossing_field,
    grid_points,
    region_spans,
)
from postprocess.measures.displacement import MeanSquaredDisplacement, mean_squared_displacement
from postprocess.measures.entanglement import (
    CrossingPairs,
    PolygonCrossings,
    crossing_pairs,
    has_plane,
    link_crossings,
    polygon_crossings,
)
from postprocess.measures.force_chains import (
    ForceDistribution,
    force_chains,
    force_distribution,
    force_participation,
    strong_contacts,
)
from postprocess.measures.graph import EntanglementGraph, LinkLifetimes, entanglement_graph, link_lifetimes
from postprocess.measures.heights import material_height
from postprocess.measures.layers import HeightProfile, height_profile
from postprocess.measures.linking import gauss_integral
from postprocess.measures.nematic import (
    NematicOrder,
    PolarOrder,
    body_axes,
    nematic_order,
    opening_directions,
    polar_order,
    segment_order,
)
from postprocess.measures.packing import DEFINITIONS, PackingFraction, packing_fraction
from postprocess.measures.pairs import (
    OrientationCorrelation,
    RadialDistribution,
    orientation_correlation,
    radial_distribution,
)
from postprocess.measures.profile import PackingProfile, packing_profile, profile_table
from postprocess.measures.table import measure_run, summarise_run
from postprocess.report.tables import write_table
from postprocess.statistics.seeds import Mean, mean_with_error

__all__ = [
    "DEFINITIONS",
    "Cages",
    "Centrelines",
    "ClosedLinking",
    "Clusters",
    "ContactPairs",
    "CrossingNumbers",
    "CrossingPairs",
    "EntanglementGraph",
    "ForceDistribution",
    "Frame",
    "FrameSequence",
    "HeightProfile",
    "LinkLifetimes",
    "Mean",
    "MeanSquaredDisplacement",
    "NematicOrder",
    "OrientationCorrelation",
    "PackingFraction",
    "PackingProfile",
    "PolarOrder",
    "PolygonCrossings",
    "RadialDistribution",
    "RecordedForces",
    "RecordedPoses",
    "Run",
    "Segments",
    "Series",
    "UndefinedMeasureError",
    "average_crossing_numbers",
    "body_axes",
    "cages",
    "caging_number",
    "centres_of_mass",
    "closed_linking",
    "contact_pairs",
    "crossing_field",
    "crossing_pairs",
    "entanglement_graph",
    "extents",
    "force_chains",
    "force_distribution",
    "force_participation",
    "gauss_integral",
    "grid_points",
    "has_plane",
    "height_profile",
    "link_crossings",
    "link_lifetimes",
    "material_height",
    "mean_squared_displacement",
    "mean_with_error",
    "measure_run",
    "nematic_order",
    "open_run",
    "opening_directions",
    "orientation_correlation",
    "packing_fraction",
    "packing_profile",
    "pairs_in_contact",
    "polar_order",
    "polygon_crossings",
    "profile_table",
    "radial_distribution",
    "read_centrelines",
    "read_forces",
    "read_frame",
    "read_frames",
    "read_series",
    "region_spans",
    "segment_order",
    "segments_of",
    "spans",
    "strong_contacts",
    "summarise_run",
    "write_table",
    "writhe",
    "writhes",
]
