"""Workers that are killed while they work, that join late or run out of memory, and a client that is killed: the result is that of a quiet run."""

import json
import os
import signal
import subprocess
import sys
import threading
import time
from contextlib import contextmanager
from functools import partial
from pathlib import Path

import numpy as np
import pytest

import flexure
from test_dask import KEYS, correlated, distributed, in_chunks, long_record, numbers, of_plant, parquet, record, rows

import dask  # noqa: I001
import dask.array
import flexure.dask
import flexure._shards

# How long to wait for what must happen; machines under load are slow.
PATIENCE = 300


def until(happened, what):
    end = time.monotonic() + PATIENCE
    while not (found := happened()):
        assert time.monotonic() < end, f"{what} did not happen in {PATIENCE} s"
        time.sleep(0.02)
    return found


def note(log):
    """Adds the process's id to a list."""
    with log.open("a") as file:
        file.write(f"{os.getpid()}\n")


def noted(log):
    """The ids so far."""
    return [int(line) for line in log.read_text().split()] if log.exists() else []


def stay_until_killed(log):
    """The first call stays until its process is killed; later ones go on."""
    note(log)
    if len(noted(log)) == 1:
        time.sleep(PATIENCE)
        raise TimeoutError("nobody has killed this process")


class Trap:
    """Samples whose first conversion to an array, which is within a task of Flexure, stays until its process is killed."""

    def __init__(self, values, log):
        self.values, self.log = values, log

    def __len__(self):
        return len(self.values)

    def __getitem__(self, places):
        return self.values[places]

    def __array__(self, dtype=None, copy=None):
        stay_until_killed(self.log)
        return np.asarray(self.values, dtype)


@contextmanager
def cluster(workers=2, settings=None, **options):
    with (
        dask.config.set(settings or {}),
        distributed.LocalCluster(n_workers=workers, threads_per_worker=1, dashboard_address=":0", **options) as processes,
        distributed.Client(processes) as client,
    ):
        yield client


@contextmanager
def killed(logs):
    """Kills the process of every trap while it is in there, and checks that all of these tasks were started again."""

    def kill():
        for log in logs:
            os.kill(until(lambda log=log: noted(log), f"a task in {log.name}")[0], signal.SIGKILL)

    killer = threading.Thread(target=kill)
    killer.start()
    yield
    killer.join()
    for log in logs:
        first, *later = noted(log)
        assert later and first not in later
        # The process that had the task is gone.
        with pytest.raises(ProcessLookupError):
            os.kill(first, 0)


@pytest.fixture(scope="module")
def plants():
    return {key: record(i, broken=key == "p05") | {"key": key} for i, key in enumerate(KEYS)}


@pytest.fixture(scope="module")
def quiet(plants, tmp_path_factory):
    """The folder of a run in which nothing goes wrong."""
    folder = tmp_path_factory.mktemp("quiet") / "r"
    with cluster() as client:
        flexure.dask.identify_fleet(plants, by="plant", model=of_plant, output=folder, client=client)
    return folder


def assert_same(folder, other):
    """The same rows and models, bit for bit."""
    assert rows(folder / "table.parquet") == rows(other / "table.parquet")
    models, others = ({path.name: path.read_bytes() for path in (f / "models").iterdir()} for f in (folder, other))
    assert models == others and len(models) == 11


def trapped(folder, traps, record):
    if record["key"] in traps:
        stay_until_killed(folder / record["key"])
    return of_plant(record)


def test_a_fleet_outlives_workers_that_are_killed_at_work(plants, quiet, tmp_path):
    traps = ["p02", "p08"]
    with cluster() as client, killed([tmp_path / key for key in traps]):
        model = partial(trapped, tmp_path, traps)
        flexure.dask.identify_fleet(plants, by="plant", model=model, output=tmp_path / "r", client=client)
    assert_same(tmp_path / "r", quiet)


def drawn(folder, seed):
    """A run of a Monte Carlo study."""
    if seed in (1, 4):
        stay_until_killed(folder / str(seed))
    return flexure.Hammerstein().fit(*long_record(2000, seed))


