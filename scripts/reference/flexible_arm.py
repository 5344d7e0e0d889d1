"""Motions of two-link arms with two flexible links by Exudyn, for crates/flexure/src/manipulator/flexible_arm/exudyn_tests.rs.

Needs `exudyn` from PyPI (1.13); run from the repository's root:

    python3 scripts/reference/flexible_arm.py

The links are cables of 8 and 16 elements with absolute nodal coordinates, which bend by any angle; they begin straight, and turn. A mass
is at the tip. On a fixed base, and on one that floats. Printed are the elements' and the steps' errors, and what the tests compare.
"""

import exudyn as exu
import numpy as np
from exudyn.itemInterface import *

LENGTH, EI, EA, DENSITY = 2.0, 300.0, 1e6, 0.7
LOAD = 0.5
BASE, BASE_INERTIA, SHOULDER = 20.0, 2.0, 0.3
ELBOW = 0.8
SPEEDS = (1.0, -2.5)
TIMES = (0.2, 0.4, 0.6, 0.8)


def run(elements, free, step):
    mbs = exu.SystemContainer().AddSystem()
    place = mbs.AddMarker

    def link(root, velocity, angle, speed):
        """A straight cable that turns about its root."""
        along, across = np.array([np.cos(angle), np.sin(angle)]), np.array([-np.sin(angle), np.cos(angle)])
        nodes = []
        for k in range(elements + 1):
            x = LENGTH * k / elements
            nodes.append(
                mbs.AddNode(
                    NodePoint2DSlope1(
                        referenceCoordinates=[*(root + x * along), *along],
                        initialVelocities=[*(velocity + speed * x * across), *(speed * across)],
                    )
                )
            )
        for pair in zip(nodes, nodes[1:]):
            mbs.AddObject(
                ObjectANCFCable2D(
                    nodeNumbers=list(pair), length=LENGTH / elements, massPerLength=DENSITY,
                    bendingStiffness=EI, axialStiffness=EA, useReducedOrderIntegration=0,
                )
            )
        return nodes, root + LENGTH * along, velocity + speed * LENGTH * across

    root = np.array([SHOULDER if free else 0.0, 0.0])
    upper, elbow, speed = link(root, np.zeros(2), 0.0, SPEEDS[0])
    lower, end, end_speed = link(elbow, speed, ELBOW, sum(SPEEDS))
    load = mbs.AddNode(NodePoint2D(referenceCoordinates=list(end), initialVelocities=list(end_speed)))
    mbs.AddObject(ObjectMassPoint2D(mass=LOAD, nodeNumber=load))
    at = lambda number: place(MarkerNodePosition(nodeNumber=number))
    joints = [(at(upper[-1]), at(lower[0])), (at(lower[-1]), at(load))]
    if free:
        node = mbs.AddNode(NodeRigidBody2D())
        base = mbs.AddObject(ObjectRigidBody2D(mass=BASE, inertia=BASE_INERTIA, nodeNumber=node))
        joints.append((place(MarkerBodyPosition(bodyNumber=base, localPosition=[SHOULDER, 0, 0])), at(upper[0])))
    else:
        joints.append((place(MarkerBodyPosition(bodyNumber=mbs.AddObject(ObjectGround()))), at(upper[0])))
    for pair in joints:
        mbs.AddObject(ObjectJointRevolute2D(markerNumbers=list(pair)))
    watched = [upper[-1], load]
    sensors = [
        mbs.AddSensor(SensorNode(nodeNumber=n, outputVariableType=exu.OutputVariableType.Position, storeInternal=True, writeToFile=False))
        for n in watched
    ]
    mbs.Assemble()
    settings = exu.SimulationSettings()
    settings.timeIntegration.endTime = TIMES[-1]
    settings.timeIntegration.numberOfSteps = round(TIMES[-1] / step)
    settings.timeIntegration.verboseMode = 0
    settings.timeIntegration.generalizedAlpha.spectralRadius = 0.9
    settings.timeIntegration.newton.useModifiedNewton = True
    settings.solution.file.write = False
    settings.solution.sensors.writePeriod = step
    mbs.SolveDynamic(settings)
    rows = []
    for time in TIMES:
        found = [mbs.GetSensorStoredData(sensor) for sensor in sensors]
        rows.append([np.interp(time, data[:, 0], data[:, k]) for data in found for k in (1, 2)])
    return np.array(rows)


def report(free):
    coarse, fine, short = run(8, free, 2e-4), run(16, free, 2e-4), run(8, free, 1e-4)
    print("free" if free else "fixed", "base; the rows are the places of elbow and tip")
    print(f"  errors: of elements {np.abs(fine - coarse).max():.1e}, of steps {np.abs(short - coarse).max():.1e}", flush=True)
    for time, row in zip(TIMES, fine):
        print(f"  {time}:", ", ".join(f"{value:.6f}" for value in row), flush=True)


if __name__ == "__main__":
    report(False)
    report(True)
