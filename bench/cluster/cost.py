"""What many workers cost, from what two cost: nanoseconds a sample, bytes a task on the network, bytes a sample read, memory of a worker.

    bench/cluster/run cost
    bench/cluster/run cost --workers 64 --samples 1e11 --jobs regression

Each job runs on two workers of one thread each, on a part of the record. Formulas:

    time     = samples x (processor time / samples measured) / workers
    network  = tasks x (bytes over the loopback device / tasks measured)
    memory   = the largest resident set of a worker

The processor time is that of all processes, with reading, scheduling and merging. The loopback device carries all messages between client, scheduler and workers,
and those of whatever else runs on this machine.
"""

import argparse
import tempfile
from pathlib import Path

import dask.dataframe
import flexure.dask
import numpy as np
import psutil
from distributed import Client

import work


def peak_memory():
    """Of a worker, in bytes. `getrusage` would count what its parent process had."""
    peak = next(line for line in Path("/proc/self/status").read_text().splitlines() if line.startswith("VmHWM:"))
    return int(peak.split()[1]) * 1024


def measured(client, run):
    """Processor seconds, bytes on the loopback device, and the largest resident set of a worker in bytes."""
    sent = psutil.net_io_counters(pernic=True)["lo"].bytes_sent
    _, seconds = work.timed(run)
    sent = psutil.net_io_counters(pernic=True)["lo"].bytes_sent - sent
    return seconds, sent, max(client.run(peak_memory).values())


def fleet(client, folder, tasks, samples):
    """A joint a task."""
    size = work.write_joints(folder / "fleet", tasks, samples)

    def run():
        flexure.dask.identify_fleet(folder / "fleet", by="joint", model=work.identified, output=folder / "results", client=client)

    return size, *measured(client, run)


def regression(client, folder, tasks, samples):
    """A partition a task."""
    size = work.write_joints(folder / "log", tasks, samples)
    frame = dask.dataframe.read_parquet(sorted((folder / "log").rglob("*.parquet")), columns=["q2", "tau2"])

    def run():
        flexure.dask.regress(frame, x="q2", y="tau2", client=client)

    return size * 2 // 3, *measured(client, run)


def system(client, folder, tasks, samples):
    """A Hammerstein system from a record in shards, one a task in every step."""
    import dask.array

    for part in range(tasks):
        np.save(folder / f"{part}.npy", np.stack(work.hammerstein(part, samples)))

    def column(which):
        parts = [dask.delayed(np.load)(folder / f"{part}.npy")[which] for part in range(tasks)]
        return dask.array.concatenate([dask.array.from_delayed(part, (samples,), float) for part in parts])

    def run():
        flexure.dask.identify(column(0), column(1), client=client)

    return 16 * tasks * samples, *measured(client, run)


# Name: how, the tasks and the samples of each that are measured, and the samples of each of all tasks.
JOBS = {
    "joints, one a task": (fleet, 1, 1_000_000, 1_000_000),
    "regression, a partition a task": (regression, 4, 1_000_000, 1_000_000),
    "Hammerstein system, a shard a task": (system, 4, 1_000_000, 1_000_000),
}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--samples", type=float, default=1e10)
    parser.add_argument("--workers", type=int, default=32)
    parser.add_argument("--rounds", type=int, default=1, help="the least of so many measurements counts")
    parser.add_argument("--jobs", default="", help="the beginnings of the jobs' names, with semicolons; all")
    given = parser.parse_args()
    columns = ["ns a sample", "B a sample read", "kB a task sent", "MB a worker", "hours", "GB read", "GB sent", "MB/s read"]
    print(f"{'job':<40}" + "".join(f"{name:>17}" for name in columns))
    for name, (run, tasks, samples, of_each) in JOBS.items():
        if not name.startswith(tuple(given.jobs.split(";"))):
            continue
        rounds = []
        for _ in range(given.rounds):
            # Workers start anew, so that the memory is that of one job.
            with tempfile.TemporaryDirectory() as folder, work.cluster() as workers, Client(workers) as client:
                rounds.append(run(client, Path(folder), tasks, samples))
        size, seconds, sent, memory = (min(values) for values in zip(*rounds))
        done = tasks * samples
        ns = 1e9 * seconds / done
        all_tasks = given.samples / of_each
        total = given.samples * ns * 1e-9 / given.workers
        read = given.samples * size / done
        row = [ns, size / done, sent / tasks / 1e3, memory / 1e6, total / 3600, read / 1e9, all_tasks * sent / tasks / 1e9, read / total / 1e6]
        print(f"{name:<40}" + "".join(f"{value:>17.3g}" for value in row), flush=True)


if __name__ == "__main__":
    main()