def test_a_monte_carlo_study_outlives_workers_that_are_killed_at_work(tmp_path):
    seeds = {str(seed): seed for seed in range(6)}
    with cluster() as client, killed([tmp_path / "1", tmp_path / "4"]):
        table = flexure.dask.identify_fleet(seeds, by="seed", model=partial(drawn, tmp_path), output=tmp_path / "r", client=client)
    for row, seed in zip(rows(table), range(6), strict=True):
        own = flexure.Hammerstein().fit(*long_record(2000, seed))
        assert (row["status"], row["fit_percent"], row["rms"]) == ("done", own.verdict_.fit_percent, own.verdict_.rms)


def with_traps(values, chunk, logs):
    """A dask array with a trap in every one of the chunks that `logs` numbers."""
    parts = [values[k : k + chunk] for k in range(0, len(values), chunk)]
    blocks = [dask.delayed(Trap)(part, logs[k]) if k in logs else dask.delayed(part) for k, part in enumerate(parts)]
    return dask.array.concatenate([dask.array.from_delayed(block, (len(part),), float) for block, part in zip(blocks, parts, strict=True)])


def test_a_regression_outlives_workers_that_are_killed_at_work(tmp_path):
    x, y = correlated(20_000)
    logs = {3: tmp_path / "3", 7: tmp_path / "7"}
    of_x, of_y = in_chunks((x, y), 2000)
    with cluster() as client:
        with killed(list(logs.values())):
            found = flexure.dask.regress(None, x=with_traps(x, 2000, logs), y=of_y, client=client)
        whole = flexure.dask.regress(None, x=of_x, y=of_y, client=client)
    assert found.to_bytes() == whole.to_bytes()
    at = np.linspace(-1.9, 1.9, 39)
    np.testing.assert_allclose(found.predict(at), flexure.StreamedKernelRegressor().fit(x, y).predict(at), rtol=1e-10, atol=1e-10)


def test_a_system_of_shards_outlives_workers_that_are_killed_at_work(tmp_path):
    u, y = long_record(40_000)
    logs = {3: tmp_path / "3", 6: tmp_path / "6"}
    of_u, of_y = in_chunks((u, y), 4000)
    with cluster() as client:
        with killed(list(logs.values())):
            found = flexure.dask.identify(with_traps(u, 4000, logs), of_y, excerpt=10_000, client=client)
        whole = flexure.dask.identify(of_u, of_y, excerpt=10_000, client=client)
    np.testing.assert_allclose(numbers(found), numbers(whole), rtol=1e-10, atol=1e-10)
    assert found.samples_ == whole.samples_


def test_simulations_outlive_workers_that_are_killed_at_work(tmp_path):
    arm = flexure.Arm.preset("motor-log").with_(duration=0.5)
    torques = list(np.random.default_rng(4).normal(size=(8, round(arm.duration / arm.dt) + 1, 2)))
    logs = [tmp_path / "3", tmp_path / "6"]
    with_trap = [Trap(torque, tmp_path / str(k)) if k in (3, 6) else torque for k, torque in enumerate(torques)]
    with cluster() as client, killed(logs):
        found = flexure.dask.simulate_batch(arm, with_trap, client=client)
    for a, b in zip(arm.simulate_batch(torques), found, strict=True):
        assert a.keys() == b.keys() and all(np.array_equal(a[name], b[name]) for name in a)


def kills_its_worker(record):
    if record["key"] == "p03":
        os.kill(os.getpid(), signal.SIGKILL)
    return of_plant(record)


def greedy(record):
    held = []
    while record["key"] == "p03":
        held.append(np.ones(4_000_000))
        time.sleep(0.05)
        assert len(held) < 200, "nobody has ended this process"
    return of_plant(record)


