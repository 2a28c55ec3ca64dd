"""The mechanism as an Exudyn model: bodies, markers and connectors, whose equations are Exudyn's.

What was found with Exudyn 1.13. Its explicit solvers take no joints, so each scene is a model in
minimal coordinates of native items: between two clearance joints a planar rigid body and a sliding
mass; a rod that hangs on the crosshead or on the crank is a kinematic tree. The crank is a rotor
with 1e12 kg m2, which turns at constant speed whatever presses on it: an explicit solver's
prescribed motion. Positions and velocities of journals and bores come from Exudyn's markers.

Settings, fastest found: symbolic user functions (evaluated in C++); the module without range
checks (a fifth faster); a vector force as a product with its scalar, since a symbolic expression
is a tree in which whatever is used twice is evaluated twice, and IfThenElse, which evaluates one
branch; the gas force by parameters that are set at the load's corners, where the run restarts; no
solution files; the end-of-step acceleration taken from DOPRI5's last stage, which has the same
state; modified Newton for the implicit solver, almost twice as fast as full Newton.

DOPRI5's steps do not end on the output grid: acceleration there is the derivative of the cubic
through each step's velocities and accelerations.
"""

import contextlib
import io
import math
import sys
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from peers.mechanism import (
    BORE,
    CLEARANCE,
    DAMPING,
    DURATION,
    FULL_DAMPING,
    GAS_EXPONENT,
    HEAD,
    I_ROD,
    M_CROSS,
    M_ROD,
    MU_DYNAMIC,
    MU_STATIC,
    OMEGA,
    STIFFNESS,
    V_FRICTION,
    V_STICTION,
    A,
    B,
    L,
    R,
    load_of,
    output_grid,
    pieces,
)  # fmt: skip
from scipy.interpolate import CubicHermiteSpline

HEAVY = 1e12  # kg m2
SPIN = -R * OMEGA / L  # of the rod at top dead centre, rad/s
LONGEST_STEP = 2e-4  # s
FIRST_STEP = 1e-6  # s
TINY = 1e-300  # keeps 0 / 0 out of concentric joints


class Model(NamedTuple):
    """An assembled model; `keep` holds what must outlive it."""

    mbs: object
    gas: object  # the connector of the piston force
    crosshead: object  # its node
    sensors: tuple  # of the crosshead's coordinate, velocity and acceleration
    keep: list


@lru_cache
def modules():
    """exudyn, exudyn.itemInterface and exudyn.utilities: the build without range checks."""
    sys.exudynFast = True
    with contextlib.redirect_stdout(io.StringIO()):  # it announces itself
        import exudyn
        from exudyn import itemInterface, utilities
    return exudyn, itemInterface, utilities


def contact_law(journal_spin):
    """Exudyn's user function of a clearance joint between a journal (marker 0) and a bore (1)."""
    esym = modules()[0].symbolic

    def cubic(s):
        return s * s * (3.0 - 2.0 * s)

    def friction(slip):
        size = esym.abs(slip)
        part = (size - V_STICTION) / (V_FRICTION - V_STICTION)
        falling = esym.sign(slip) * (MU_STATIC + (MU_DYNAMIC - MU_STATIC) * cubic(part))
        rising = MU_STATIC * (2.0 * cubic(0.5 + 0.5 * slip / V_STICTION) - 1.0)
        partial = esym.IfThenElse(size > V_STICTION, falling, rising)
        return esym.IfThenElse(size >= V_FRICTION, MU_DYNAMIC * esym.sign(slip), partial)

    # in the journal's frame: u is bore less journal centre, w their velocities' difference
    def joint(
        mbs, t, itemNumber, u, rotation, w, spin, stiffness, damping, rotJ0, rotJ1, offset
    ):  # fmt: skip
        zero = esym.Real(0.0)
        distance = u.NormL2() + TINY
        depth = distance - CLEARANCE
        rate = (u * w) / distance
        full = DAMPING * cubic(esym.min(depth / FULL_DAMPING, 1.0))
        pressed = esym.max(0.0, STIFFNESS * esym.pow(depth, 1.5) + full * rate)
        normal = esym.IfThenElse(depth > 0.0, pressed, zero)
        # arms R_j - delta and R_b, whose difference is the distance; `spin` is the relative one
        slip = (w[1] * u[0] - w[0] * u[1]) / distance - journal_spin * distance - spin[2] * BORE
        mu = esym.IfThenElse(depth > 0.0, friction(slip), zero)
        along = esym.Vector([u[0], u[1], 0.0, 0.0, 0.0, 0.0])
        across = esym.Vector([u[1], 0.0 - u[0], 0.0, 0.0, 0.0, BORE * distance])
        return (normal / distance) * (along - mu * across)

    return joint


