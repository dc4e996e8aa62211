"""One smarticle: three rigid boxes, and the sphere chains that represent them in contacts.

Mass, centre of mass and inertia are exactly those of the boxes. Spheres serve contacts only; their number, distance and
diameter are a choice of accuracy against cost (`Fidelity`).

Body frame: origin at the centre of mass, axes along the principal axes of inertia, z along the normal of the plane.
For the symmetric U (both angles 90°) x runs along the middle link and y from the middle link to the mouth.

A middle link may be thicker in the plane than the barbs, like the body of a robot: its spheres then lie in several rows
in the plane, and the barbs begin outside of them.
"""

import math
from dataclasses import dataclass
from functools import cached_property, lru_cache
from itertools import product

import numpy as np

from dem.arrays import Array, Numbers
from dem.body.linear import eigen_symmetric, matrix_product
from dem.errors import InputError

LINKS = 3
# Free distance between the sphere at a hinge and the first sphere of the barb, in diameters: links of one smarticle
# touch only when a loaded hinge gives way by more.
HINGE_CLEARANCE = 0.01
# Angle beyond 90° up to which barbs turn inwards without touching a thicker middle link [rad].
INWARDS = math.radians(15)

# Places and weights of the 24-point Gauss-Legendre rule on (-1, 1), without their mirror images. As constants, since
# libraries compute them by LAPACK, with bits that depend on the processor.
GAUSS = (
    (0.06405689286260563, 0.12793819534675202), (0.1911188674736163, 0.12583745634682825),
    (0.3150426796961634, 0.1216704729278033), (0.4337935076260451, 0.11550566805372552),
    (0.5454214713888396, 0.10744427011596556), (0.6480936519369755, 0.09761865210411393),
    (0.7401241915785544, 0.0861901615319532), (0.820001985973903, 0.07334648141108016),
    (0.8864155270044011, 0.05929858491543636), (0.9382745520027328, 0.04427743881741941),
    (0.9747285559713095, 0.02853138862893356), (0.9951872199970213, 0.01234122979998869),
)  # fmt: skip


def mean_width(thickness_normal: float, thickness_in_plane: float) -> float:
    """Return the caliper width [m] of a rectangular section, averaged over directions: perimeter/π.

    The density of a loose packing of thin bars follows from their excluded volume. For two long bars at random
    orientations this volume is proportional to the distance between the axes of touching bars. The mean of that
    distance is the mean width of the section.

    Source: Cauchy's formula for convex sections; Onsager's excluded volume of long rods.
    """
    return 2.0 * (thickness_normal + thickness_in_plane) / math.pi


@lru_cache
def chain_mean_width(pitch: float) -> float:
    """Return the mean distance between the axes of two touching sphere chains, in sphere diameters [1].

    Two smooth bars of this width have the excluded volume of two long chains. The distance is below 1, since spheres of
    one chain sit partly in the gaps of the other. Two chains that cross at an angle γ touch at the two spheres that are
    nearest to each other in a view along the common normal. If these spheres are r diameters apart in this view, the
    axes are √(1 - r²) diameters apart. The mean is taken over the positions of both chains along their axes (uniform
    over a period) and over isotropic directions (density sin γ), weighted by sin γ, the area of the parallelogram in
    the excluded volume. The pitch is the distance of neighbouring spheres over their diameter [1], below √2, from which
    on chains pass through each other.
    """
    half = np.array(GAUSS).T
    nodes, weights = np.concatenate([half[:, ::-1] * [[-1.0], [1.0]], half], axis=1)
    angles = math.pi / 4 * (nodes + 1)
    angle_weights = weights * np.array([math.sin(angle) ** 2 for angle in angles])
    phases = pitch * nodes / 2
    spheres = pitch * np.arange(-3, 4)
    along = (phases[:, None] + spheres).reshape(24, 1, 7, 1)
    across = (phases[:, None] + spheres).reshape(1, 24, 1, 7)
    total = 0.0
    for angle, weight in zip(angles, angle_weights / angle_weights.sum(), strict=True):
        squared = along**2 + across**2 - 2 * along * across * math.cos(angle)
        nearest = np.minimum(squared.min(axis=(2, 3)), 1.0)
        rows = (weights[:, None] * np.sqrt(1 - nearest)).T * weights[:, None]
        total += weight * math.fsum(map(math.fsum, rows)) / 4
    return total