@pytest.mark.parametrize("model", [kills_its_worker, greedy])
def test_a_record_that_kills_its_workers_has_its_error_and_the_others_go_on(model, plants, quiet, tmp_path):
    some = {key: plants[key] for key in KEYS[:6]}
    # At the first death, all records on that worker are blamed: those that are not at fault have to be found out.
    with cluster(settings={"distributed.scheduler.allowed-failures": 0}, memory_limit="800MB") as client:
        table = flexure.dask.identify_fleet(some, by="plant", model=model, output=tmp_path / "r", client=client)
    found, others = rows(table), rows(quiet / "table.parquet")[:6]
    row = found.pop(3)
    others.pop(3)
    assert (row["plant"], row["status"]) == ("p03", "failed")
    assert "every worker that had this record alone has died (1 tried); most likely it needs more memory" in row["error"]
    assert found == others


def gated(folder, record):
    """From the record p06 on, stays until the gate is open."""
    note(folder / record["key"])
    if record["key"] >= "p06":
        until((folder / "gate").exists, "the gate")
    return of_plant(record)


CLIENT = """
import sys
from functools import partial
from pathlib import Path
import distributed, flexure.dask
from test_workers import KEYS, gated, record
if __name__ == "__main__":
    address, folder, output = sys.argv[1:]
    plants = {key: record(i, broken=key == "p05") | {"key": key} for i, key in enumerate(KEYS)}
    with distributed.Client(address) as client:
        flexure.dask.identify_fleet(plants, by="plant", model=partial(gated, Path(folder)), output=output, client=client)
"""


def process(script, *arguments):
    """Another process of Python, which can import this file."""
    paths = {"PYTHONPATH": os.pathsep.join([str(Path(__file__).parent), os.environ.get("PYTHONPATH", "")])}
    return subprocess.Popen([sys.executable, "-c", script, *map(str, arguments)], env=os.environ | paths)


def test_a_client_that_is_killed_goes_on_when_it_is_started_again(quiet, tmp_path):
    done = tmp_path / "r" / "rows"
    with cluster() as workers:
        address = workers.scheduler_info()["address"]
        first = process(CLIENT, address, tmp_path, tmp_path / "r")
        until(lambda: done.is_dir() and len(list(done.glob("*.json"))) == 6, "six rows")
        # It is at work: records wait at the gate.
        until(lambda: noted(tmp_path / "p06"), "a record at the gate")
        assert first.poll() is None
        first.kill()
        assert first.wait() == -signal.SIGKILL and not (tmp_path / "r" / "table.parquet").exists()
        (tmp_path / "gate").touch()
        assert process(CLIENT, address, tmp_path, tmp_path / "r").wait(PATIENCE) == 0
        # Again, when all is done.
        assert process(CLIENT, address, tmp_path, tmp_path / "r").wait(PATIENCE) == 0
    assert_same(tmp_path / "r", quiet)
    # What was done was not done again; the broken record is tried again every time.
    assert [len(noted(tmp_path / key)) for key in KEYS[:6]] == [1, 1, 1, 1, 1, 3]
    assert all(len(noted(tmp_path / key)) in (1, 2) for key in KEYS[6:])


LATE = """
import asyncio, sys
from distributed import Worker
import flexure._cluster
flexure._cluster.version = lambda: "0.0.1"
async def work():
    async with Worker(sys.argv[1], nthreads=1) as worker:
        await worker.finished()
asyncio.run(work())
"""


def waiting(folder, record):
    """The first record stays until the gate is open."""
    note(folder / record["key"])
    if record["key"] == "p00":
        until((folder / "gate").exists, "the gate")
    return of_plant(record)


def test_a_worker_of_another_version_that_joins_late_is_refused(plants, quiet, tmp_path):
    late = []
    with cluster(workers=1) as client:
        address = client.scheduler_info()["address"]

        def join():
            until(lambda: noted(tmp_path / "p00"), "the first task")
            late.append(process(LATE, address))

        joining = threading.Thread(target=join)
        joining.start()
        run = partial(flexure.dask.identify_fleet, plants, by="plant", model=partial(waiting, tmp_path), output=tmp_path / "r", client=client)
        try:
            with pytest.raises(flexure.FlexureError, match=rf"worker tcp://\S+ has Flexure 0\.0\.1, but this is {flexure.__version__}; install"):
                run()
        finally:
            (tmp_path / "gate").touch()
            joining.join()
            late[0].kill()
            late[0].wait()
        run()
    assert_same(tmp_path / "r", quiet)