def gas_law():
    """User function of the piston force: a constant `offset`, or a gas with `stiffness` > 0."""
    esym = modules()[0].symbolic
    room = HEAD - (L + R)

    def gas(mbs, t, itemNumber, displacement, velocity, stiffness, damping, offset):
        pressed = stiffness * esym.pow(room - displacement, -GAS_EXPONENT)
        return esym.IfThenElse(stiffness > 0.0, pressed, offset)

    return gas


class Builder:
    """Adds the mechanism's items to a new system."""

    def __init__(self):
        self.exu, self.items, self.utilities = modules()
        self.container = self.exu.SystemContainer()
        self.mbs = self.container.AddSystem()
        self.keep = [self.container]

    def add(self, kind, **how):
        """Add an item of a kind, such as Node1D."""
        begin = next(one for one in ("Node", "Object", "Marker", "Sensor") if kind.startswith(one))
        return getattr(self.mbs, f"Add{begin}")(getattr(self.items, kind)(**how))

    def symbolic(self, function, name, item):
        made = self.utilities.CreateSymbolicUserFunction(
            self.mbs, function, name, itemTypeName=item
        )
        self.keep.append(made)
        return made

    def crank(self):
        """Marker of the crankpin on a rotor that nothing can slow down."""
        node = self.add("Node1D", initialVelocities=[OMEGA])
        rotor = self.add("ObjectRotationalMass1D", nodeNumber=node, inertia=HEAVY)
        return self.add("MarkerBodyRigid", bodyNumber=rotor, localPosition=[R, 0, 0])

    def crosshead(self):
        """Node and pin marker of a sliding mass."""
        node = self.add("Node1D", referenceCoordinates=[R + L])
        mass = self.add("ObjectMass1D", nodeNumber=node, mass=M_CROSS)
        return node, self.add("MarkerBodyRigid", bodyNumber=mass)

    def free_rod(self):
        """Markers of both bores of a rod that hangs on nothing."""
        speed = [0, R * OMEGA * (1 - A / L), SPIN]
        node = self.add(
            "NodeRigidBody2D", referenceCoordinates=[R + A, 0, 0], initialVelocities=speed
        )
        rod = self.add("ObjectRigidBody2D", nodeNumber=node, mass=M_ROD, inertia=I_ROD)
        return [
            self.add("MarkerBodyRigid", bodyNumber=rod, localPosition=[arm, 0, 0])
            for arm in (-A, B)
        ]

    def hanging_rod(self, first, mass, inertia, start, rates, shift, centre, bore):
        """Node and bore marker of a rod on a first link: a slider or a crank, by its joint."""
        exu, eye, zero = self.exu, np.eye(3), [0, 0, 0]
        node = self.add(
            "NodeGenericODE2",
            referenceCoordinates=start, initialCoordinates=[0.0, 0.0],
            initialCoordinates_t=rates, numberOfODE2Coordinates=2,
        )  # fmt: skip
        tree = self.add(
            "ObjectKinematicTree",
            nodeNumber=node, jointTypes=[first, exu.JointType.RevoluteZ], linkParents=[-1, 0],
            jointTransformations=exu.Matrix3DList([eye, eye]),
            jointOffsets=exu.Vector3DList([zero, [shift, 0, 0]]),
            linkInertiasCOM=exu.Matrix3DList([inertia * eye, I_ROD * eye]),
            linkCOMs=exu.Vector3DList([zero, [centre, 0, 0]]), linkMasses=[mass, M_ROD],
        )  # fmt: skip
        place = [bore, 0, 0]
        return node, self.add(
            "MarkerKinematicTreeRigid", objectNumber=tree, linkNumber=1, localPosition=place
        )

    def joint(self, journal, bore, journal_spin):
        """A clearance joint between two markers."""
        item = "ObjectConnectorRigidBodySpringDamper"
        law = self.symbolic(contact_law(journal_spin), "springForceTorqueUserFunction", item)
        self.add(item, markerNumbers=[journal, bore], springForceTorqueUserFunction=law)

    def finish(self, node):
        """Put the gas and the sensors on coordinate 0 of the crosshead's node, and assemble."""
        ground = self.add("NodePointGround")
        ends = [
            self.add("MarkerNodeCoordinate", nodeNumber=n, coordinate=0) for n in (ground, node)
        ]
        item = "ObjectConnectorCoordinateSpringDamper"
        law = self.symbolic(gas_law(), "springForceUserFunction", item)
        gas = self.add(item, markerNumbers=ends, springForceUserFunction=law)
        kinds = self.exu.OutputVariableType
        sensors = tuple(
            self.add("SensorNode", nodeNumber=node, storeInternal=True, outputVariableType=kind)
            for kind in (kinds.Coordinates_t, kinds.Coordinates_tt)
        )
        self.mbs.Assemble()
        return Model(self.mbs, gas, node, sensors, self.keep)


