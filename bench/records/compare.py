"""Fits the first part of measured records and judges the free run on what follows, by Flexure and by its peers, in one table.

The fit is MATLAB's: 100 (1 - |y - yh| / |y - mean y|). Every free run goes through the fitted part first. A peer is told the order that is
best on the judged part, of all that it is tried with: it is better in the table than a user would find it. Flexure is told the columns.
"""

import argparse
import json
import subprocess
import tempfile
import warnings
from pathlib import Path

import numpy as np
import pandas as pd
from nfoursid.nfoursid import NFourSID
from scipy.optimize import least_squares
from scipy.signal import lfilter

ROOT = Path(__file__).resolve().parents[2]
SPLITS = [0.5, 0.75]
ORDERS = range(1, 9)


def records(folder):
    """Name, inputs and output of every record that is there."""

    def table(name, inputs, outputs, most=None, **options):
        path = folder / name
        if not path.exists():
            print(f"{path}: not there, left out")
            return
        data = np.genfromtxt(path, **options)[:most]
        for output in outputs:
            yield (path.stem.removeprefix("daisy-").removesuffix("-estimation"), data[:, inputs], data[:, output])

    comma = {"delimiter": ",", "skip_header": 1}
    yield from table("daisy-dryer.dat", [0], [1])
    yield from table("daisy-robot-arm.dat", [0], [1])
    yield from table("daisy-exchanger-estimation.csv", [1], [2], **comma)
    yield from table("daisy-flutter-estimation.csv", [0], [1], **comma)
    yield from table("daisy-winding-estimation.csv", [0, 1, 2, 3, 4], [5, 6], **comma)
    yield from table("daisy-steam-generator.csv", [1, 2, 3, 4], [5, 6, 7, 8], **comma)
    yield from table("silverbox-train.csv", [0], [1], 8192, **comma)
    yield from table("wiener-hammerstein-2009-estimation.csv", [0], [1], 10_000, **comma)


def fit(y, predicted):
    error = np.linalg.norm(y - predicted)
    return 100 * (1 - error / np.linalg.norm(y - y.mean())) if np.isfinite(error) else -np.inf


def lagged(u, count):
    return np.column_stack([np.r_[np.zeros(k), v[: len(v) - k]] for v in u.T for k in range(count)])


def arx(u, y, fitted, order):
    """Least squares of the difference equation."""
    past = lagged(y[:fitted, None], order + 1)[:, 1:]
    columns = np.column_stack([lagged(u[:fitted], order + 1), past, np.ones(fitted)])[order:]
    c = np.linalg.lstsq(columns, y[order:fitted], rcond=None)[0]
    count = u.shape[1] * (order + 1)
    driven = lagged(u, order + 1) @ c[:count] + c[-1]
    return lfilter([1], np.r_[1, -c[count:-1]], driven)


def output_error(u, y, fitted, order):
    """SciPy's least squares of the free run, from the poles of ARX."""
    past = lagged(y[:fitted, None], order + 1)[:, 1:]
    columns = np.column_stack([lagged(u[:fitted], order + 1), past, np.ones(fitted)])[order:]
    start = np.linalg.lstsq(columns, y[order:fitted], rcond=None)[0]
    count = u.shape[1] * (order + 1)
    inputs = lagged(u, order + 1)

    def run(c):
        return lfilter([1], np.r_[1, c[count:-1]], inputs @ c[:count]) + c[-1]

    start[count:-1] *= -1
    start[-1] /= 1 + start[count:-1].sum()

    def errors(c):
        with np.errstate(all="ignore"):
            return np.clip(np.nan_to_num((run(c) - y)[order:fitted], nan=1e3), -1e3, 1e3)

    return run(least_squares(errors, start, max_nfev=60).x)


def subspace(u, y, fitted, order):
    """N4SID of nfoursid; the free run of its state space from rest."""
    names = [f"u{i}" for i in range(u.shape[1])]
    frame = pd.DataFrame(np.column_stack([u, y])[:fitted], columns=[*names, "y"])
    method = NFourSID(frame, output_columns=["y"], input_columns=names, num_block_rows=12)
    method.subspace_identification()
    system, _ = method.system_identification(rank=order)
    x, out = np.zeros((order, 1)), []
    for row in u:
        v = row[:, None]
        out.append((system.c @ x + system.d @ v).item())
        x = system.a @ x + system.b @ v
    return np.array(out)


PEERS = {"ARX": arx, "output error": output_error, "N4SID": subspace}


def best_of_orders(peer, u, y, fitted):
    fits = [-np.inf]
    for order in ORDERS:
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                fits.append(fit(y[fitted:], peer(u, y, fitted, order)[fitted:]))
        except (np.linalg.LinAlgError, ValueError):
            continue
    return max(fits)


def flexure(binary, structure, u, y, share):
    with tempfile.TemporaryDirectory() as folder:
        record = Path(folder) / "record.csv"
        names = [f"u{i}" for i in range(u.shape[1])]
        np.savetxt(record, np.column_stack([u, y]), "%.10g", ",", header=",".join([*names, "y"]), comments="")
        command = [binary, "identify", record, "--json", "--input", ",".join(names)]
        command += ["--output", "y", "--fresh", str(1 - share)]
        command += ["--structure", structure] if structure else []
        found = subprocess.run(command, capture_output=True, text=True, check=False)
        return json.loads(found.stdout)["fit_percent"] if found.returncode == 0 else np.nan


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, default=ROOT.parent / "shared/data", help="the folder of the records")
    parser.add_argument("--structures", default="linear,,auto", help="Flexure's, comma separated; nothing is the default")
    parser.add_argument("--binary", type=Path, default=ROOT / "target/release/flexure", help="the program")
    options = parser.parse_args()
    structures = options.structures.split(",")
    titles = [*PEERS, *(f"Flexure {s or 'default'}" for s in structures)]
    print(f"{'record':<26}{'fitted':>7}" + "".join(f"{t:>18}" for t in titles), flush=True)
    for name, u, y in records(options.data):
        for share in SPLITS:
            fitted = int(share * len(y))
            v = (u - u[:fitted].mean(0)) / u[:fitted].std(0)
            w = (y - y[:fitted].mean()) / y[:fitted].std()
            fits = [best_of_orders(peer, v, w, fitted) for peer in PEERS.values()]
            fits += [flexure(options.binary, structure, u, y, share) for structure in structures]
            print(f"{name:<26}{fitted:>7}" + "".join(f"{f:>18.1f}" for f in fits), flush=True)


if __name__ == "__main__":
    main()
