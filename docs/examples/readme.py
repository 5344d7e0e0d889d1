#!/usr/bin/env python3
"""Makes the README's pictures: docs/readme-overview.png, docs/readme-gallery.png and docs/readme-speed.png.

    docs/examples/readme.py                      # all
    docs/examples/readme.py overview speed       # some

FLEXURE_BINARY is the program (target/release/flexure). FLEXURE_DATA is a folder with the measured records, for `gallery`: they are not part of
the project. The times of `speed` are those of docs/measurements.md. Needs NumPy and matplotlib (docs/requirements.txt).
"""

import json
import os
import shlex
import subprocess
import sys
import tempfile
from pathlib import Path

import matplotlib

matplotlib.use("agg")
import numpy as np
from matplotlib import pyplot

HERE = Path(__file__).resolve().parent
DOCS = HERE.parent
sys.path.insert(0, str(HERE))

import systems

BINARY = Path(os.environ.get("FLEXURE_BINARY") or DOCS.parent / "target/release/flexure").resolve()
BLUE, ORANGE, GREY, INK = "#1f6fb5", "#d9770b", "#8a8f98", "#22272e"

pyplot.rcParams.update({
    "font.size": 10,
    "text.color": INK,
    "axes.edgecolor": GREY,
    "axes.labelcolor": INK,
    "axes.titlesize": 10,
    "axes.titleweight": "bold",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "xtick.color": INK,
    "ytick.color": INK,
    "axes.grid": True,
    "grid.color": GREY,
    "grid.alpha": 0.2,
    "legend.frameon": False,
    "legend.fontsize": 9,
})


def run(folder, command):
    """Runs `flexure ...` in the folder; returns the object that it prints."""
    program, *arguments = shlex.split(command)
    assert program == "flexure", command
    done = subprocess.run([BINARY, *arguments, "--json"], cwd=folder, check=True, stdout=subprocess.PIPE, text=True)
    return json.loads(done.stdout)


def save(figure, name):
    figure.savefig(DOCS / f"readme-{name}.png", dpi=144, facecolor="white", metadata={"Software": None})
    pyplot.close(figure)


def banded(axes, curve, label):
    axes.fill_between(curve["x"], curve["lower"], curve["upper"], color=BLUE, alpha=0.25, linewidth=0, label="95 % band")
    axes.plot(curve["x"], curve["y"], color=BLUE, linewidth=2, label=label)


def motor(noise=0.25, n=1500):
    """The motor of the documentation (a dead zone from -0.5 to 0.7 V, then a lag) with more noise and fewer samples, so that the band shows."""
    record = systems.motor(n)
    rng = np.random.default_rng(1)
    clean = systems.lag(systems.dead_zone(record["voltage"]), [1, -0.8], [4.0 * 0.2], delay=1)
    return record | {"speed": clean + rng.normal(0, noise, n)}


def overview():
    record = motor()
    with tempfile.TemporaryDirectory() as folder:
        table = np.column_stack(list(record.values()))
        np.savetxt(Path(folder) / "motor.csv", table, delimiter=",", header=",".join(record), comments="", fmt="%.9g")
        found = run(folder, "flexure identify motor.csv --input voltage --output speed -o model.json")
        run(folder, "flexure predict model.json motor.csv -o predicted.csv --initial-state steady")
        predicted = np.genfromtxt(Path(folder) / "predicted.csv", delimiter=",", names=True)
        predicted = predicted["predicted"]
    figure, (log, curve, fresh) = pyplot.subplots(1, 3, figsize=(11, 3.3), layout="constrained")
    part = slice(0, 120)
    log.step(record["t"][part], record["voltage"][part], color=GREY, linewidth=1, where="post", label="voltage, V")
    log.plot(record["t"][part], record["speed"][part], color=INK, linewidth=1.4, label="speed, rad/s")
    log.set(title="You give a log", xlabel="time, s", ylim=(None, 9))
    log.legend(loc="upper right", ncols=2)
    x = np.array(found["nonlinearity"]["x"])
    banded(curve, found["nonlinearity"], "identified")
    curve.plot(x, 4 * systems.dead_zone(x), color=ORANGE, dashes=(4, 3), linewidth=1.4, label="true")
    curve.set(title="Flexure finds the curve inside", xlabel="voltage, V", ylabel="steady speed, rad/s", xlim=(-1.4, 1.6), ylim=(-3, 3.5))
    curve.legend()
    part = slice(1300, 1420)
    fresh.plot(record["t"][part], record["speed"][part], color=INK, linewidth=1.4, label="measured")
    fresh.plot(record["t"][part], predicted[part], color=BLUE, linewidth=1.4, label="model")
    verdict = "it holds" if found["holds"] else "it does not hold"
    fresh.set(title=f"and tries it on fresh data: {verdict}", xlabel="time, s", ylim=(None, 9))
    fresh.legend(loc="upper right", ncols=2)
    save(figure, "overview")


