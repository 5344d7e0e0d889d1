"""Output-error refinement of a rigid axis, tried on the electro-mechanical positioning system (EMPS).

Least squares of the open-loop simulation's error, from the parameters of the equations of motion: over the whole record, and
over its first half; then each quarter of the record simulated from its own start.

    python scripts/reference/emps_output_error.py .../emps-estimation.mat      # NumPy, SciPy; some minutes
"""

import sys

import numpy as np
from scipy.io import loadmat
from scipy.optimize import least_squares
from scipy.signal import savgol_filter

# Mass, viscous, Coulomb friction and offset by the equations of motion; the width within which Coulomb friction changes sign.
EQUATIONS = np.array([95.0, 203.3, 20.5, -3.2])
WIDTH = 3e-4
SUBSTEPS = 2


def simulate(parameters, force, step, position, velocity):
    """The positions under a force that is held from sample to sample."""
    mass, viscous, coulomb, offset = (float(p) for p in parameters)
    h = step / SUBSTEPS

    def acceleration(f, v):
        return (f - viscous * v - coulomb * max(-1.0, min(1.0, v / WIDTH)) - offset) / mass

    q, v, positions = position, velocity, []
    for f in force.tolist():
        positions.append(q)
        for _ in range(SUBSTEPS):
            a1 = acceleration(f, v)
            v2 = v + 0.5 * h * a1
            a2 = acceleration(f, v2)
            v3 = v + 0.5 * h * a2
            a3 = acceleration(f, v3)
            v4 = v + h * a3
            a4 = acceleration(f, v4)
            q += h / 6.0 * (v + 2.0 * (v2 + v3) + v4)
            v += h / 6.0 * (a1 + 2.0 * (a2 + a3) + a4)
    return np.array(positions)


def main():
    record = loadmat(sys.argv[1])
    q = record["qm"].ravel()
    step = float(np.diff(record["t"].ravel()).mean())
    force = record["gtau"].item() * record["vir"].ravel()
    velocity = savgol_filter(q, 51, 2, deriv=1, delta=step)
    n = len(q)

    def rms(parameters, first, last, start):
        error = simulate(parameters, force[first:last], step, q[first], start) - q[first:last]
        return 1e3 * np.sqrt(np.mean(error**2))

    def report(name, parameters):
        quarters = [rms(parameters, k * n // 4, (k + 1) * n // 4, velocity[k * n // 4]) for k in range(4)]
        print(f"{name}: {np.round(parameters, 3)}")
        print(f"  whole record {rms(parameters, 0, n, 0.0):.2f} mm, quarters from their own starts {np.round(quarters, 2)} mm")

    report("equations of motion", EQUATIONS)
    for name, last in (("output error, whole record", n), ("output error, first half", n // 2)):
        fit = least_squares(
            lambda p: 1e3 * (simulate(p, force[:last], step, q[0], 0.0) - q[:last]),
            EQUATIONS,
            x_scale=np.abs(EQUATIONS),
            diff_step=1e-4,
        )
        report(name, fit.x)


main()
