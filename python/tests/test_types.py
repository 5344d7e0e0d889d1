"""The stubs say what the compiled part has, and the package's types hold."""

import os
import shutil
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import flexure
import pytest

PACKAGE = Path(flexure.__file__).parent
pytestmark = pytest.mark.skipif(find_spec("mypy") is None, reason="mypy is not installed")


def _run(tmp_path, *module):
    environment = {**os.environ, "MYPY_CACHE_DIR": str(tmp_path)}
    done = subprocess.run([sys.executable, "-m", *module], capture_output=True, text=True, env=environment, check=False)
    assert done.returncode == 0, done.stdout + done.stderr


def test_the_stubs_are_the_compiled_part(tmp_path):
    _run(tmp_path, "mypy.stubtest", "flexure._core")


def test_the_types_hold(tmp_path):
    # A copy is needed: mypy accepts no path among installed packages.
    copy = shutil.copytree(PACKAGE, tmp_path / "source" / "flexure", ignore=shutil.ignore_patterns("*.so", "__pycache__"))
    _run(tmp_path, "mypy", "--strict", "--ignore-missing-imports", str(copy))


def test_the_package_says_that_it_is_typed():
    assert (PACKAGE / "py.typed").exists()
