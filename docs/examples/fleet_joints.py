import json
from pathlib import Path
from statistics import NormalDist

import flexure
import flexure.dask
import numpy as np

# What is read off a joint's curves: the curve, and where.
CURVES = {"stiffness": ("secant_stiffness", 0.02), "friction": ("friction", 0.15)}


def identified(log):
    return flexure.identify_joint("tau2", motor="qm2", link="q2", data=log)


def parameters(joint):
    """Value and standard error of each parameter of a joint."""
    found = {name: (joint[name]["value"], joint[name]["standard_error"]) for name in ("motor_inertia", "link_inertia")}
    for name, (curve, at) in CURVES.items():
        curve = joint[curve]
        found[name] = tuple(np.interp(at, curve["x"], curve[key]) for key in ("y", "standard_error"))
    return found


def deviations(value, error):
    """Every joint's distance from the median in standard deviations: those of the fleet and of the joint's own error."""
    off = value - np.median(value)
    # The MAD has the spread of the joints and their errors.
    fleet = max((1.4826 * np.median(abs(off))) ** 2 - np.median(error) ** 2, 0)
    return off / np.sqrt(fleet + error**2)


if __name__ == "__main__":
    flexure.dask.identify_fleet("joints/", by="joint", model=identified, output="results")
    models = {path.stem: parameters(json.loads(path.read_text())) for path in sorted(Path("results/models").glob("*.json"))}
    names = list(next(iter(models.values())))
    # The chance of any outlier in a fleet that has none is 1 %.
    limit = NormalDist().inv_cdf(1 - 0.01 / 2 / (len(names) * len(models)))
    print(f"{len(models)} joints; an outlier is {limit:.2f} standard deviations off")
    table = {"joint": np.array([float(key) for key in models])}
    for name in names:
        value, error = np.array([model[name] for model in models.values()]).T
        off = deviations(value, error)
        table |= {name: value, f"{name}_error": error, f"{name}_off": off}
        for key, joint, own, by in zip(models, value, error, off):
            if abs(by) > limit:
                print(f"joint {key}: {name} {joint:.4g} ± {own:.2g}, {by:+.1f} standard deviations from the median {np.median(value):.4g}")
    np.savetxt("fleet.csv", np.column_stack(list(table.values())), delimiter=",", header=",".join(table), comments="")
