"""The workflows, the release script, the versions and the citation agree with each other."""

from __future__ import annotations

import re
import subprocess
import tomllib
from pathlib import Path

import flexure
import pytest
import yaml

ROOT = Path(__file__).resolve().parents[2]
RELEASE = ROOT / "scripts" / "release"


def workflow(name: str) -> dict:
    return yaml.safe_load((ROOT / ".github" / "workflows" / name).read_text())


def commands(job: dict) -> list[str]:
    return [step["run"] for step in job["steps"] if "run" in step]


def parts() -> set[str]:
    """What the script makes, by the choices of its `case`."""
    choices = RELEASE.read_text().split('case "${1:-all}" in')[1]
    return set(re.findall(r"^    (\w+)\)", choices, re.MULTILINE)) - {"all"}


def test_the_workflow_makes_everything_that_the_script_makes() -> None:
    jobs = workflow("release.yml")["jobs"]
    called = [command for job in jobs.values() for command in commands(job) if command.startswith("scripts/")]
    assert {command.split()[1] for command in called} == parts()
    assert all(command.split()[0] == "scripts/release" for command in called)
    systems = jobs["files"]["strategy"]["matrix"]["system"]
    for family in ["ubuntu", "macos", "windows"]:
        assert any(system.startswith(family) for system in systems)


def test_the_test_workflow_runs_the_readmes_test() -> None:
    (job,) = workflow("test.yml")["jobs"].values()
    assert commands(job)[-1] == "./test"
    assert "\n./test " in (ROOT / "README.md").read_text()


def test_the_script_is_a_program_that_bash_reads() -> None:
    subprocess.run(["bash", "-n", RELEASE], check=True)
    assert RELEASE.stat().st_mode & 0o100
    refused = subprocess.run([RELEASE, "everything"], capture_output=True, text=True)
    assert refused.returncode == 2
    for part in parts():
        assert f"scripts/release {part}" in refused.stderr


def test_versions_agree() -> None:
    workspace = tomllib.loads((ROOT / "Cargo.toml").read_text())["workspace"]
    version = workspace["package"]["version"]
    assert flexure.__version__ == version
    assert yaml.safe_load((ROOT / "CITATION.cff").read_text())["version"] == version
    own = {name: table for name, table in workspace["dependencies"].items() if name.startswith("flexure")}
    assert own and {table["version"] for table in own.values()} == {version}


CRATES = sorted(path.parent.name for path in (ROOT / "crates").glob("*/Cargo.toml"))


@pytest.mark.parametrize("crate", CRATES)
def test_crates_can_be_published(crate: str) -> None:
    manifest = tomllib.loads((ROOT / "crates" / crate / "Cargo.toml").read_text())
    package = manifest["package"]
    # The script packs the folders by name.
    assert package["name"] == crate
    assert package.get("publish", True)
    assert package["description"]
    assert package["license"] == {"workspace": True}
    # The parts of this project that it needs are published with it, at the workspace's version.
    own = {name: table for name, table in manifest["dependencies"].items() if name.startswith("flexure")}
    assert set(own) <= set(CRATES)
    assert all(table == {"workspace": True} for table in own.values())


def test_the_wheel_is_for_every_python_from_the_oldest_on() -> None:
    project = tomllib.loads((ROOT / "python" / "pyproject.toml").read_text())
    oldest = project["project"]["requires-python"].removeprefix(">=")
    abi = f"abi3-py{oldest.replace('.', '')}"
    assert f"pyo3/{abi}" in project["tool"]["maturin"]["features"]
    for step in workflow("release.yml")["jobs"]["files"]["steps"]:
        if "setup-python" in step.get("uses", ""):
            assert step["with"]["python-version"] == oldest


def test_the_workflow_publishes_what_the_script_makes() -> None:
    """The patterns of the uploaded files are those of the files that the script writes."""
    jobs = workflow("release.yml")["jobs"]
    uploads = [step["with"]["path"] for job in jobs.values() for step in job["steps"] if "upload-artifact" in step.get("uses", "")]
    patterns = {Path(line).name for path in uploads for line in path.split()}
    assert patterns == {"*.tar.gz", "*.whl", "*.crate"}
    assert all(Path(line).parent == Path("target/release-files") for path in uploads for line in path.split())
    assert 'files="$PWD/target/release-files"' in RELEASE.read_text()
    assert set(jobs["publish"]["needs"]) == set(jobs) - {"publish"}
