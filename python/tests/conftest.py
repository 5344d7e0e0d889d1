"""Records with known truth, and the command line next to the package."""

import os
import subprocess
from importlib.metadata import files
from types import SimpleNamespace

import numpy as np
import pytest

os.environ.setdefault("SCIPY_ARRAY_API", "1")  # before SciPy is imported: scikit-learn then checks what it otherwise skips
from scipy.signal import lfilter  # noqa: E402

# The linear part of the known systems: two complex poles, static gain 1.
B, A = np.array([0.0, 0.2, 0.15]), np.array([1.0, -1.2, 0.55])


def dead_zone(u):
    return np.sign(u) * np.maximum(np.abs(u) - 0.5, 0)


def simulated(n=4000, seed=1, noise=0.02, phi=dead_zone):
    """A Hammerstein system: columns u, y and the output without noise."""
    rng = np.random.default_rng(seed)
    u = rng.uniform(-2, 2, n)
    clean = lfilter(B, A, phi(u))
    return SimpleNamespace(u=u, y=clean + noise * rng.normal(size=n), clean=clean)


@pytest.fixture(scope="session")
def record():
    return simulated()


@pytest.fixture(scope="session")
def fitted(record):
    import flexure

    return flexure.Hammerstein().fit(record.u, record.y, dt=0.01)


def installed_program():
    """The program that comes with the package."""
    for file in files("flexure") or []:
        if file.stem == "flexure" and file.suffix in ("", ".exe"):
            return str(file.locate())
    pytest.skip("the package has no program; build it by pip")


@pytest.fixture(scope="session")
def program():
    """The program ``flexure`` that FLEXURE_BINARY names, else the one that the package installed."""
    return os.environ.get("FLEXURE_BINARY") or installed_program()


@pytest.fixture(scope="session")
def command(program):
    """Runs the program ``flexure``."""

    def run(*arguments, check=True):
        done = subprocess.run([program, *map(str, arguments)], capture_output=True, text=True, check=False)
        assert not check or done.returncode == 0, done.stderr
        return done

    return run


def write_csv(path, **columns):
    """A record that reads back as the same numbers."""
    table = np.column_stack(list(columns.values()))
    np.savetxt(path, table, fmt="%.17g", delimiter=",", header=",".join(columns), comments="")
    return path
