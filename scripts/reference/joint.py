"""The inverse dynamic model of a rigid axis by least squares, the textbook way (Gautier 1997), with SciPy.

Zero-phase Butterworth filter, central differences, the same decimating filter on both sides. Prints M, Fv, Fc and the
offset with their standard errors for the record of the electro-mechanical positioning system (EMPS; Janot, Gautier &
Brunot 2019): `python joint.py emps-estimation.mat`. The test of `flexure joint` on that record holds its own estimates
against these.
"""

import sys

import numpy as np
import scipy.io
import scipy.signal

record = scipy.io.loadmat(sys.argv[1])
t, q, u = (record[name].ravel() for name in ("t", "qm", "vir"))
force = record["gtau"].item() * u
step = np.diff(t).mean()
b, a = scipy.signal.butter(4, 60 * 2 * step)
smooth = scipy.signal.filtfilt(b, a, q)
velocity = np.gradient(smooth, step)
columns = np.c_[np.gradient(velocity, step), velocity, np.sign(velocity), np.ones_like(q)]
columns, force = columns[50:-50], force[50:-50]
for _ in range(2):
    columns, force = scipy.signal.decimate(columns, 5, axis=0), scipy.signal.decimate(force, 5)
x, *_ = np.linalg.lstsq(columns, force, rcond=None)
residual = force - columns @ x
variance = residual @ residual / (len(force) - 4)
error = np.sqrt(np.diag(np.linalg.inv(columns.T @ columns)) * variance)
for name, value, sd in zip(("M", "Fv", "Fc", "F0"), x, error):
    print(f"{name} = {value:.4f} +- {sd:.4f}")
