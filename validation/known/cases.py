"""All known answers and ladders, in the order in which they are told."""

from __future__ import annotations

from functools import partial

from validation.case import Case, Ladder
from validation.engines import ENGINES
from validation.known import bouncing, clumps, floor, free, hinge, impact, kept, oblique, stacks

DASHPOT = "Schwager and Pöschel, Granular Matter 9, 465 (2007)"
OBLIQUE = "impulse theory with Coulomb friction, as in MFiX DEM-05 and Chung and Ooi (2011), tests 5 to 8"
RIGID = "rigid-body impulse theory: 1/m_eff = 1/m + (r × n)·I⁻¹(r × n), impulse (1 + e) m_eff v"

YADES_TURNS = {"yade": "its turns are of first order: ladder `spin`"}
LAWS = (("halt", 0.0), ("stall", 0.0), ("ease", 0.0), ("slip", 0.0), ("servo", 2e-6))

CASES = (
    Case(
        name="free fall",
        about="a tilted smarticle thrown upwards",
        theory="z = v₀t − gt²/2; leapfrog is exact",
        run=free.free_fall,
    ),
    Case(
        name="torque-free spin",
        about="a U about no axis in particular; its three moments differ",
        theory="Euler's equations, integrated to 1e-12",
        run=free.torque_free_spin,
    ),
    Case(
        name="middle axis",
        about="a U about the axis of its middle moment flips over and over",
        theory="Euler's equations, integrated to 1e-12",
        run=free.flips,
    ),
    Case(
        name="elastic rebound",
        about="a ball on the floor",
        theory="half a period of a mass on a spring: π√(m/k), v√(m/k), v",
        run=impact.elastic_rebound,
    ),
    *(
        Case(
            name=f"damped rebound, e = {restitution:g}",
            about="a ball on the floor, its dashpot sized for it",
            theory=f"spring and dashpot that never pull; {DASHPOT}, integrated",
            run=partial(impact.damped_rebound, restitution=restitution),
        )
        for restitution in (0.2, 0.5, 0.9)
    ),
    Case(
        name="two balls",
        about="head on, in free space, e = 0.5",
        theory="the same at the reduced mass; momentum",
        run=partial(impact.pair_rebound, restitution=0.5),
    ),
    Case(
        name="bar on its end",
        about="a bar falls on its end, with the law of a scene that asks for e = 0.5 at the typical mass",
        theory=f"spring and dashpot at the bar's mass; {DASHPOT}, integrated",
        run=partial(impact.bar_rebound, restitution=0.5),
    ),
    Case(
        name="bars end to end",
        about="the same, two bars in free space",
        theory=f"the same at the reduced mass; {DASHPOT}, integrated",
        run=partial(impact.bars_rebound, restitution=0.5),
    ),
    Case(
        name="oblique, sliding, elastic",
        about="a ball at 82° from the normal, μ = 0.4",
        theory=f"tangential impulse μ(1 + e)mv; {OBLIQUE}",
        run=partial(oblique.sliding_impact, restitution=1.0, dashpot=0.9),
    ),
    Case(
        name="oblique, sliding, e = 0.7",
        about="the same, without a tangential dashpot",
        theory=f"tangential impulse μ(1 + e)mv; {OBLIQUE}",
        run=partial(oblique.sliding_impact, restitution=0.7, dashpot=0.0),
    ),
    *(
        Case(
            name=f"oblique, sliding, e = {restitution:g}, dashpot of a scene",
            about="the same, with cs/cn = 0.9: the dashpot acts without limit until the spring has reached Coulomb's",
            theory=f"μ(1 + e)mv + (cs s − μ cn v/2) μ cn v/(ks s − μ kn v); {OBLIQUE}, and YADE's law",
            run=partial(oblique.sliding_impact, restitution=restitution, dashpot=0.9),
        )
        for restitution in (0.7, 0.3)
    ),
    Case(
        name="oblique, sliding, e = 0.7, dashpot and step of a scene",
        about="the same with 22 steps in a contact, as in a scene: longer than the dashpot acts",
        theory=f"tangential impulse μ(1 + e)mv; {OBLIQUE}",
        run=partial(oblique.sliding_impact, restitution=0.7, dashpot=0.9, steps=22),
    ),
    Case(
        name="oblique, sticking",
        about="a ball at 45°, ks = 2/7 kn: its slip is turned around",
        theory="a mass 2/7 m on the tangential spring for half a period; Chung and Ooi (2011)",
        run=oblique.sticking_impact,
    ),
    *(
        Case(
            name=f"smarticle on {place}, e = {restitution:g}",
            about="a welded U meets a smooth floor with one sphere",
            theory=RIGID,
            run=partial(impact.tip_impact, restitution=restitution, turn=turn),
        )
        for place, turn, restitution in (
            ("a barb's tip", (0.5, 0.3, 0.1), 1.0),
            ("a barb's tip", (0.5, 0.3, 0.1), 0.7),
            ("a corner", (-1.2, 0.4, 0.0), 0.7),
        )
    ),
    Case(
        name="sliding to rolling, ball",
        about="a ball thrown along the floor",
        theory="v₀/(1 + I/mr²), 5/7 v₀ for a solid one, after that much slip over μg; MFiX DEM-04",
        run=floor.ball_rolls,
    ),
    Case(
        name="sliding to rolling, bar",
        about="a bar of spheres thrown across itself, with its box's inertia",
        theory="v₀/(1 + I/mr²)",
        run=floor.bar_rolls,
    ),
    Case(
        name="sliding to a stop",
        about="a U lying flat is pushed along its axis of symmetry",
        theory="Coulomb: μg, v²/2μg",
        run=partial(floor.slide, aspect_ratio=0.7, friction=0.4),
    ),
    Case(
        name="two balls stacked",
        about="come to rest on the floor; MFiX DEM-03",
        theory="overlaps 2mg/k and mg/k",
        run=floor.stack_at_rest,
    ),
    Case(
        name="crossed bars stacked",
        about="five pairs of bars, each pair across the one below, come to rest",
        theory="statics and symmetry: a contact bears a quarter of the weight above it",
        run=stacks.crossed_bars,
    ),
    Case(
        name="flat smarticles stacked",
        about="four smarticles, link on link, come to rest",
        theory="statics: contacts bear the weight above them",
        run=stacks.flat_smarticles,
    ),
    *(
        Case(
            name=f"flat impact, {told}",
            about="a smarticle meets the floor with a whole row of spheres",
            theory="n springs and dashpots side by side, that never pull; integrated with the tilt",
            run=partial(clumps.flat_checks, rows=rows, pitch=pitch),
        )
        for told, rows, pitch in (("spheres of draft", 1, 1.3), ("spheres of reference", 2, 1.0))
    ),
    Case(
        name="hinge pulled",
        about="a straight smarticle is pulled at both ends by a hundred weights",
        theory="gap F/k of the pin",
        run=partial(hinge.pull, aspect_ratio=0.7, fidelity="standard", largest=0.01),
        absent={"links": "hinges have no pins that give way: links are one body with two angles"},
    ),
    Case(
        name="barb hanging on its motor",
        about="a straight smarticle, its middle link held, under gravity",
        theory="torque M = mgl/2, sag M/k, gap mg/k",
        run=partial(hinge.droop, aspect_ratio=0.7, fidelity="standard"),
    ),
    Case(
        name="barb hanging out of plane",
        about="the same lying, after the barbs have turned through 105°",
        theory="tilt M/k of the shaft",
        run=partial(hinge.tilt, sweeps=1),
        absent={"links": "shafts do not tilt: both barbs stay in the plane of the middle link"},
    ),
    Case(
        name="pendulum",
        about="barbs hang from a held middle link, let go at 6°",
        theory="2π√(I/mga)(1 + θ²/16)",
        run=partial(hinge.pendulum, aspect_ratio=0.7),
    ),
    *(
        Case(
            name=f"barbs on their shafts, middle link {'held' if held else 'free'}",
            about="a U in space, barbs turning the same way",
            theory="eigenfrequency of links, shafts and pins; √(k/I) but for the pins",
            run=partial(hinge.shaft_vibration, held=held),
        )
        for held in (True, False)
    ),
    *(
        Case(
            name=f"free gait, {law}",
            about="two smarticles in space swing their barbs, spinning",
            theory="nothing acts from outside: momentum and angular momentum about the centre of mass",
            run=partial(kept.free_gait, law=law, damping=damping),
            absent=YADES_TURNS,
        )
        for law, damping in LAWS
    ),
    *(
        Case(
            name=f"work on a free pair, {law}",
            about="the same",
            theory="work of the motors is gain of kinetic energy",
            run=partial(kept.pair_work, law=law, damping=damping),
            absent=YADES_TURNS,
        )
        for law, damping in LAWS
        if law != "stall"
    ),
    Case(
        name="thousand turns",
        about="smarticles spin freely at 60 rad/s, at the step of a scene",
        theory="energy and angular momentum",
        run=kept.thousand_turns,
        absent=YADES_TURNS,
    ),
    Case(
        name="account of a pile",
        about="100 smarticles swing their barbs in a pile, standard",
        theory="added energy and work are what is stored and what was dissipated",
        run=partial(kept.account, count=100, seconds=0.5),
        absent={"yade": "dissipation is sampled there, not added up: tests/engine has its error"},
    ),
    *(
        Case(
            name=f"10 m/s and 60 rad/s, contacts of {stiffness:g} N/m",
            about="smarticles thrown at others" + (", which so soft contacts cannot hold" if crosses else ""),
            theory="links are solid, or the watchdog says that they were not",
            run=partial(kept.thrown_at, stiffness=stiffness, throws=30, crosses=crosses),
            absent={"yade": "chains are looked at now and then, not in every step: results/stability/README.md"},
        )
        for stiffness, crosses in ((250.0, True), (2e4, False))
    ),
)

