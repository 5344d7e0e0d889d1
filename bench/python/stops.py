"""How long long work goes on after Ctrl-C: in Python until KeyboardInterrupt, in the program until the process has ended.

    python bench/python/stops.py                          all jobs, against the installed package and the program on the PATH
    python bench/python/stops.py --program target/release/flexure --only spline,joint

Every job is interrupted at several moments of its course. A row says the longest time to the end: by the clock, and in processor time of
all threads, which other load on the machine does not lengthen. The aim is 0.3 s.
"""

import argparse
import os
import pathlib
import signal
import subprocess
import tempfile
import threading
import time

import numpy as np

import flexure

AIM = 0.3
MOMENTS = (0.05, 0.2, 0.6, 1.5, 4.0)
RANDOM = np.random.default_rng(1)


def curve(n, columns=1):
    x = RANDOM.uniform(-2, 2, (n, columns))
    return x, np.tanh(x.sum(axis=1)) + 0.1 * RANDOM.normal(size=n)


def record(n):
    u = RANDOM.normal(size=n)
    return u, np.convolve(np.tanh(2 * u), [0.5, 0.3, 0.1])[:n] + 0.01 * RANDOM.normal(size=n)


def python_jobs():
    """The jobs by name: functions that make their data, and then the work itself."""

    def fit(estimator, n, columns=1):
        def prepared():
            x, y = curve(n, columns)
            return lambda: estimator.fit(x, y)

        return prepared

    def band(estimator):
        def prepared():
            fitted = estimator.fit(*curve(200_000))
            at = np.linspace(-2, 2, 200)[:, None]
            return lambda: fitted.predict(at, return_band=0.95, band_method="bootstrap")

        return prepared

    def export():
        model = flexure.Hammerstein().fit(*record(2000))
        folder = tempfile.mkdtemp()

        def work():
            while True:
                model.export("c", os.path.join(folder, "model.c"))

        return work

    def system(estimator, n):
        def prepared():
            u, y = record(n)
            return lambda: estimator.fit(u, y)

        return prepared

    many = 3_000_000
    return {
        "spline": fit(flexure.SplineRegressor(), many),
        "series": fit(flexure.SeriesRegressor(), many),
        "kernel": fit(flexure.KernelRegressor(), many),
        "kernel, Gaussian": fit(flexure.KernelRegressor(kernel="gaussian"), many),
        "nearest neighbours": fit(flexure.KNNRegressor(), many),
        "nearest neighbours, 3 columns": fit(flexure.KNNRegressor(), 300_000, 3),
        "band of a kernel": band(flexure.KernelRegressor(bandwidth=0.1)),
        "band of a spline": band(flexure.SplineRegressor(penalty=1e-3)),
        "band of a series": band(flexure.SeriesRegressor()),
        "Hammerstein": system(flexure.Hammerstein(), 1_000_000),
        "Auto": system(flexure.Auto(), 100_000),
        "chain": lambda: lambda: flexure.Chain.preset("seven-joint-arm").simulate(1000.0, 0.01),
        "export": export,
    }


def stop_python(work, moment):
    """Seconds by the clock and of the processor until KeyboardInterrupt; None where the work ended before."""
    begun = []

    def interrupt():
        begun.extend([time.monotonic(), time.process_time()])
        os.kill(os.getpid(), signal.SIGINT)

    timer = threading.Timer(moment, interrupt)
    try:
        timer.start()
        work()
        timer.cancel()
        timer.join()
        time.sleep(0.1)  # The interrupt may have come just now.
        return None
    except KeyboardInterrupt:
        if not begun:
            raise  # The user's own.
        clock = time.monotonic() - begun[0]
        # Until no thread works any more.
        before = -1.0
        while time.process_time() - before > 0.002:
            before = time.process_time()
            time.sleep(0.1)
        return clock, before - begun[1]


PROGRAM = {
    "prepare": "prepare long.csv --low-pass 5 --resample 0.003 -o out.csv",
    "look": "look long.csv",
    "identify": "identify long.csv --input u --output y -o out.json",
    "auto": "identify log.csv --input u --output y --structure auto",
    "regress": "regress long.csv --x u --y y --grid 2000 -o out.csv",
    "surface": "regress log.csv --x u,t --y y --grid 1000 -o out.csv",
    "joint": "joint log.csv --position y --torque u --arm out.toml",
    "fleet": "fleet log.csv --by k --input u --output y -o results",
    "excite": "excite --preset space-arm --max-torque 40,20 -o out.csv",
    "simulate": "simulate --preset seven-joint-arm --duration 1000 --sample-time 0.01 -o out.csv",
    "study": "study rates",
    "demo": "demo --no-open --out demo",
}


def write(path, n):
    u, y = record(n)
    rows = np.column_stack([0.01 * np.arange(n), u, y, np.arange(n) % 8])
    np.savetxt(path, rows, delimiter=",", header="t,u,y,k", comments="", fmt=["%.2f", "%.5f", "%.5f", "%d"])


def stop_program(program, arguments, folder, moment):
    child = subprocess.Popen(
        [program, *arguments.split(" ")],
        cwd=folder,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        # A shell may have set the signal to be ignored.
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )
    try:
        child.wait(moment)
        return None
    except subprocess.TimeoutExpired:
        begun = time.monotonic()
        child.send_signal(signal.SIGINT)
        child.wait()
    left = [path.name for path in pathlib.Path(folder).rglob("*.tmp")]
    if left:
        raise SystemExit(f"{arguments} leaves {left}")
    return time.monotonic() - begun, float("nan")


def row(name, stop, *of):
    found = []
    for moment in MOMENTS:
        times = stop(*of, moment)
        if times is None:
            break
        found.append(times)
    if not found:
        print(f"{name:32s} ends by itself before {MOMENTS[0]} s", flush=True)
        return
    clock, processor = (max(column) for column in zip(*found, strict=True))
    of_processor = "" if processor != processor else f", {processor:6.3f} s of the processor"
    print(f"{name:32s} {len(found)} interrupts, at most {clock:6.3f} s by the clock{of_processor}", flush=True)


def main():
    options = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    options.add_argument("--program", default="flexure")
    options.add_argument("--only", help="names of jobs, separated by commas")
    given = options.parse_args()
    only = given.only.split(",") if given.only else None
    program = str(pathlib.Path(given.program).absolute()) if os.sep in given.program else given.program
    signal.signal(signal.SIGINT, signal.default_int_handler)
    print(f"aim: {AIM} s\nPython")
    for name, prepared in python_jobs().items():
        if only is None or name in only:
            work = prepared()
            row(name, stop_python, work)
    print("program")
    with tempfile.TemporaryDirectory() as folder:
        write(pathlib.Path(folder) / "log.csv", 20_000)
        write(pathlib.Path(folder) / "long.csv", 1_000_000)
        for name, arguments in PROGRAM.items():
            if only is None or name in only:
                row(name, stop_program, program, arguments, folder)


if __name__ == "__main__":
    main()
