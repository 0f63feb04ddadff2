"""A copy of the workflow in an empty folder, and Snakemake on it."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PARTS = ("Snakefile", "environment.yml", "config", "profiles", "src", "workflow")


class Workplace:
    """A copied workflow that only plans, or pretends that its files are made."""

    def __init__(self, folder: Path):
        self.folder = folder
        for part in PARTS:
            source = ROOT / part
            if source.is_dir():
                shutil.copytree(source, folder / part, ignore=shutil.ignore_patterns("__pycache__", "*.egg-info"))
            else:
                shutil.copy(source, folder / part)

    def snakemake(self, *arguments: str, scale: str = "smoke") -> subprocess.CompletedProcess:
        """Run Snakemake on a scale, both streams in ``stdout``."""
        command = [sys.executable, "-m", "snakemake", *arguments, "--config", f"scale={scale}", f"run={scale}"]
        environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
        return subprocess.run(
            command, cwd=self.folder, env=environment, text=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT
        )

    def outputs(self, scale: str = "smoke") -> dict[str, str]:
        """Return every file that the run makes, and its rule."""
        told = self.snakemake("--summary", scale=scale)
        assert told.returncode == 0, told.stdout
        table = [line.split("\t") for line in told.stdout.splitlines() if line.count("\t") > 3]
        column = {name: number for number, name in enumerate(table[0])}
        return {line[column["output_file"]]: line[column["rule"]] for line in table[1:]}

    def pretend(self) -> None:
        """Make every file of the smoke run, empty but for its name, as if its job had run."""
        for name in self.outputs():
            path = self.folder / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(name)
        told = self.snakemake("--touch", "--forceall", "--quiet")
        assert told.returncode == 0, told.stdout

    def left_to_do(self) -> dict[str, int]:
        """Return how many jobs of each rule a run would start, `all` left out."""
        told = self.snakemake("--dry-run")
        assert told.returncode == 0, told.stdout
        lines = told.stdout.splitlines()
        if not any(line.startswith("Job stats") for line in lines):
            assert "Nothing to be done" in told.stdout, told.stdout
            return {}
        start = next(number for number, line in enumerate(lines) if line.startswith("Job stats")) + 3
        jobs = {}
        for line in lines[start:]:
            rule, count = line.split()
            if rule == "total":
                break
            jobs[rule] = int(count)
        jobs.pop("all")
        return jobs

    def edit(self, name: str, old: str, new: str) -> None:
        """Replace text that stands exactly once in a file."""
        path = self.folder / name
        text = path.read_text()
        assert text.count(old) == 1, f"{name}: {old!r}"
        path.write_text(text.replace(old, new))


@pytest.fixture
def workplace(tmp_path):
    """An untouched workplace."""
    return Workplace(tmp_path)


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    """A workplace whose smoke run is finished; a test that edits a file puts it back."""
    place = Workplace(tmp_path_factory.mktemp("finished"))
    place.pretend()
    return place
