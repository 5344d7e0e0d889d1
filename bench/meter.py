"""Processor time, wall time and memory of a call, inside the process; rust/src/meter.rs is its twin."""

import time


class Stopwatch:
    """Processor time (user and system, all threads) and wall time, s."""

    def __init__(self):
        self.wall, self.cpu = time.perf_counter(), time.process_time()

    def stop(self):
        cpu, wall = time.process_time(), time.perf_counter()
        return cpu - self.cpu, wall - self.wall


class Memory:
    """The peak of the resident memory above what was resident at the start, bytes."""

    def __init__(self):
        self.before = None
        try:
            with open("/proc/self/clear_refs", "w") as file:
                file.write("5")  # resets VmHWM (Linux, proc(5))
        except OSError:
            return
        self.before = _status("VmRSS:")

    def peak(self):
        """None where the system does not tell."""
        if self.before is None:
            return None
        return max(0, _status("VmHWM:") - self.before)


def _status(field):
    with open("/proc/self/status") as file:
        line = next(line for line in file if line.startswith(field))
    return 1024 * int(line.split()[1])