def build(scene):
    """The scene's model at top dead centre."""
    builder = Builder()
    kinds = builder.exu.JointType
    if scene == "big_end":
        node, bore = builder.hanging_rod(
            kinds.PrismaticX, M_CROSS, 0.0, [R + L, 0.0], [0.0, SPIN], 0.0, -B, -L
        )
        builder.joint(builder.crank(), bore, OMEGA)
    elif scene == "small_end":
        _, bore = builder.hanging_rod(
            kinds.RevoluteZ, 1.0, HEAVY, [0.0, 0.0], [OMEGA, SPIN - OMEGA], R, A, L
        )
        node, pin = builder.crosshead()
        builder.joint(pin, bore, 0.0)
    else:
        node, pin = builder.crosshead()
        big, small = builder.free_rod()
        builder.joint(builder.crank(), big, OMEGA)
        builder.joint(pin, small, 0.0)
    return builder.finish(node)


def settings(rtol, step):
    """Simulation settings: DOPRI5 with error control, or generalised-alpha with a step (s)."""
    exu = modules()[0]
    made = exu.SimulationSettings()
    time = made.timeIntegration
    if step:
        time.solverType = exu.DynamicSolverType.GeneralizedAlpha
    else:
        time.solverType = exu.DynamicSolverType.DOPRI5
        time.relativeTolerance, time.absoluteTolerance = rtol, 1e-2 * rtol
        time.initialStepSize, time.minimumStepSize = FIRST_STEP, 1e-14
    time.explicit.computeEndOfStepAccelerations = False
    time.newton.useModifiedNewton = True
    made.solution.file.write = False
    made.solution.sensors.writePeriod = 1e-12  # at every step
    return made


def set_phase(model, phase):
    """Give the gas connector the parameters of the load's phase, which begins now."""
    kind = modules()[0].OutputVariableType.Coordinates
    moved = np.ravel(model.mbs.GetNodeOutput(model.crosshead, kind))[0]
    stiffness, offset = load_of(phase, R + L + moved)
    model.mbs.SetObjectParameter(model.gas, "stiffness", stiffness)
    model.mbs.SetObjectParameter(model.gas, "offset", offset)


def acceleration(scene, rtol=None, step=None, duration=DURATION):
    """Crosshead acceleration (m/s2) on the output grid, by DOPRI5 (rtol) or with a fixed step."""
    model, made = build(scene), settings(rtol, step)
    time = made.timeIntegration
    a = np.empty(output_grid(duration).size)
    for samples, times, wanted, phase in pieces(duration):
        set_phase(model, phase)
        time.startTime, time.endTime = times[0], times[-1]
        time.numberOfSteps = math.ceil((times[-1] - times[0]) / (step or LONGEST_STEP) - 1e-6)
        model.mbs.SolveDynamic(made, updateInitialValues=True)
        a[samples] = sampled(model, times[wanted])
    return a


def sampled(model, times):
    """The crosshead's acceleration at `times` (s) of the last run."""
    speed, rate = (model.mbs.GetSensorStoredData(sensor)[:, :2] for sensor in model.sensors)
    found, first = np.unique(speed[:, 0], return_index=True)
    v, a = speed[first, 1], rate[first, 1].copy()
    a[0] = 2 * (v[1] - v[0]) / (found[1] - found[0]) - a[1]  # not computed before the first step
    return CubicHermiteSpline(found, v, a)(np.clip(times, found[0], found[-1]), 1)
