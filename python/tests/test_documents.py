"""What the documents show runs: the READMEs' examples, the notebooks, the names in the table for users of MATLAB."""

import importlib.util
import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import flexure
from flexure import plots

PYTHON = Path(__file__).parent.parent
ROOT = PYTHON.parent


def docs_systems():
    """The systems of the documentation's logs, `docs/examples/systems.py`."""
    spec = importlib.util.spec_from_file_location("systems", ROOT / "docs" / "examples" / "systems.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize("path", [PYTHON / "README.md", ROOT / "README.md"], ids=["package", "project"])
def test_the_readmes_example(path, tmp_path):
    # The log that the project's README reads.
    record = docs_systems().motor()
    np.savetxt(tmp_path / "log.csv", np.column_stack(list(record.values())), delimiter=",", header=",".join(record), comments="")
    blocks = re.findall(r"```python\n(.*?)```", path.read_text(), flags=re.DOTALL)
    assert blocks
    for block in blocks:
        done = subprocess.run([sys.executable, "-c", block], cwd=tmp_path, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
        assert "holds" in done.stdout
    assert (tmp_path / "report.html").exists()


def test_the_readme_shows_what_the_program_prints():
    printed = (ROOT / "docs" / "examples" / "output" / "readme-identify.txt").read_text()
    shown = re.search(r"```console\n(.*?)```", (ROOT / "README.md").read_text(), flags=re.DOTALL)[1]
    # The README leaves out some lines, each time with a line `[...]`.
    pieces = re.split(r"^ *\[\.\.\.\]\n", shown, flags=re.MULTILINE)
    at = 0
    for piece in pieces:
        at = printed.find(piece, at)
        assert at >= 0, f"docs/examples/run readme wrote another readme-identify.txt than README.md shows:\n{piece}"
        at += len(piece)


def test_the_table_names_what_there_is(fitted):
    text = (ROOT / "docs" / "python" / "matlab.md").read_text()
    for name in re.findall(r"model\.(?!json)(\w+)", text):
        assert hasattr(fitted, name), name
    for name in re.findall(r"`(?:flexure\.)?plots?\.(\w+)\(", text):
        assert hasattr(plots, name), name
    for name in re.findall(r"\b([A-Z][A-Za-z]+)\(", text):
        assert hasattr(flexure, name), name


NOTEBOOKS = sorted((PYTHON / "tutorials").glob("*.ipynb"))


def test_there_are_notebooks():
    assert len(NOTEBOOKS) >= 3


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_the_notebooks_run(path, tmp_path):
    nbformat, nbclient = pytest.importorskip("nbformat"), pytest.importorskip("nbclient")
    pytest.importorskip("ipykernel")
    stored = nbformat.read(path, as_version=4)
    fresh = nbformat.read(path, as_version=4)
    os.environ.setdefault("FLEXURE_DATA", str(ROOT.parent / "shared" / "data"))
    nbclient.NotebookClient(fresh, timeout=300, resources={"metadata": {"path": str(tmp_path)}}).execute()

    def kinds(notebook):
        cells = [cell.outputs for cell in notebook.cells if cell.cell_type == "code"]
        return [sorted(o.output_type for o in outputs if o.get("name") != "stderr") for outputs in cells]

    assert kinds(stored) == kinds(fresh), "the stored outputs are of another version; run the notebook again"
    assert not any(o.get("name") == "stderr" for cell in stored.cells for o in cell.get("outputs", ()))


def test_the_site_builds_without_warnings(tmp_path, program):
    for module in ["sphinx", "myst_parser", "furo", "latex2mathml"]:
        pytest.importorskip(module)
    arguments = ["-W", "--keep-going", "-q", "-b", "html", str(ROOT / "docs"), str(tmp_path / "site")]
    environment = os.environ | {"FLEXURE_BINARY": program}
    done = subprocess.run(
        [sys.executable, "-m", "sphinx", *arguments], capture_output=True, text=True, check=False, env=environment
    )
    assert done.returncode == 0, done.stdout + done.stderr
    reference = (tmp_path / "site" / "python" / "systems.html").read_text()
    assert "flexure.systems.Hammerstein" in reference and "breakpoints" in reference