@dataclass(frozen=True, kw_only=True)
class Boxes:
    """Exact geometry of a smarticle. Lengths in m, angles in rad, density in kg/m³.

    `angles` are (α1, α2): 0 is straight, π/2 the U. If `middle_thickness_in_plane` is None, the middle link is as thick
    as the barbs.
    """

    middle_length: float
    barb_length: float
    thickness_normal: float
    thickness_in_plane: float
    density: float
    angles: tuple[float, float] = (math.pi / 2, math.pi / 2)
    middle_thickness_in_plane: float | None = None

    @property
    def thicknesses_in_plane(self) -> tuple[float, float, float]:
        """Thicknesses t2 of barb 1, middle link and barb 2 in the smarticle's plane [m]."""
        barb, middle = self.thickness_in_plane, self.middle_thickness_in_plane
        return (barb, barb if middle is None else middle, barb)

    @property
    def bulge(self) -> float:
        """Half the difference of the thicknesses in the plane, middle link less barbs [m]."""
        return (self.thicknesses_in_plane[1] - self.thickness_in_plane) / 2

    @property
    def _weights(self) -> Array:
        """(3,) [m]: lengths of the links, each times its thickness in the plane over that of the barbs.

        Volumes and masses of the links are in proportion to these lengths.
        """
        return self.lengths * (np.array(self.thicknesses_in_plane) / self.thickness_in_plane)

    @property
    def lengths(self) -> Array:
        """(3,) float64 [m]: lengths of barb 1, middle link and barb 2."""
        return np.array([self.barb_length, self.middle_length, self.barb_length])

    @property
    def volume(self) -> float:
        """Solid volume t1 t2 (w + 2l) [m³], each link with its own t2.

        Where the boxes of two links overlap at a hinge, the volume counts twice, as in the paper.
        """
        return float(self.thickness_normal * self.thickness_in_plane * self._weights.sum())

    @property
    def mass(self) -> float:
        """Mass of the smarticle [kg]."""
        return self.density * self.volume

    @cached_property
    def directions(self) -> Array:
        """(3, 3) float64: unit vectors along barb 1, middle link and barb 2, in the middle link's frame.

        Barbs point from hinge to tip, the middle link points from hinge 1 to hinge 2.
        """
        a1, a2 = self.angles
        barbs = [-math.cos(a1), math.sin(a1), 0.0], [math.cos(a2), math.sin(a2), 0.0]
        return np.array([barbs[0], [1.0, 0.0, 0.0], barbs[1]])

    @cached_property
    def _plain_vertices(self) -> Array:
        """(4, 3) [m]: tip, hinge, hinge, tip with the middle link's centre as origin, x along the middle link."""
        half = self.middle_length / 2
        hinges = np.array([[-half, 0.0, 0.0], [half, 0.0, 0.0]])
        tips = hinges + self.barb_length * self.directions[[0, 2]]
        return np.array([tips[0], hinges[0], hinges[1], tips[1]])

    @cached_property
    def _plain_centres(self) -> Array:
        """(3, 3) [m]: link centres in the middle link's frame."""
        v = self._plain_vertices
        return (v[:3] + v[1:]) / 2

    @cached_property
    def plain_centre_of_mass(self) -> Array:
        """(3,) [m]: centre of mass in the middle link's frame."""
        return np.average(self._plain_centres, axis=0, weights=self._weights)

    @cached_property
    def _principal(self) -> tuple[Array, Array]:
        """Principal moments (3,) [kg m²], and body axes in the middle link's frame, as columns (3, 3)."""
        tensor = np.zeros((3, 3))
        for length, in_plane, direction, centre in zip(
            self.lengths, self.thicknesses_in_plane, self.directions, self._plain_centres, strict=True
        ):
            mass = self.density * length * self.thickness_normal * in_plane
            u, n = direction, np.array([0.0, 0.0, 1.0])
            v = np.cross(n, u)
            # Second moments of the box about its centre, along its own axes: length, in-plane, normal.
            second = mass / 12 * np.array([length**2, in_plane**2, self.thickness_normal**2])
            axes = np.stack([u, v, n], axis=1)
            arm = centre - self.plain_centre_of_mass
            moment = matrix_product(axes * second, axes.T) + mass * np.outer(arm, arm)
            tensor += np.trace(moment) * np.eye(3) - moment
        # z is a principal axis by symmetry, so only the in-plane block is turned: the smallest rotation that
        # diagonalises it keeps x along the middle link for every symmetric shape.
        angle = 0.5 * math.atan2(2 * tensor[0, 1], tensor[0, 0] - tensor[1, 1]) if tensor[0, 1] else 0.0
        if tensor[0, 1] and tensor[0, 0] < tensor[1, 1]:
            angle -= math.copysign(math.pi / 2, angle)
        c, s = math.cos(angle), math.sin(angle)
        rotation = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        return np.diag(matrix_product(matrix_product(rotation.T, tensor), rotation)).copy(), rotation

    @property
    def link_masses(self) -> Array:
        """(3,) float64 [kg]: masses of barb 1, middle link and barb 2."""
        return self.density * self.thickness_normal * np.array(self.thicknesses_in_plane) * self.lengths

    @property
    def link_inertias(self) -> Array:
        """(3, 3) float64 [kg m²]: principal moments of the links about their centres, along their own axes."""
        t1, length = self.thickness_normal, self.lengths
        t2_squared = np.array([t2**2 for t2 in self.thicknesses_in_plane])
        squares = np.stack([t1**2 + t2_squared, length**2 + t1**2, length**2 + t2_squared], axis=1)
        return np.asarray(self.link_masses[:, None] * squares / 12)

    @cached_property
    def link_centres(self) -> Array:
        """(3, 3) float64 [m]: centres of barb 1, middle link and barb 2 in the body frame."""
        return self.to_body(self._plain_centres)

    @cached_property
    def link_rotations(self) -> Array:
        """(3, 3, 3) float64 [1]: rotations from the links' frames to the body frame.

        Columns are the axes of a link: along the link as in `directions`, across it in the smarticle's plane, and along
        the plane's normal.
        """
        normal = np.array([0.0, 0.0, 1.0])
        frames = [np.stack([u, np.cross(normal, u), normal], axis=1) for u in self.directions]
        return matrix_product(self._principal[1].T, np.array(frames))

    @property
    def inertia(self) -> Array:
        """(3,) float64 [kg m²]: principal moments about the centre of mass, along the body axes."""
        return self._principal[0]

    def to_body(self, points: Array) -> Array:
        """Transform points (n, 3) [m] from the middle link's frame to the body frame."""
        return matrix_product(points - self.plain_centre_of_mass, self._principal[1])

    @cached_property
    def vertices(self) -> Array:
        """(4, 3) float64 [m]: barb tip, hinge, hinge, barb tip in the body frame."""
        return self.to_body(self._plain_vertices)


