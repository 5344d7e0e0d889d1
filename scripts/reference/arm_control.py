"""Reference values of the control module, by SciPy, python-control and FilterPy: pip install scipy control filterpy."""

import control
import numpy as np
from arm import nonlinear
from filterpy.kalman import ExtendedKalmanFilter, JulierSigmaPoints, UnscentedKalmanFilter
from scipy import linalg, signal
from scipy.stats import chi2

A = np.array([[1.0, 0.1, 0.0], [0.0, 0.95, 0.2], [0.02, -0.1, 0.9]])
B = np.array([[0.0, 0.01], [0.1, 0.0], [0.0, 0.2]])
Q = np.diag([2.0, 0.5, 1.0])
R = np.array([[1.0, 0.1], [0.1, 0.5]])


def show(name, values):
    print(name, np.array2string(np.asarray(values), precision=17, separator=", ", max_line_width=120))


show("riccati, scipy.linalg.solve_discrete_are", linalg.solve_discrete_are(A, B, Q, R))
show("gain, control.dlqr", control.dlqr(A, B, Q, R)[0])

C = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
show("steady filter's covariance, control.dlqe", control.dlqe(A, np.eye(3), C, Q, R)[1])

# A controller in continuous time, sampled.
PENDULUM = np.array([[0.0, 1.0, 0.0], [-4.0, -0.4, 2.0], [0.0, 0.0, -3.0]])
DRIVE = np.array([[0.0, 0.0], [1.0, 0.5], [0.0, 2.0]])
for matrix in signal.cont2discrete((PENDULUM, DRIVE, np.eye(3), np.zeros((3, 2))), 0.1)[:2]:
    show("sampled, scipy.signal.cont2discrete", matrix)

show("chi-squared bands, 8 and 2 degrees", [chi2.ppf([0.025, 0.975], n) for n in (8, 2)])

# A correction of an eight-state filter from two encoders, by FilterPy.
rng = np.random.default_rng(1)
root = rng.normal(size=(8, 8)) * 1e-2
P = root @ root.T + 1e-5 * np.eye(8)
P = np.round(P, 8)
x = np.round(rng.normal(size=8), 3)
f = ExtendedKalmanFilter(8, 2)
f.x = x[:, None].copy()
f.P = P.copy()
f.R = np.eye(2) * 1e-4
H = np.zeros((2, 8))
H[0, 2] = H[1, 3] = 1
z = np.array([[x[2] + 0.01], [x[3] - 0.02]])
f.update(z, lambda _: H, lambda s: H @ s)
show("x before", x)
show("P before", P)
show("x after", f.x[:, 0])
show("P after, diagonal", np.diag(f.P))
show("NIS", (f.y.T @ np.linalg.inv(f.S) @ f.y).item())

# A prediction of the unscented filter under a held torque, by FilterPy; sigma points without one in the middle, the noise of the
# torques and the drift of the velocities as Q.
STEP, TORQUE, DEVIATION, DRIFT = 0.01, np.array([3.0, -2.0]), 0.2, 0.01


def moved(x, torque=TORQUE):
    k1 = nonlinear(x, torque)
    k2 = nonlinear(x + 0.5 * STEP * k1, torque)
    k3 = nonlinear(x + 0.5 * STEP * k2, torque)
    k4 = nonlinear(x + STEP * k3, torque)
    return x + STEP / 6 * (k1 + 2 * k2 + 2 * k3 + k4)


points = JulierSigmaPoints(8, kappa=0.0)
u = UnscentedKalmanFilter(8, 2, STEP, hx=lambda s: s[2:4], fx=lambda s, dt: moved(s), points=points)
u.x = np.array([0.3, 1.0, 0.32, 0.97, 0.4, -0.3, 0.35, -0.2])
u.P = P.copy()
held = np.stack([moved(u.x, TORQUE + e) - moved(u.x) for e in np.eye(2)], axis=1)
u.Q = DEVIATION**2 * held @ held.T + DRIFT**2 * STEP * np.diag([0.0] * 4 + [1.0] * 4)
u.predict()
show("x predicted", u.x)
show("P predicted, diagonal", np.diag(u.P))

# The extended filter's prediction, by FilterPy: F and the held torques' effect are those of the linearisation at the middle of the step, by
# complex steps and by SciPy's exponential.
STATE = np.array([0.3, 1.0, 0.32, 0.97, 0.4, -0.3, 0.35, -0.2])
MIDDLE = 0.5 * (STATE + moved(STATE))
TINY = 1e-30j
a = np.stack([nonlinear(MIDDLE + TINY * e, TORQUE).imag / TINY.imag for e in np.eye(8)], axis=1)
b = np.stack([nonlinear(MIDDLE, TORQUE + e) - nonlinear(MIDDLE, TORQUE) for e in np.eye(2)], axis=1)
flow = linalg.expm(STEP * np.block([[a, b], [np.zeros((2, 10))]]))
e = ExtendedKalmanFilter(8, 2)
e.F, e.P = flow[:8, :8], P.copy()
e.Q = DEVIATION**2 * flow[:8, 8:] @ flow[:8, 8:].T + DRIFT**2 * STEP * np.diag([0.0] * 4 + [1.0] * 4)
e.predict()
show("P predicted by the extended filter, diagonal", np.diag(e.P))
show("P predicted by the extended filter, first row", e.P[0])


# The vibration that shapers for the frequency 1 leave after a step in x'' + 2 z w x' + w^2 x = w^2 u, by SciPy's matrix exponential,
# with the published amplitudes.
def left(amplitudes, z, w):
    a = np.array([[0.0, 1.0], [-w * w, -2 * z * w]])
    instants = np.pi / np.sqrt(1 - z * z) * np.arange(len(amplitudes))
    x = np.zeros(2)
    for k, share in enumerate(amplitudes):
        x = linalg.expm(a * (instants[k] - instants[k - 1])) @ x if k else x
        x[0] -= share
    amplitude = np.hypot(x[0], (x[1] / w + z * x[0]) / np.sqrt(1 - z * z))
    return amplitude * np.sqrt(1 - z * z)


V = 0.05
X = np.cbrt(V**2 * (np.sqrt(1 - V**2) + 1))
OUTER = (3 * X**2 + 2 * X + 3 * V**2) / (16 * X)
UNDAMPED = {
    "zv": [0.5, 0.5],
    "zvd": [0.25, 0.5, 0.25],
    "ei": [(1 + V) / 4, (1 - V) / 2, (1 + V) / 4],
    "two-hump-ei": [OUTER, 0.5 - OUTER, 0.5 - OUTER, OUTER],
}
for name, amplitudes in UNDAMPED.items():
    show(f"left by {name} at 0.8, 1.1 and 1.2", [left(amplitudes, 0.0, w) for w in (0.8, 1.1, 1.2)])
K = np.exp(-0.1 * np.pi / np.sqrt(0.99))
for name, amplitudes in {"zv": np.array([1, K]), "zvd": np.array([1, 2 * K, K * K])}.items():
    show(f"left by {name}, damping ratio 0.1", [left(amplitudes / amplitudes.sum(), 0.1, w) for w in (0.8, 1.1, 1.2)])
