"""Two workers on two cores beside two threads of one process, on the same tasks of about a second; joblib and scikit-learn in turn.

    bench/cluster/run efficiency
    bench/cluster/run efficiency --rounds 5 --jobs fleet,simulate

The ways take turns, some rounds; the least of each counts. A row has the wall times in s, and the efficiencies: the time of two threads over
that of the way, by wall time, and by the processor time of all processes together. Where other work shares the machine, wall times tell
little, and the processor times still tell what a way adds. The processes of workers are up before the first round.

The two searches are the same work: 101 kernel regressions on the same rows, with the same bandwidths and folds, by scikit-learn's search.
The curves are compared before anything is timed. One estimator is Flexure's, the other scikit-learn's own, in NumPy and Cython. A last
line has the time of the latter over that of the former, in every way.
"""

import argparse
import shutil
import tempfile
from pathlib import Path

import flexure.dask
import numpy as np
from distributed import Client

import work


class Fleet:
    """Joints in a Parquet data set, one a task."""

    def __init__(self, folder, tasks):
        self.folder, self.data = Path(folder), Path(folder) / "data"
        work.write_joints(self.data, tasks, samples=10_000)
        self.tasks = sorted(self.data.glob("*/log.parquet"))
        self.one = work.of_file

    def on_workers(self, client):
        shutil.rmtree(self.folder / "results", ignore_errors=True)
        flexure.dask.identify_fleet(self.data, by="joint", model=work.identified, output=self.folder / "results", client=client)


class MonteCarlo:
    """Draws of the noise, simulated and identified, one a task."""

    def __init__(self, folder, tasks):
        self.folder, self.tasks, self.one = Path(folder), range(tasks), work.fit_percent

    def on_workers(self, client):
        shutil.rmtree(self.folder / "results", ignore_errors=True)
        seeds = {str(seed): seed for seed in self.tasks}
        flexure.dask.identify_fleet(seeds, by="seed", model=work.drawn, output=self.folder / "results", client=client)


class Batch:
    """Simulations of the arm, so many a task as `flexure.dask.simulate_batch` takes."""

    def __init__(self, folder, tasks):
        self.arm = work.arm(2500)
        instants = 2500
        self.torques = np.random.default_rng(1).normal(0, 10, (8 * work.CORES * 60, instants, 2)).cumsum(axis=1) / 30
        self.tasks = np.split(self.torques, 8 * work.CORES)
        self.one = self.arm.simulate_batch

    def in_threads(self):
        """The library's own threads."""
        self.arm.simulate_batch(self.torques)

    def on_workers(self, client):
        flexure.dask.simulate_batch(self.arm, self.torques, client=client)


class Search:
    """Searches of a bandwidth, one a task, with this estimator."""

    def __init__(self, one, tasks):
        self.tasks, self.one = range(tasks), one

    def on_workers(self, client):
        client.gather([client.submit(self.one, seed, pure=False) for seed in self.tasks])


def by_flexure(folder, tasks):
    (bandwidth, curve), (other, its_curve) = (one(0) for one in (work.searched_by_flexure, work.searched_by_scikit_learn))
    assert bandwidth == other and np.allclose(curve, its_curve, rtol=0, atol=1e-12), "the two searches are not the same work"
    return Search(work.searched_by_flexure, tasks)


def by_scikit_learn(folder, tasks):
    return Search(work.searched_by_scikit_learn, tasks)


SEARCHES = "search, Flexure", "search, sklearn"
JOBS = {"fleet of joints": Fleet, "Monte Carlo": MonteCarlo, "simulate_batch": Batch, SEARCHES[0]: by_flexure, SEARCHES[1]: by_scikit_learn}


WAYS = {
    "2 threads": lambda job, client: job.in_threads() if hasattr(job, "in_threads") else work.in_threads(job.one, job.tasks),
    "2 workers": lambda job, client: job.on_workers(client),
    "joblib": lambda job, client: work.by_joblib(job.one, job.tasks),
    "joblib on Dask": lambda job, client: work.by_joblib_on_dask(job.one, job.tasks),
}


def least_times(job, client, rounds):
    """The least wall and processor times of every way, taken in turn; the first call of each is not counted."""
    least = {name: (np.inf, np.inf) for name in WAYS}
    for count in range(rounds + 1):
        for name, run in WAYS.items():
            times = work.timed(lambda: run(job, client))
            if count:
                least[name] = tuple(map(min, least[name], times))
    return least


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--tasks", type=int, default=12)
    parser.add_argument("--jobs", default="", help="the beginnings of the jobs' names, with commas; all")
    given = parser.parse_args()
    wanted = tuple(given.jobs.split(","))
    measured = {}
    print(f"{'job':<16}{'tasks':>6}{'CPU s a task':>13}" + "".join(f"{name:>16}" for name in WAYS) + "   efficiency by wall, by processor: 2 workers, joblib, joblib on Dask")
    with work.cluster() as workers, Client(workers, direct_to_workers=True) as client:
        for name, make in JOBS.items():
            if not name.startswith(wanted):
                continue
            with tempfile.TemporaryDirectory() as folder:
                job = make(folder, given.tasks)
                least = least_times(job, client, given.rounds)
            measured[name] = least
            (wall, cpu), *others = least.values()
            ratios = [", ".join(f"{100 * own / other[k]:.0f} %" for other in others) for k, own in enumerate((wall, cpu))]
            print(f"{name:<16}{len(job.tasks):>6}{cpu / len(job.tasks):>13.2f}" + "".join(f"{t:>16.2f}" for t, _ in least.values()) + f"   {'; '.join(ratios)}", flush=True)
    if all(name in measured for name in SEARCHES):
        own, other = (measured[name] for name in SEARCHES)
        ratios = [", ".join(f"{way} {other[way][k] / own[way][k]:.1f}" for way in WAYS) for k in range(2)]
        print(f"scikit-learn over Flexure by wall: {ratios[0]}; by processor: {ratios[1]}")


if __name__ == "__main__":
    main()