@dataclass(frozen=True, kw_only=True)
class SphereChain:
    """Arrangement of spheres along the links."""

    rows: int  #: Rows of spheres side by side across t1, the thickness along the normal
    diameter: float  #: Sphere diameter [m]
    pitch: float  #: Largest distance between neighbouring centres along a link [m]


@dataclass(frozen=True)
class Particle:
    """A smarticle as engines compute it: its boxes, and the spheres that represent them in contacts.

    InputError if the spheres are larger than half the middle link's length.
    """

    boxes: Boxes
    chain: SphereChain

    def __post_init__(self) -> None:
        d, w = self.chain.diameter, self.boxes.middle_length
        if d > w / 2:
            raise InputError(
                f"fidelity.diameter_m: spheres of {d:g} m do not fit a middle link of {w:g} m; "
                f"use at most half its length, {w / 2:g} m"
            )

    @property
    def filament(self) -> None:
        """None: links are rigid."""

    @property
    def linkage(self) -> None:
        """None: hinges are those of barbs."""

    @cached_property
    def offsets(self) -> Array:
        """(rows,) offsets of the rows of spheres, or strands, along the normal [m]; the outermost reach to ±t1/2."""
        if self.chain.rows == 1:
            return np.zeros(1)
        reach = (self.boxes.thickness_normal - self.chain.diameter) / 2
        return np.linspace(-reach, reach, self.chain.rows)

    @cached_property
    def _sides(self) -> Array:
        """(sides,) [m]: offsets of the rows of spheres from the middle link's axis, in the smarticle's plane.

        Rows are at most a diameter apart. The outermost offsets are ±`Boxes.bulge`.
        """
        bulge = self.boxes.bulge
        if not bulge:
            return np.zeros(1)
        return np.linspace(-bulge, bulge, 2 * math.ceil(bulge / self.chain.diameter) + 1)

    @property
    def barb_start(self) -> float:
        """Distance from the hinge to the centre of a barb's first sphere [m].

        It leaves a gap of at least `HINGE_CLEARANCE` diameters between the surfaces of this sphere and of the sphere at
        the hinge. If the middle link is thicker than the barbs, the gap is that to the outermost row of spheres of the
        middle link, at barb angles of 90° to 90° + `INWARDS`.
        """
        start = self.chain.diameter * (1 + HINGE_CLEARANCE)
        return (self.boxes.bulge + start) / math.cos(INWARDS) if self.boxes.bulge else start

    def _stations(self, link: int) -> Array:
        """Return (n,) distances [m] of a link's sphere centres from its start: a barb's hinge, or hinge 1."""
        d, pitch = self.chain.diameter, self.chain.pitch
        if link == 1:
            # The spheres at the hinges belong to the middle link and are centred on the hinge axes. A bar without
            # barbs has free ends, where the sphere's surface, not its centre, marks the end.
            inset = 0.0 if self.boxes.barb_length > 0 else d / 2
            start, end = inset, self.boxes.middle_length - inset
        else:
            # The last sphere's surface is the tip.
            start, end = self.barb_start, self.boxes.barb_length - d / 2
            if end <= 0:
                return np.empty(0)
            if end <= start:
                return np.array([end])
        count = max(2, math.ceil((end - start) / pitch - 1e-9) + 1)
        return np.linspace(start, end, count)

    @cached_property
    def _layout(self) -> tuple[Array, Numbers]:
        vertices = self.boxes._plain_vertices
        starts = vertices[[1, 1, 2]]
        centres: list[Array] = []
        links: list[int] = []
        for link in range(LINKS):
            # Across the middle link is y.
            sides = self._sides if link == 1 else np.zeros(1)
            for station, side, offset in product(self._stations(link), sides, self.offsets):
                centre = starts[link] + station * self.boxes.directions[link]
                centres.append(centre + np.array([0.0, side, offset]))
                links.append(link)
        return self.boxes.to_body(np.array(centres)), np.array(links, dtype=np.int64)

    @property
    def centres(self) -> Array:
        return self._layout[0]

    @property
    def outline(self) -> Array:
        return self.centres

    @property
    def outline_links(self) -> Numbers:
        return self.links

    @property
    def links(self) -> Numbers:
        """(S,) int64: link of each sphere; 0 barb 1, 1 middle link, 2 barb 2."""
        return self._layout[1]

    @cached_property
    def local_centres(self) -> Array:
        """(S, 3) float64 [m]: sphere centres, each in the frame of its link (see `Boxes.link_rotations`)."""
        arms = self.centres - self.boxes.link_centres[self.links]
        return np.asarray(np.einsum("sij,si->sj", self.boxes.link_rotations[self.links], arms))

    @property
    def radius(self) -> float:
        return self.chain.diameter / 2

    @property
    def spread(self) -> float:
        """Distance of the outermost rows of spheres from a link's axis, along the normal [m]."""
        return float(self.offsets[-1])

    @property
    def breadth(self) -> float:
        return 2 * max(self.spread, self.boxes.bulge) + self.diameter

    @property
    def reach(self) -> float:
        spheres = float(np.linalg.norm(self.centres, axis=1).max()) + self.radius
        half = math.hypot(self.boxes.thickness_normal, max(self.boxes.thicknesses_in_plane)) / 2
        return max(spheres, float(np.linalg.norm(self.boxes.vertices, axis=1).max()) + half)

    @cached_property
    def smallest_effective_mass(self) -> float:
        """Smallest effective mass of the smarticle over all spheres' centres and all directions [kg]."""
        return smallest_effective_mass(self.boxes.mass, self.boxes.inertia, self.centres)

    @property
    def mass(self) -> float:
        return self.boxes.mass

    @property
    def inertia(self) -> Array:
        return self.boxes.inertia

    @property
    def volume(self) -> float:
        return self.boxes.volume

    @property
    def size(self) -> float:
        return self.boxes.middle_length

    @property
    def thicknesses(self) -> tuple[float, float]:
        return self.boxes.thickness_normal, self.boxes.thickness_in_plane

    @property
    def diameter(self) -> float:
        """Sphere diameter [m]."""
        return self.chain.diameter


def smallest_effective_mass(mass: float, inertia: Array, centres: Array) -> float:
    """Return the smallest effective mass [kg] of a rigid body over several points and all directions.

    A force F in the direction n at a point r from the centre of mass accelerates that point along n by
    (1/m + (r × n)·I⁻¹(r × n)) F. The effective mass is the inverse of the largest eigenvalue of this mobility. It
    limits the stable time step: at barb tips it is several times smaller than the mass.
    Arguments are the mass [kg], principal moments (3,) [kg m²], and points (n, 3) along the principal axes [m].
    """
    inverse, (x, y, z) = 1.0 / inertia, centres.T
    # A push on a sphere acts at its surface, but the normal passes through the centre.
    cross = np.zeros((len(x), 3, 3))
    cross[:, 0, 1], cross[:, 0, 2] = -z, y
    cross[:, 1, 0], cross[:, 1, 2] = z, -x
    cross[:, 2, 0], cross[:, 2, 1] = -y, x
    tensors = np.eye(3) / mass + matrix_product(cross.transpose(0, 2, 1), inverse[:, None] * cross)
    mobility = float(eigen_symmetric(tensors)[0].max())
    return 1.0 / mobility
