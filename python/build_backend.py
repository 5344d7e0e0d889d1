"""Builds the package with maturin; a wheel also has the program ``flexure``, which is the command line.

Python's own part of Flexure and the command line are two users of one library, and neither depends on the other. So the program is
compiled together with the package, in the same workspace, and put where maturin looks for files that a wheel installs.
"""

from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path
from typing import Any

import maturin
from maturin import (  # noqa: F401
    build_editable,
    build_sdist,
    get_requires_for_build_editable,
    get_requires_for_build_sdist,
    get_requires_for_build_wheel,
    prepare_metadata_for_build_editable,
    prepare_metadata_for_build_wheel,
)

_HERE = Path(__file__).resolve().parent
_PROGRAM = "flexure.exe" if os.name == "nt" else "flexure"
# A wheel's scripts are installed next to the interpreter.
_SCRIPTS = _HERE / "flexure._core.data" / "scripts"


def build_wheel(wheel_directory: str, config_settings: dict[str, Any] | None = None, metadata_directory: str | None = None) -> str:
    """The wheel, with the program; without it where the command line's sources are missing, as in a source distribution."""
    workspace = _HERE.parent
    if (workspace / "crates" / "flexure-cli").is_dir():
        subprocess.run(["cargo", "build", "--release", "--package", "flexure-cli"], cwd=workspace, check=True)
        target = Path(os.environ.get("CARGO_TARGET_DIR", workspace / "target"))
        _SCRIPTS.mkdir(parents=True, exist_ok=True)
        shutil.copy2(target / "release" / _PROGRAM, _SCRIPTS / _PROGRAM)
    return str(maturin.build_wheel(wheel_directory, config_settings, metadata_directory))
