"""Reference motions of the two-link arm, written as crates/flexure/tests/data/arm_reference.csv.

Needs NumPy and SciPy; run from the repository's root:

    python3 scripts/reference/arm.py

The equations of motion are written here as they stand in the paper, with dense matrices and a
general linear solver, and integrated by SciPy's DOP853 at rtol 1e-13, atol 1e-15; where the torque
is held, every hold is integrated on its own. The scenario "chirp" is also integrated by Radau, an
unrelated method, and the difference printed.
"""

import numpy as np
from scipy.integrate import solve_ivp
from scipy.linalg import eigh

M, L, LC, I = 1.5075, 4.5, 2.25, 2.544
JM = np.diag([1.0, 1.0])
K = 500.0
A1, A2, KSW, ASW = 500.0, 500.0, 10.0, 3000.0
G = [0.5, 150.0, 50.0, 2.0, 100.0, 0.5]
S = np.array([[0.0, 1.0], [0.0, 0.0]])


def mass(q2):
    c = np.cos(q2)
    m11 = M * LC**2 + M * (L**2 + LC**2 + 2 * L * LC * c) + I + I
    m12 = M * (LC**2 + L * LC * c) + I
    return np.array([[m11, m12], [m12, M * LC**2 + I]])


def coriolis(q2, dq):
    return -M * L * LC * np.sin(q2) * np.array([[dq[1], dq[0] + dq[1]], [-dq[0], 0.0]])


def friction(v):
    g1, g2, g3, g4, g5, g6 = G
    return g1 * (np.tanh(g2 * v) - np.tanh(g3 * v)) + g4 * np.tanh(g5 * v) + g6 * v


def kappa(d):
    return A1 * d**3 + A2 * d - KSW * np.exp(-ASW * d**2) * d


def rigid(x, tau):
    q, dq = x[:2], x[2:]
    return np.concatenate([dq, np.linalg.solve(mass(q[1]), tau - coriolis(q[1], dq) @ dq)])


def linear(x, tau):
    q, qm, dq, dqm = x[0:2], x[2:4], x[4:6], x[6:8]
    elastic = K * (qm - q)
    ddq = np.linalg.solve(mass(q[1]), elastic - coriolis(q[1], dq) @ dq)
    return np.concatenate([dq, dqm, ddq, np.linalg.solve(JM, tau - elastic)])


def nonlinear(x, tau):
    q, qm, dq, dqm = x[0:2], x[2:4], x[4:6], x[6:8]
    elastic = kappa(qm - q)
    full = np.block([[mass(q[1]), S], [S.T, JM]])
    right = np.concatenate([elastic - coriolis(q[1], dq) @ dq - friction(dq), tau - elastic])
    return np.concatenate([dq, dqm, np.linalg.solve(full, right)])


MODELS = {"rigid": rigid, "linear": linear, "nonlinear": nonlinear}


def chirp(t):
    phase = 2 * np.pi * (0.1 * t + 0.095 * t * t)
    return np.array([20.0 * np.sin(phase), 5.0 * np.cos(0.7 * phase)])


def held(k):
    """Torques that look random, from a generator that any language can repeat exactly."""
    state = 12345
    for _ in range(2 * k):
        state = state * 1103515245 % 2**31
    first = state * 1103515245 % 2**31
    second = first * 1103515245 % 2**31
    return np.array([40.0 * (first / 2**31 - 0.5), 10.0 * (second / 2**31 - 0.5)])


def integrate(f, x, t0, t1, torque, method="DOP853", rtol=1e-13, atol=1e-15):
    solution = solve_ivp(lambda t, x: f(x, torque(t)), (t0, t1), x, method=method, rtol=rtol, atol=atol)
    assert solution.success, solution.message
    return solution.y[:, -1]


def main():
    lines = ["# model,torque,q2 at the start,then the state after 10 s: q, qm (flexible), q', qm' (flexible)"]
    for name, f in MODELS.items():
        start = np.zeros(4 if name == "rigid" else 8)
        start[1] = 0.5
        if name != "rigid":
            start[3] = 0.5
        x = integrate(f, start, 0.0, 10.0, chirp)
        check = integrate(f, start, 0.0, 10.0, chirp, "Radau", 1e-9, 1e-11)
        print(name, "chirp: difference from Radau", np.abs(x - check).max(), flush=True)
        lines.append(",".join([name, "chirp", *(repr(float(v)) for v in x)]))
        y = start.copy()
        for k in range(100):
            tau = held(k)
            y = integrate(f, y, 0.1 * k, 0.1 * (k + 1), lambda t: tau)
        lines.append(",".join([name, "held", *(repr(float(v)) for v in y)]))
    for q2 in (0.0, 0.5, 2.0):
        for name, s, k in (("linear", np.zeros((2, 2)), K), ("nonlinear", S, A2 - KSW)):
            full = np.block([[mass(q2), s], [s.T, JM]])
            spring = np.block([[k * np.eye(2), -k * np.eye(2)], [-k * np.eye(2), k * np.eye(2)]])
            omega = np.sqrt(eigh(spring, full, eigvals_only=True)[2:])
            lines.append(",".join([name, "modes", repr(q2), *(repr(float(v)) for v in omega)]))
    lines[0] = (
        "# model, then: chirp or held and the state after 10 s (q, qm, q', qm'; rigid: q, q');"
        " or modes, q2, and the modal frequencies in rad/s. Written by scripts/reference/arm.py."
    )
    with open("crates/flexure/tests/data/arm_reference.csv", "w") as file:
        file.write("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
