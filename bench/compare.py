"""Runs Flexure and its peers in turn and prints one table. `bench/run --help` says how."""

import argparse
import math
import os
import shlex
import sys
from pathlib import Path

import numpy as np

from contest import Limits, Process, Stopped
from jobs import JOBS, data
from report import Row, header, machine, markdown

FOLDER = Path(__file__).parent
ROOT = FOLDER.parent


class Mode:
    def __init__(self, limit, rounds, turn, budget):
        self.limit = limit  # s of processor time, for one call
        self.rounds = rounds  # turns of every contestant after its first call
        self.turn = turn  # s, the length of a turn: short calls are repeated within it
        self.budget = budget  # s, after which a contestant takes no more turns


CHECK = Mode(60, 1, 0, 1)
QUICK = Mode(10, 5, 0.03, 3)
FULL = Mode(120, 7, 0.1, 10)


def main():
    options = arguments()
    mode = CHECK if options.check else FULL if options.full else QUICK
    limits = Limits(options.limit or mode.limit, options.memory * 2**30)
    work = ROOT / "target" / "bench-data"
    work.mkdir(parents=True, exist_ok=True)
    rows, failures = [], []
    description = machine(ROOT, shlex.join(["bench/run", *sys.argv[1:]]))
    print(description + "\n\n" + header(), flush=True)
    for job in chosen_jobs(options):
        slow = {}  # label -> [(n, processor time or what happened)]
        for n in sizes(job, mode, options):
            for row in cell(job, n, mode, limits, work, slow, options):
                rows.append(row)
                print(row.line(), flush=True)
                if row.failed:
                    failures.append(row)
    if options.save:
        (FOLDER / options.save).write_text(f"# Results\n\n{description}\n\n{markdown(rows)}\n")
    for row in failures:
        print(f"error: {row.job}, n = {row.n}, {row.who}: {row.failed}", file=sys.stderr)
    if not any(row.cpu for row in rows):
        sys.exit("error: nothing was measured")
    sys.exit(1 if failures else 0)


def arguments():
    parser = argparse.ArgumentParser(prog="bench/run", description=__doc__)
    size = parser.add_mutually_exclusive_group()
    size.add_argument("--quick", action="store_true", help="up to 1e4 or 1e5 points, a few minutes (the default)")
    size.add_argument("--full", action="store_true", help="up to 1e7 points, about half an hour")
    size.add_argument("--check", action="store_true", help="few points, Flexure and NumPy only, agreement: seconds")
    names = ", ".join(job.name for job in JOBS)
    parser.add_argument("--jobs", metavar="A,B", help=f"only these of: {names}")
    peers = sorted({c.who for job in JOBS for c in job.contestants if not c.ours})
    parser.add_argument("--peers", metavar="A,B", help=f"only these of: {', '.join(peers)}")
    parser.add_argument("--most", type=float, metavar="N", help="no more points than this")
    parser.add_argument("--limit", type=float, metavar="S", help="processor time of one call (quick 10, full 120)")
    parser.add_argument("--memory", type=float, metavar="GB", default=8, help="for one process (8)")
    parser.add_argument("--save", metavar="FILE", nargs="?", const="RESULTS.md", help="write bench/FILE (RESULTS.md) too")
    options = parser.parse_args()
    options.jobs = options.jobs and options.jobs.split(",")
    options.peers = ["numpy"] if options.check else options.peers and options.peers.split(",")
    for given, known in [(options.jobs, [job.name for job in JOBS]), (options.peers, peers)]:
        unknown = set(given or []) - set(known)
        if unknown:
            parser.error(f"unknown: {', '.join(sorted(unknown))}; known are {', '.join(known)}")
    return options


def chosen_jobs(options):
    return [job for job in JOBS if not options.jobs or job.name in options.jobs]


def sizes(job, mode, options):
    if mode is CHECK:
        return [2_000]
    given = job.full if mode is FULL else job.quick
    return [n for n in given if not options.most or n <= options.most]


def cell(job, n, mode, limits, work, slow, options):
    """All contestants of one job and size, in turn; their rows."""
    x, y, at, truth = data(job.truth, job.dimension, n)
    files = {"data": work / "data.bin", "grid": work / "grid.bin"}
    np.vstack([x, y]).tofile(files["data"])
    at.tofile(files["grid"])
    shared = {**job.parameters, **files, "dimension": job.dimension}
    del x, y
    contestants = [c for c in job.contestants if c.ours or not options.peers or c.who in options.peers]
    rows = [Row(job.title, n, c.label) for c in contestants]
    running = []
    for contestant, row in zip(contestants, rows):
        row.note = expected(slow.get(contestant.label), n, limits)
        if not row.note:
            running.append((contestant, row, Process(contestant, shared, limits)))
    try:
        running = [entry for entry in running if attempt(entry, Process.ready, slow, n)]
        # First a call of each, then turns: a drift of the machine affects all of them equally.
        for turn in range(1 + mode.rounds):
            length = mode.turn if turn else 0
            running = [
                entry
                for entry in running
                if (turn and entry[2].spent > mode.budget) or attempt(entry, lambda p: p.run(length), slow, n)
            ]
        judge(job, running, truth, work)
        for contestant, row, process in running:
            slow.setdefault(contestant.label, []).append((n, process.cpu))
    finally:
        for _, _, process in running:
            process.close()
    reference = rows[0].cpu
    for row in rows:
        row.ratio = row.cpu / reference if row.cpu and reference else None
    return rows


def attempt(entry, step, slow, n):
    """Whether the contestant is still there after the step; its row says why it is not."""
    contestant, row, process = entry
    try:
        step(process)
    except Stopped as stopped:
        process.close()
        row.note = stopped.what
        if contestant.ours or not stopped.known:
            row.failed = stopped.what
        slow.setdefault(contestant.label, []).append((n, stopped.what))
        return False
    row.cpu, row.wall, row.peak, row.chosen = process.cpu, process.wall, process.peak, process.chosen
    return True


def expected(history, n, limits):
    """Why the contestant need not try n points, from its earlier times; empty if it should."""
    if not history:
        return ""
    (size, last) = history[-1]
    if isinstance(last, str):
        return last
    power = 1.0
    if len(history) > 1:
        before = history[-2]
        power = max(1.0, math.log(last / before[1]) / math.log(size / before[0]))
    return "over limit (expected)" if last * (n / size) ** power > limits.seconds else ""


def judge(job, running, truth, work):
    """The error against the truth, and the difference from the first contestant's estimates."""
    reference = None
    for contestant, row, process in running:
        estimates = process.estimates(work / "estimates.bin")
        if job.estimates:
            row.error = float(np.sqrt(np.mean((estimates - truth) ** 2)))
        if row.who == job.contestants[0].label:
            reference = estimates
        elif contestant.tolerance is not None and reference is not None:
            # Where one says that nothing is known, so must the other.
            same = np.isnan(estimates) == np.isnan(reference)
            row.difference = float(np.nanmax(np.abs(estimates - reference), initial=0)) if same.all() else math.inf
            if not row.difference <= contestant.tolerance:
                row.failed = f"differs from Flexure by {row.difference:.2g}, more than {contestant.tolerance:.2g}"


if __name__ == "__main__":
    os.chdir(FOLDER)
    main()