COARSE, MIDDLE, FINE = (8e-5, 4e-5, 2e-5, 1e-5), (4e-5, 2e-5, 1e-5, 5e-6), (2e-5, 1e-5, 5e-6, 2.5e-6)
LEAPFROG = "leapfrog is of second order"
LATE = "YADE's dashpot takes the velocity of half a step before, and begins with a jump: first order"
LAGS = "the dashpot takes the velocity of half a step before, and begins with a jump: first order"
MIDPOINT = "the implicit midpoint rule: second order"
SHAFTS = "the spring's force is the mean over the half steps before and after: second order"
TURNS = "YADE's exactAsphericalRot takes the frame of the step's beginning for its middle: first order"


def on_both(order: int, why: str) -> dict[str, tuple[int, str]]:
    """The same order on both engines, for the same reason."""
    return dict.fromkeys(ENGINES, (order, why))


LADDERS = (
    Ladder(
        name="let go from rest",
        about="a smarticle falls, let go as the pour does it",
        quantity="height after 0.1 s",
        unit="m",
        size=9.81 * 0.096**2 / 2,
        scheme=on_both(
            1, "bodies are let go with the velocity of half a step before: a shift in time by half a step, no more"
        ),
        steps=COARSE,
        errors=free.fall_errors,
    ),
    Ladder(
        name="spin",
        about="a smarticle spins about no axis in particular",
        quantity="orientation after 1.4 turns",
        unit="rad",
        size=8.6,
        scheme={"yade": (1, TURNS), "links": (2, MIDPOINT)},
        steps=COARSE,
        errors=free.spin_errors,
    ),
    Ladder(
        name="flips",
        about="a smarticle about the axis of its middle moment",
        quantity="time between two flips",
        unit="s",
        size=0.208,
        scheme={"yade": (1, TURNS), "links": (2, MIDPOINT)},
        steps=MIDDLE,
        errors=free.flip_errors,
    ),
    Ladder(
        name="bounce, e = 0.5",
        about="a ball bounces once under gravity",
        quantity="height after 5 ms",
        unit="m",
        size=5.12e-3 * 0.2,
        scheme={"yade": (1, LATE), "links": (1, LAGS)},
        steps=COARSE,
        errors=partial(bouncing.bounce_errors, restitution=0.5),
    ),
    Ladder(
        name="collision, law of the scene",
        about="two tilted smarticles collide once",
        quantity="places of all spheres after 5 ms",
        unit="m",
        size=5.12e-3 * 0.2,
        scheme={"yade": (1, f"{LATE}; so are rotations"), "links": (1, LAGS)},
        steps=COARSE,
        errors=partial(bouncing.collision_errors, smooth=False),
    ),
    Ladder(
        name="spin in the plane",
        about="a smarticle spins about the normal of its plane",
        quantity="orientation after 1.3 turns",
        unit="rad",
        size=8.3,
        scheme={"yade": (2, "about a principal axis the frame does not matter: second order"), "links": (2, MIDPOINT)},
        steps=(3.2e-4, 1.6e-4, 8e-5, 4e-5),
        errors=free.planar_spin_errors,
    ),
    Ladder(
        name="bounce, elastic",
        about="a ball bounces once under gravity",
        quantity="height after 5 ms",
        unit="m",
        size=5.12e-3 * 0.2,
        scheme=on_both(2, f"{LEAPFROG}, and the force begins from zero"),
        steps=COARSE,
        errors=partial(bouncing.bounce_errors, restitution=1.0),
    ),
    Ladder(
        name="collision, elastic and smooth",
        about="two smarticles in one plane collide once",
        quantity="places of all spheres after 5 ms",
        unit="m",
        size=5.12e-3 * 0.2,
        scheme=on_both(2, f"{LEAPFROG}, also of turns about the normal, and the force begins from zero"),
        steps=MIDDLE,
        errors=partial(bouncing.collision_errors, smooth=True),
    ),
    Ladder(
        name="stack, elastic",
        about="two balls on each other vibrate without parting",
        quantity="heights after 20 ms",
        unit="m",
        size=2e-3 * 0.36e-3,
        scheme=on_both(2, LEAPFROG),
        steps=COARSE,
        errors=floor.stack_errors,
    ),
    Ladder(
        name="sliding to rolling",
        about="a ball thrown along the floor, without a tangential dashpot",
        quantity="way after 0.1 s",
        unit="m",
        size=0.1,
        scheme=on_both(2, "the force of friction does not jump where sliding ends: second order"),
        steps=COARSE,
        errors=floor.roll_errors,
    ),
    Ladder(
        name="barbs on their shafts",
        about="an articulated smarticle in space, control period 0.2 ms",
        quantity="angle of a barb over 10 ms",
        unit="rad",
        size=0.01,
        scheme={"yade": (2, f"{LEAPFROG}, in the plane"), "links": (2, SHAFTS)},
        steps=FINE,
        errors=hinge.vibration_errors,
    ),
)
