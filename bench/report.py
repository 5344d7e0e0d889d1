"""The table, and the machine that it holds for."""

import os
import platform
import subprocess
from dataclasses import dataclass
from datetime import date
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

COLUMNS = [
    ("job", -40),
    ("n", 9),
    ("who", -30),
    ("CPU ms", 10),
    ("wall ms", 10),
    ("CPU ratio", 9),
    ("peak MB", 8),
    ("RMSE", 8),
    ("difference", 10),
    ("chosen", -18),
]


@dataclass
class Row:
    job: str
    n: int
    who: str
    cpu: float | None = None  # s
    wall: float | None = None
    ratio: float | None = None
    peak: int | None = None  # bytes
    error: float | None = None
    difference: float | None = None
    chosen: str | None = None
    note: str = ""
    failed: str = ""

    def line(self):
        def number(value, form, scale=1.0):
            return "" if value is None else form(value * scale)

        return row(
            self.job,
            f"{self.n:.0e}".replace("e+0", "e") if self.n >= 10_000 else str(self.n),
            self.who,
            number(self.cpu, significant, 1e3),
            number(self.wall, significant, 1e3),
            number(self.ratio, significant),
            number(self.peak, significant, 1e-6),
            number(self.error, "{:.5f}".format),
            number(self.difference, "{:.1e}".format),
            self.note or self.chosen or "",
        )


def significant(value):
    """Three significant digits, no exponent."""
    if value >= 100:
        return f"{value:.0f}"
    if value >= 10:
        return f"{value:.1f}"
    return f"{value:.2f}" if value >= 0.1 else f"{value:.3f}"


def row(*cells):
    padded = (cell.ljust(-width) if width < 0 else cell.rjust(width) for cell, (_, width) in zip(cells, COLUMNS))
    return "| " + " | ".join(padded) + " |"


def header():
    rule = ("-" * -width if width < 0 else "-" * (width - 1) + ":" for _, width in COLUMNS)
    return row(*(name for name, _ in COLUMNS)) + "\n| " + " | ".join(rule) + " |"


def markdown(rows):
    return "\n".join([header(), *(row.line() for row in rows)])


def machine(root, command):
    """A paragraph: when, by which command, on what, with which versions."""
    load = f"{os.getloadavg()[0]:.1f}"
    packages = ", ".join(f"{name} {installed(name)}" for name in requirements() if installed(name))
    return (
        f"{date.today().isoformat()}, `{command}`, commit {output(root, 'git', 'rev-parse', '--short', 'HEAD')}; "
        f"{processor()}, {os.cpu_count()} cores, {memory()} of memory, load {load} at the start, "
        f"{platform.system()} {platform.machine()}; {output(root, 'rustc', '--version')}, "
        f"Python {platform.python_version()}, {packages}."
    )


def requirements():
    lines = (Path(__file__).parent / "requirements.txt").read_text().split()
    return [line.split("==")[0] for line in lines]


def installed(name):
    try:
        return version(name)
    except PackageNotFoundError:
        return None


def output(root, *command):
    try:
        return subprocess.run(command, cwd=root, capture_output=True, text=True, check=True).stdout.strip()
    except (OSError, subprocess.CalledProcessError):
        return "unknown"


def processor():
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
        return next(line.split(":")[1].strip() for line in lines if line.startswith("model name"))
    except (OSError, StopIteration):
        return platform.processor() or "an unknown processor"


def memory():
    pages, size = os.sysconf("SC_PHYS_PAGES"), os.sysconf("SC_PAGE_SIZE")
    return f"{pages * size / 2**30:.0f} GB"
