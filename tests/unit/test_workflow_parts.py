"""Sources of a stage, the run's lock, the choice of rounds, and the pins."""

import re
import subprocess
import sys
import tomllib
from pathlib import Path
from types import SimpleNamespace

import pytest
import yaml

from anthro import cli
from anthro.demos import select
from anthro.errors import UserError
from anthro.files import read_json
from anthro.launch import take_lock
from anthro.sources import source_files

ROOT = Path(__file__).resolve().parents[2]


def test_sources_are_the_imports_without_the_plumbing(tmp_path):
    package = tmp_path / "anthro"
    for name, text in {
        "__init__.py": "",
        "files.py": "",
        "learn/__init__.py": "",
        "learn/loop.py": "import numpy\nfrom anthro import files\nfrom anthro.motor.network import Net",
        "learn/other.py": "",
        "motor/__init__.py": "from anthro.motor import gains",
        "motor/gains.py": "",
        "motor/network.py": "def late():\n    import anthro.body.hill as hill",
        "body/__init__.py": "",
        "body/hill.py": "from anthro.learn import loop",
    }.items():
        (package / name).parent.mkdir(parents=True, exist_ok=True)
        (package / name).write_text(text)
    found = [Path(name).relative_to(package).as_posix() for name in source_files("anthro.learn.loop", src=tmp_path)]
    assert found == [
        "body/__init__.py",
        "body/hill.py",
        "learn/__init__.py",
        "learn/loop.py",
        "motor/__init__.py",
        "motor/gains.py",
        "motor/network.py",
    ]
    missing = source_files("anthro.learn.none", src=tmp_path)
    assert (package / "learn/none.py").as_posix() in missing


def test_a_run_has_one_owner_and_a_killed_owner_leaves_no_lock(tmp_path):
    lock = tmp_path / "laptop.lock"
    code = (
        "import sys, time; from anthro.launch import take_lock\n"
        "take_lock(sys.argv[1]); print('taken', flush=True); time.sleep(60)"
    )
    owner = subprocess.Popen([sys.executable, "-c", code, str(lock)], stdout=subprocess.PIPE, text=True)
    assert owner.stdout.readline() == "taken\n"
    with pytest.raises(UserError, match="laptop"):
        take_lock(lock)
    owner.kill()
    owner.communicate()
    assert take_lock(lock) >= 0


@pytest.mark.parametrize(("arguments", "timers"), [([], False), (["--max-jobs-per-timespan", "50/1s"], True)])
def test_finished_jobs_leave_no_timers_behind(tmp_path, arguments, timers):
    (tmp_path / "Snakefile").write_text(
        "rule all:\n    input: expand('{n}', n=range(4))\nrule one:\n    output: '{n}'\n    shell: 'touch {output}'\n"
    )
    code = (
        "import sys, threading; from anthro.launch import run_snakemake\n"
        "assert run_snakemake(sys.argv[1:])\n"
        "print(any(isinstance(thread, threading.Timer) for thread in threading.enumerate()))"
    )
    command = [sys.executable, "-c", code, "--cores", "1", "--scheduler", "greedy", *arguments]
    ran = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=True)
    assert (tmp_path / "3").exists()
    assert ran.stdout.splitlines()[-1] == str(timers)


def task(limb, inputs, rate, error, unit="m"):
    return {"limb": limb, "inputs": inputs, "success_rate": rate, f"median_error_{unit}": error}


@pytest.mark.parametrize(
    ("rates", "errors", "kept"), [((0.5, 0.9, 0.8), (1, 2, 1), 1), ((0.9, 0.9), (2, 2), 1), ((0.9, 0.9), (1, 2), 0)]
)
def test_the_round_that_does_the_task_best_is_kept(tmp_path, monkeypatch, rates, errors, kept):
    names = [tmp_path / f"round{number}" / "weights.h5" for number in range(len(rates))]
    for name in names:
        name.parent.mkdir()
        name.write_text(name.parent.name)
    found = {name: task("neck", "paper", *one, "deg") for name, *one in zip(names, rates, errors, strict=True)}
    session = SimpleNamespace(limb=lambda name: None, targets=lambda *asked: [])
    monkeypatch.setattr(select, "opened", lambda args: session)
    monkeypatch.setattr(select, "task_of", lambda limb: SimpleNamespace(share=0.6))
    monkeypatch.setattr(select, "tried", lambda session, limb, inputs, weights, targets, seed: found[weights])
    asked = ["--run", str(tmp_path), "--limb", "neck", "--out", str(tmp_path / "net"), "--rounds", *map(str, names)]
    assert cli.run(select.main, [*asked, "--inputs", "paper"]) == 0
    assert (tmp_path / "net" / "weights.h5").read_text() == f"round{kept}"
    assert read_json(tmp_path / "net" / "selection.json")["kept"] == kept
    assert cli.run(select.main, asked) == 2


def pins(lines):
    return [line.strip() for line in lines if re.match(r"^\s*[A-Za-z0-9_.-]+==", line)]


def test_both_installers_have_the_same_pins():
    locked = pins((ROOT / "requirements.lock").read_text().splitlines())
    content = yaml.safe_load((ROOT / "environment.yml").read_text())
    conda = next(part["pip"] for part in content["dependencies"] if isinstance(part, dict))
    assert conda == locked
    assert len(locked) > 50


def test_pins_are_exact_name_no_host_and_hold_all_that_is_asked_for():
    text = (ROOT / "requirements.lock").read_text()
    lines = [line for line in text.splitlines() if line and not line.startswith("#")]
    assert pins(lines) == lines and "//" not in text and "+" not in "".join(lines)
    names = {re.sub(r"[-_.]+", "-", line.partition("==")[0]).lower() for line in lines}
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    asked = sum(project["optional-dependencies"].values(), project["dependencies"])
    assert {re.sub(r"[-_.]+", "-", name.partition("[")[0]).lower() for name in asked} <= names
