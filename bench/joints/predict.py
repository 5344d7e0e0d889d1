"""The torques of a robot's axes on the second half of a record, predicted from its first half, in comparison with the textbook's model.

    bench/joints/predict.py ../shared/data/kr300-a.csv        # needs NumPy, SciPy and a built flexure (FLEXURE_BINARY)

`flexure joint --axis` sees the first half. Its torque is the inertia times the acceleration and the free friction curve over the velocity. The
textbook's model is inertia, Coulomb and viscous friction and an offset by least squares over the same half, plain, and regularised with the
ridge that is best on the half to be predicted: more than anyone can know. The motion is that of the motors, smoothed without delay.
"""

import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from scipy.signal import butter, filtfilt

BINARY = os.environ.get("FLEXURE_BINARY", "target/release/flexure")
# Hz; the motion lies below.
CUT_OFF = 12.0
# As shares of the columns' mean squares.
RIDGES = np.concatenate([[0.0], np.logspace(-4, 0, 17)])
# The velocity within which Coulomb friction changes its sign, rad/s.
WIDTH = 2e-3


def rms(x):
    return float(np.sqrt(np.mean(x**2)))


def identified(table, names, half):
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "half.csv"
        np.savetxt(path, table[:half], delimiter=",", header=",".join(names), comments="", fmt="%.12g")
        command = [BINARY, "joint", path, "--axis", "1..6", "--motor", "qm{}", "--link", "q{}", "--torque", "tau{}", "--json"]
        return json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)["axes"]


def textbook(columns, torque, half):
    """The errors on the second half by ridge."""
    scale = np.sqrt(np.mean(columns[:half] ** 2, axis=0))
    columns = columns / scale
    gram, moments = columns[:half].T @ columns[:half], columns[:half].T @ torque[:half]
    factors = (np.linalg.solve(gram + ridge * half * np.eye(len(gram)), moments) for ridge in RIDGES)
    return [rms(torque[half:] - columns[half:] @ x) for x in factors]


def main():
    with open(sys.argv[1]) as file:
        names = file.readline().strip().split(",")
    table = np.genfromtxt(sys.argv[1], delimiter=",", skip_header=1)
    column = {name: table[:, i] for i, name in enumerate(names)}
    step, half = float(np.diff(column["t"]).mean()), len(table) // 2
    b, a = butter(4, 2 * step * CUT_OFF)
    print("axis  flexure  plain  regularised   RMS of the torque's error; its mean square about the first half's mean")
    for axis in identified(table, names, half):
        name = axis["axis"]
        angle = filtfilt(b, a, column[f"qm{name}"])
        velocity = np.gradient(angle, step)
        acceleration = np.gradient(velocity, step)
        torque = filtfilt(b, a, column[f"tau{name}"])
        columns = np.column_stack([acceleration, velocity, np.clip(velocity / WIDTH, -1, 1), np.ones_like(angle)])
        plain, *regularised = textbook(columns, torque, half)
        inertia = axis.get("inertia", axis.get("link_inertia"))
        curve = axis["friction"]
        own = rms((torque - inertia["value"] * acceleration - np.interp(velocity, curve["x"], curve["y"]))[half:])
        spread = rms(torque[half:] - torque[:half].mean())
        print(f"{name:>4}  {own:7.3f}  {plain:5.3f}  {min(regularised):11.3f}   {spread:.3f}")


main()
