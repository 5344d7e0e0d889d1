"""A worked example: a folder to work in, and the outputs of its commands for the pages."""

import csv
import json
import os
import shlex
import subprocess
import sys
from pathlib import Path

import numpy as np

from pictures import picture

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent.parent
OUTPUT = HERE / "output"
BINARY = Path(os.environ.get("FLEXURE_BINARY") or ROOT / "target/release/flexure").resolve()
DATA = Path(os.environ["FLEXURE_DATA"]).resolve() if os.environ.get("FLEXURE_DATA") else None


class Skipped(Exception):
    pass


class Example:
    """A folder to work in, and the transcript of its commands."""

    def __init__(self, name):
        self.name = name
        self.folder = ROOT / "target/docs-examples" / name
        self.folder.mkdir(parents=True, exist_ok=True)

    def record(self, file, columns):
        table = np.column_stack(list(columns.values()))
        np.savetxt(self.folder / file, table, delimiter=",", header=",".join(columns), comments="", fmt="%.9g")

    def run(self, command, page=None, quiet=False, fails=False):
        """Runs `flexure ...` and writes the command with its output to `page`.txt (the example's name); `\\` continues a line."""
        program, *arguments = shlex.split(command.replace("\\\n", " "))
        assert program == "flexure", command
        done = subprocess.run([BINARY, *arguments], cwd=self.folder, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        if (done.returncode != 0) != fails:
            raise SystemExit(f"{self.name}: {command}\n{done.stdout}")
        # Progress lines depend on the speed of the computer.
        lines = done.stdout.splitlines(keepends=True)
        said = "".join(line for line in lines if not line.startswith("still "))
        if not quiet:
            (OUTPUT / f"{page or self.name}.txt").write_text(f"$ {command}\n{said}")
        return said

    def python(self, script, page=None, needs="flexure"):
        """Runs a script beside this one, and writes what it prints."""
        if subprocess.run([sys.executable, "-c", f"import {needs}"], capture_output=True).returncode:
            raise Skipped(f"needs the Python package {needs}")
        path = os.pathsep.join(["."] + os.environ.get("PYTHONPATH", "").split(os.pathsep))
        done = subprocess.run(
            [sys.executable, HERE / script], cwd=self.folder, stdout=subprocess.PIPE, text=True, check=True, env=os.environ | {"PYTHONPATH": path}
        )
        (OUTPUT / f"{page or self.name}.txt").write_text(done.stdout)

    def linked(self, *names):
        """The measured records, where there is a folder of them."""
        for name in names:
            if DATA is None or not (DATA / name).exists():
                raise Skipped(f"needs {name} in the folder FLEXURE_DATA")
            (self.folder / name).unlink(missing_ok=True)
            (self.folder / name).symlink_to(DATA / name)

    def json(self, file):
        return json.loads((self.folder / file).read_text())

    def csv(self, file):
        with open(self.folder / file, newline="") as lines:
            header, *rows = csv.reader(lines)
        columns = np.array([[float(cell or "nan") for cell in row] for row in rows]).T
        # A unit stands behind the name: "velocity [rad/s]".
        return {name.split(" [")[0]: column for name, column in zip(header, columns)}

    def picture(self, name=None, **settings):
        return picture(OUTPUT / f"{name or self.name}.svg", **settings)