class Counted(Trap):
    """Samples whose conversions to an array are counted."""

    def __array__(self, dtype=None, copy=None):
        note(self.log)
        return np.asarray(self.values, dtype)


def read_at_the_third_time(values, log):
    note(log)
    if len(noted(log)) < 3:
        raise OSError("the network is down")
    return values


def test_only_reading_is_tried_again(tmp_path):
    x, y = correlated(5000)
    broken = y.copy()
    broken[3456] = np.nan
    (of_x,) = in_chunks((x,), 5000)
    counted = dask.array.from_delayed(dask.delayed(Counted)(broken, tmp_path / "sums"), (5000,), float)
    read = dask.array.from_delayed(dask.delayed(read_at_the_third_time)(y, tmp_path / "read"), (5000,), float)
    with cluster() as client:
        with pytest.raises(flexure.DataError, match="sample 3456"):
            flexure.dask.regress(None, x=of_x, y=counted, client=client)
        found = flexure.dask.regress(None, x=of_x, y=read, client=client)
    assert len(noted(tmp_path / "sums")) == 1 and len(noted(tmp_path / "read")) == 3
    assert found.to_bytes() == flexure.StreamedKernelRegressor().fit(x, y).to_bytes()


def most_memory():
    """The largest resident set of this process, in bytes."""
    lines = Path("/proc/self/status").read_text().splitlines()
    return 1024 * int(next(line for line in lines if line.startswith("VmHWM:")).split()[1])


def test_what_would_fill_a_worker_is_refused_before_it_is_read(plants, quiet, tmp_path):
    import pyarrow

    for key in KEYS[:2]:
        path = tmp_path / "data" / f"plant={key}" / "part.parquet"
        path.parent.mkdir(parents=True)
        table = {name: plants[key][name] for name in "uy"} if key == "p00" else {name: np.zeros(8_000_000) for name in "uy"}
        parquet.write_table(pyarrow.table(table), path)
    unwatched = {f"distributed.worker.memory.{name}": False for name in ("target", "spill", "pause", "terminate")}
    with cluster(workers=1, settings=unwatched, memory_limit="200MB") as client:
        (before,) = client.run(most_memory).values()
        table = flexure.dask.identify_fleet(tmp_path / "data", by="plant", model=of_plant, output=tmp_path / "r", client=client)
        good, bad = rows(table)
        assert good == {name: rows(quiet / "table.parquet")[0][name] for name in good}
        assert "8000000 rows and 2 columns takes 128 MB, more than half of the 200 MB of a worker's thread; give the workers more" in bad["error"]
        long = dask.array.zeros(8_000_000, chunks=8_000_000)
        for run in (flexure.dask.identify, partial(flexure.dask.regress, None)):
            arrays = {"u": long, "y": long} if run is flexure.dask.identify else {"x": long, "y": long}
            with pytest.raises(flexure.DataError, match="a chunk of 8000000 samples of two arrays takes 128 MB, .*; rechunk to less"):
                run(**arrays, client=client)
        (after,) = client.run(most_memory).values()
    assert after - before < 64e6


def test_long_chunks_are_cut(monkeypatch):
    u, y = in_chunks(long_record(40_000), 20_000)
    with cluster() as client:
        whole = flexure.dask.identify(u, y, excerpt=10_000, client=client)
        monkeypatch.setattr(flexure._shards, "MOST_SAMPLES", 3000)
        assert len(flexure._shards.Shards(u, y, 10_000, 0.05).sums("", 1)) == 14
        cut = flexure.dask.identify(u, y, excerpt=10_000, client=client)
    np.testing.assert_allclose(numbers(cut), numbers(whole), rtol=1e-10, atol=1e-10)
    assert cut.samples_ == whole.samples_


def test_a_fleet_that_was_begun_says_with_what(quiet):
    assert json.loads((quiet / "fleet.json").read_text()) == {"by": "plant", "name": "", "version": flexure.__version__}
