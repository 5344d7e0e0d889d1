"""Reference values of the control module, by SciPy, python-control and FilterPy: pip install scipy control filterpy."""

import control
import numpy as np
from filterpy.kalman import ExtendedKalmanFilter
from scipy import linalg
from scipy.stats import chi2

A = np.array([[1.0, 0.1, 0.0], [0.0, 0.95, 0.2], [0.02, -0.1, 0.9]])
B = np.array([[0.0, 0.01], [0.1, 0.0], [0.0, 0.2]])
Q = np.diag([2.0, 0.5, 1.0])
R = np.array([[1.0, 0.1], [0.1, 0.5]])


def show(name, values):
    print(name, np.array2string(np.asarray(values), precision=17, separator=", ", max_line_width=120))


show("riccati, scipy.linalg.solve_discrete_are", linalg.solve_discrete_are(A, B, Q, R))
show("gain, control.dlqr", control.dlqr(A, B, Q, R)[0])

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
