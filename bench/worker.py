"""One contestant of the comparison, in a process of its own: worker.py WHO key=value...

The protocol, which rust/src/main.rs speaks too. The process reads the data, does the job once with few points, so
that nothing is loaded or compiled later, and says `ready`. Then it obeys the lines on its standard input:

    run SECONDS    repeat the call for so long, at least once; answer `took CPU WALL PEAK CHOSEN`, the least
                   processor and wall time in s, the first call's peak memory in bytes, the parameter it chose
                   (`-` for what is not known)
    write PATH     write the last call's estimates as 64-bit numbers; answer `written`

An `error MESSAGE` on the standard output ends it.
"""

import sys
import time

import numpy as np

import peers
from meter import Memory, Stopwatch

# Points of the first, unmeasured call.
WARM_UP = 256


# What a peer prints must not be taken for an answer.
answers, sys.stdout = sys.stdout, sys.stderr


def main():
    who, *arguments = sys.argv[1:]
    job = dict(argument.split("=", 1) for argument in arguments)
    try:
        serve(peers.call(who, job), job)
    except MemoryError:
        say("error out of memory")
        sys.exit(1)
    except Exception as error:  # any error of a peer: the comparison goes on without it
        say(f"error {type(error).__name__}: {' '.join(str(error).split())[:100]}")
        sys.exit(1)


def serve(call, job):
    x, y, at = read(job)
    call([column[:WARM_UP].copy() for column in x], y[:WARM_UP].copy(), at)
    say("ready")
    estimates = None
    for line in sys.stdin:
        command, value = line.split(None, 1)
        if command == "run":
            estimates, report = turn(lambda: call(x, y, at), float(value))
            say(report)
        elif command == "write":
            np.asarray(estimates, dtype="<f8").tofile(value.strip())
            say("written")
        else:
            raise ValueError("expected `run SECONDS` or `write PATH`")


def read(job):
    dimension = int(job["dimension"])
    data = np.fromfile(job["data"], dtype="<f8").reshape(dimension + 1, -1)
    grid = np.fromfile(job["grid"], dtype="<f8").reshape(dimension, -1)
    return list(data[:-1]), data[-1], list(grid)


def turn(call, length):
    begin, cpu, wall, peak = time.perf_counter(), float("inf"), float("inf"), None
    while True:
        memory, watch = Memory(), Stopwatch()
        result = call()
        c, w = watch.stop()
        if peak is None:
            peak = memory.peak()
        cpu, wall = min(cpu, c), min(wall, w)
        if time.perf_counter() - begin >= length:
            break
    estimates, chosen = result if isinstance(result, tuple) else (result, "-")
    return estimates, f"took {cpu!r} {wall!r} {'-' if peak is None else peak} {chosen}"


def say(line):
    print(line, file=answers, flush=True)


if __name__ == "__main__":
    main()
