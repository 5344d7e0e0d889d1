"""The work that is timed, and the ways to do it on two cores."""

import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import flexure
import flexure.dask
import joblib
import numpy as np
import psutil
from distributed import LocalCluster
from sklearn.model_selection import GridSearchCV, KFold
from sklearn.neighbors import RadiusNeighborsRegressor

CORES = 2
# Samples that are identified in about a second.
MONTE_CARLO = 200_000
# Rows among which scikit-learn finds a bandwidth in some seconds.
SEARCHED = 2000


def cluster():
    """Two worker processes of one thread each, as `flexure.dask` wants them."""
    return LocalCluster(n_workers=CORES, threads_per_worker=1, dashboard_address=":0")


def processor_times():
    """Seconds on the processor so far by process: this one, and all that it has started."""
    own = psutil.Process()
    seconds = {}
    for process in [own, *own.children(recursive=True)]:
        try:
            times = process.cpu_times()
            seconds[process.pid] = times.user + times.system
        except psutil.NoSuchProcess:
            pass
    return seconds


def timed(run):
    """Wall time and processor time of a call, in s."""
    before, begun = processor_times(), time.perf_counter()
    run()
    wall = time.perf_counter() - begun
    return wall, sum(seconds - before.get(pid, 0) for pid, seconds in processor_times().items())


def arm(samples):
    """The elbow of the space arm under a multisine, with noise; the shoulder is locked."""
    return flexure.Arm.preset("space-arm").with_(
        duration=0.002 * (samples - 1),
        dt=0.002,
        joints=[{"locked": True}, {}],
        excitation={"kind": "multisine", "amplitude": [40.0, 20.0], "f_min": 0.05, "f_max": 3.0},
        noise={"std": {"tau2": 0.2, "q2": 1e-5, "qm2": 1e-5}},
    )


def write_joints(folder, count, samples):
    """A data set with a folder a joint, each with a draw of the noise; the number of its bytes."""
    import pyarrow
    from pyarrow import parquet

    torque = arm(samples).simulate()
    drive = np.stack([torque["tau1"], torque["tau2"]], axis=1)
    for joint in range(count):
        (log,) = arm(samples).simulate_batch([drive], first=joint)
        path = Path(folder) / f"joint={joint:04d}" / "log.parquet"
        path.parent.mkdir(parents=True)
        parquet.write_table(pyarrow.table({name: log[name] for name in ("tau2", "q2", "qm2")}), path)
    return sum(path.stat().st_size for path in Path(folder).rglob("*.parquet"))


def identified(log):
    """A joint from its log."""
    return flexure.identify_joint(log["tau2"], motor=log["qm2"], link=log["q2"], dt=0.002)


def of_file(path):
    return identified(flexure.read(path)).inertia.value


def hammerstein(seed, samples):
    """Input and output of a saturation before a system of order 2, with noise."""
    from scipy.signal import lfilter

    rng = np.random.default_rng(seed)
    u = rng.uniform(-2, 2, samples)
    return u, lfilter([0, 0.2, 0.15], [1, -1.2, 0.55], np.clip(u, -1, 0.6)) + 0.05 * rng.normal(size=samples)


def drawn(seed):
    """A run of a Monte Carlo study: a Hammerstein system with noise of its own, identified."""
    return flexure.Hammerstein().fit(*hammerstein(seed, MONTE_CARLO))


def fit_percent(seed):
    return drawn(seed).verdict_.fit_percent


class NadarayaWatson(RadiusNeighborsRegressor):
    """scikit-learn's regression on the neighbours within a radius, with weights of Epanechnikov: the estimator of `flexure.KernelRegressor(0)`."""

    def __init__(self, bandwidth=1.0):
        super().__init__(weights=self.epanechnikov)
        self.bandwidth = bandwidth

    def fit(self, X, y):
        self.radius = self.bandwidth
        return super().fit(X, y)

    def epanechnikov(self, distances):
        weights = np.empty(len(distances), dtype=object)
        for place, d in enumerate(distances):
            weights[place] = 1 - (d / self.bandwidth) ** 2
        return weights


def searched(estimator, seed):
    """A bandwidth out of 20 by the error of 5 folds, and the curve with it: 101 fits, by scikit-learn's search for both estimators."""
    rng = np.random.default_rng(seed)
    x = rng.uniform(-2, 2, (SEARCHED, 1))
    y = np.sin(2 * x[:, 0]) + 0.1 * rng.normal(size=SEARCHED)
    search = GridSearchCV(estimator, {"bandwidth": np.geomspace(0.02, 0.5, 20)}, cv=KFold(5), scoring="neg_mean_squared_error")
    # Within joblib on Dask, every fit, and every look for neighbours, would else be a task of its own.
    with joblib.parallel_config(backend="sequential"):
        found = search.fit(x, y)
        return found.best_params_["bandwidth"], found.predict(np.linspace(-1.9, 1.9, 100)[:, None])


def searched_by_flexure(seed):
    return searched(flexure.KernelRegressor(0), seed)


def searched_by_scikit_learn(seed):
    return searched(NadarayaWatson(), seed)


def in_threads(one, tasks):
    with ThreadPoolExecutor(CORES) as pool:
        return list(pool.map(one, tasks))


def by_joblib(one, tasks):
    return joblib.Parallel(n_jobs=CORES)(joblib.delayed(one)(task) for task in tasks)


def by_joblib_on_dask(one, tasks):
    with joblib.parallel_config(backend="dask"):
        return by_joblib(one, tasks)
