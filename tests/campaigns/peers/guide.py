"""The slider with play in its guide, as an Exudyn model: three bodies, three revolute joints.

The machine of Flores, Leine and Glocker (tests/published.py) before its first contact, in redundant
coordinates with multipliers, by Exudyn's generalised-alpha method without damping. Its
error falls with the square of the step, so that two runs give a third value (Richardson).
"""

import numpy as np

LENGTHS = (0.153, 0.306)  # m
MASSES = (0.038, 0.038, 0.076)  # kg: crank, rod, slider
INERTIAS = (7.4e-5, 5.9e-4, 2.7e-6)  # kg m^2
SPEED, GRAVITY, CLEARANCE = 150.0, 9.81, 1e-3
STEP = 2e-6  # s


def flight(times, step):
    """Crank speed (rad/s) and height of the slider over the clearance at some times (s), (m, 2)."""
    import exudyn
    from exudyn import itemInterface as items

    crank, rod = LENGTHS
    places = [(crank / 2, 0), (crank + rod / 2, 0), (crank + rod, 0)]
    spins = SPEED, -SPEED * crank / rod, 0.0
    rates = [(0, SPEED * crank / 2), (0, SPEED * crank / 2), (0, 0)]
    system = exudyn.SystemContainer().AddSystem()
    ground, nodes, bodies = system.AddObject(items.ObjectGround()), [], []

    def marked(body, x):
        place = items.MarkerBodyPosition(bodyNumber=body, localPosition=[x, 0, 0])
        return system.AddMarker(place)

    for place, rate, spin, mass, inertia in zip(
        places, rates, spins, MASSES, INERTIAS, strict=True
    ):
        node = items.NodeRigidBody2D(
            referenceCoordinates=[*place, 0], initialVelocities=[*rate, spin]
        )
        nodes.append(system.AddNode(node))
        body = items.ObjectRigidBody2D(mass=mass, inertia=inertia, nodeNumber=nodes[-1])
        bodies.append(system.AddObject(body))
        weight = [0, -mass * GRAVITY, 0]
        system.AddLoad(items.Force(markerNumber=marked(bodies[-1], 0), loadVector=weight))
    for first, second in (
        (marked(ground, 0), marked(bodies[0], -crank / 2)),
        (marked(bodies[0], crank / 2), marked(bodies[1], -rod / 2)),
        (marked(bodies[1], rod / 2), marked(bodies[2], 0)),
    ):
        system.AddObject(items.ObjectJointRevolute2D(markerNumbers=[first, second]))
    system.Assemble()
    found = []
    for time in times:
        how = exudyn.SimulationSettings()
        stepping = how.timeIntegration
        stepping.numberOfSteps, stepping.endTime = round(time / step), time
        stepping.generalizedAlpha.spectralRadius = 1.0
        stepping.newton.relativeTolerance, stepping.newton.absoluteTolerance = 1e-12, 1e-14
        how.solution.file.write = False
        system.SolveDynamic(how)
        kind = exudyn.OutputVariableType
        speed = system.GetNodeOutput(nodes[0], kind.AngularVelocity)[2]
        height = system.GetNodeOutput(nodes[2], kind.Position)[1]
        found.append((speed, height / CLEARANCE))
    return np.array(found)


def converged(times):
    """`flight` by two steps, and what they converge to: (m, 2)."""
    coarse, fine = flight(times, 2 * STEP), flight(times, STEP)
    return (4 * fine - coarse) / 3
