"""A contestant's process, its limits and its answers (the protocol is that of worker.py)."""

import os
import resource
import select
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

FOLDER = Path(__file__).parent
BINARY = FOLDER.parent / "target" / "release" / "flexure-bench"
# For the start, the imports and the first call with few points.
START = 120
# Wall time allowed for a second of processor time.
PATIENCE = 5


class Limits:
    def __init__(self, seconds, memory):
        self.seconds = seconds
        self.memory = int(memory)


class Stopped(Exception):
    """The contestant is out. `known`: by a limit, so that nothing is wrong with it."""

    def __init__(self, what, known):
        super().__init__(what)
        self.what, self.known = what, known


def least(a, b):
    return b if a is None else min(a, b)


class Process:
    """A contestant at work; `cpu`, `wall` (s) and `peak` (bytes) are the best so far, None before the first call."""

    def __init__(self, contestant, parameters, limits):
        program = [str(BINARY)] if contestant.rust else [sys.executable, str(FOLDER / "worker.py")]
        pairs = [f"{key}={value}" for key, value in {**parameters, **contestant.changes}.items()]
        threads = str(contestant.threads)
        names = ("RAYON", "OMP", "OPENBLAS", "MKL", "NUMEXPR")
        self.limits = limits
        self.cpu = self.wall = self.peak = self.chosen = None
        self.spent = 0.0
        self.left = b""
        self.log = tempfile.TemporaryFile()
        self.child = subprocess.Popen(
            [*program, contestant.who, *pairs],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self.log,
            env={**os.environ, **{f"{name}_NUM_THREADS": threads for name in names}},
            preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, (limits.memory, limits.memory)),
        )

    def ready(self):
        self.answer(START)

    def run(self, length):
        begin = time.monotonic()
        self.say(f"run {length}")
        # A turn may end with a call that was begun just within its length.
        _, cpu, wall, peak, chosen = self.answer(self.limits.seconds + length).split(None, 4)
        self.spent += time.monotonic() - begin
        self.cpu, self.wall = least(self.cpu, float(cpu)), least(self.wall, float(wall))
        if self.peak is None and peak != "-":
            self.peak = int(peak)
        self.chosen = chosen if chosen != "-" else None

    def estimates(self, path):
        self.say(f"write {path}")
        self.answer(START)
        return np.fromfile(path, dtype="<f8")

    def say(self, line):
        try:
            self.child.stdin.write(line.encode() + b"\n")
            self.child.stdin.flush()
        except BrokenPipeError:
            pass  # the answer will say why

    def answer(self, seconds):
        """The next line, if it takes no more than so much processor time (of wall time, some times that)."""
        begin, used = time.monotonic(), self.processor_time()
        while b"\n" not in self.left:
            ready, _, _ = select.select([self.child.stdout], [], [], 0.5)
            if not ready:
                wall = time.monotonic() - begin
                # Where other work shares the machine, its time is not the contestant's.
                if wall > PATIENCE * seconds or self.processor_time() - used > seconds:
                    raise Stopped("over limit", known=True)
                continue
            part = os.read(self.child.stdout.fileno(), 65536)
            if not part:
                raise self.died()
            self.left += part
        line, self.left = self.left.split(b"\n", 1)
        line = line.decode()
        if line.startswith("error "):
            what = line.removeprefix("error ")
            raise Stopped(what, known=what == "out of memory")
        return line

    def processor_time(self):
        """The processor time of the child so far, s; without /proc the wall time."""
        try:
            with open(f"/proc/{self.child.pid}/stat") as file:
                fields = file.read().rsplit(")", 1)[1].split()
        except (OSError, IndexError):
            return time.monotonic()
        return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")

    def died(self):
        code = self.child.wait()
        self.log.seek(0)
        log = self.log.read().decode(errors="replace").strip()
        memory = code == -9 or any(sign in log for sign in ("memory allocation of", "MemoryError", "bad_alloc"))
        last = log.rsplit("\n", 1)[-1][:100]
        return Stopped("out of memory" if memory else f"ended with {code}: {last}", known=memory)

    def close(self):
        self.child.kill()
        self.child.wait()
        for stream in (self.child.stdin, self.child.stdout, self.log):
            try:
                stream.close()
            except BrokenPipeError:
                pass