def gallery():
    data = Path(os.environ["FLEXURE_DATA"]).resolve()
    with tempfile.TemporaryDirectory() as folder:
        axis = run(folder, f"flexure joint {data}/emps-estimation.mat --position qm --torque vir --torque-constant gtau --prismatic")
        circuit = run(folder, f"flexure identify {data}/wiener-hammerstein-2009-estimation.csv --input u --output y --sample-time 1.953125e-5 --structure wiener-hammerstein")
        record = systems.motor()
        np.savetxt(Path(folder) / "motor.csv", np.column_stack(list(record.values())), delimiter=",", header=",".join(record), comments="", fmt="%.9g")
        dead_zone = run(folder, "flexure identify motor.csv --input voltage --output speed")
    figure, (first, second, third) = pyplot.subplots(1, 3, figsize=(11, 3.1), layout="constrained")
    friction = {name: np.array(axis["friction"][name]) for name in ("x", "y", "lower", "upper")}
    for low, high in axis["friction"]["undetermined"]:
        for edge in ("y", "lower", "upper"):
            friction[edge][(friction["x"] >= low) & (friction["x"] <= high)] = np.nan
    banded(first, friction, "friction")
    first.set(title="Friction of a robot axis (EMPS)", xlabel="velocity, m/s", ylabel="force, N")
    first.legend(loc="upper left")
    curve = circuit["nonlinearity"]
    second.plot(curve["x"], curve["y"], color=BLUE, linewidth=2)
    second.set(title="Limiter in a circuit (SYSID 2009)", xlabel="behind the first filter", ylabel="before the second filter")
    curve = dead_zone["nonlinearity"]
    third.plot(curve["x"], curve["y"], color=BLUE, linewidth=2)
    for kink in (point["at"] for point in dead_zone["breakpoints"]):
        third.axvline(kink, color=ORANGE, linewidth=1)
        third.annotate(f"{kink:.3f}", (kink, 0.93), xycoords=("data", "axes fraction"), ha="right" if kink < 0 else "left", color=ORANGE)
    third.set(title="Dead zone of a simulated motor", xlabel="voltage, V", ylabel="steady speed, rad/s")
    save(figure, "gallery")


def speed():
    """The table "Beside other programs" of the measurements as bars."""
    lines = (DOCS / "measurements.md").read_text().splitlines()
    first = lines.index("| | CPU s | ratio | error of the nonlinearity | fit on fresh data |") + 2
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines[first : first + 3]]
    figure, axes = pyplot.subplots(figsize=(8, 1.7), layout="constrained")
    names = [row[0].split(",")[0] for row in rows][::-1]
    seconds = [float(row[1]) for row in rows][::-1]
    axes.barh(names, seconds, color=[GREY] * (len(rows) - 1) + [BLUE])
    for place, row in enumerate(rows[::-1]):
        error = row[3] if row[3].endswith("curve") else f"curve's error {row[3]}"
        axes.annotate(f" {row[1]} s, {error}, fit {row[4]}", (seconds[place], place), va="center", fontsize=9)
    axes.set(xlabel="seconds of processor time", xlim=(0, 1.75 * max(seconds)))
    axes.grid(axis="y", visible=False)
    save(figure, "speed")


PICTURES = {"overview": overview, "gallery": gallery, "speed": speed}
for name in sys.argv[1:] or PICTURES:
    PICTURES[name]()
