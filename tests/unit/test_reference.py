"""The committed copy of a run (anthro.reference)."""

import pytest

from anthro import cli
from anthro.files import read_json
from anthro.reference import main

MORE = ("cost.csv", "demos/hold/metrics.json", "demos/hold/rollout.h5", "nets/a/selection.json", "nets/a/run_card.json")


@pytest.fixture
def run(tmp_path):
    folder = tmp_path / "laptop"
    for name in (
        "figures/nakada2018/a.png",
        "figures/nakada2018/b.mp4",
        "figures/nakada2018/c.json",
        "figures/nakada2018/b.run_card.json",
        "scorecard.csv",
        *MORE,
    ):
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(name.encode())
    for name, seconds in (("nets/a.tsv", "1.5"), ("nets/b.tsv", "2.5"), ("body.tsv", "1.0")):
        (folder / "benchmarks" / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / "benchmarks" / name).write_text(f"s\th:m:s\n{seconds}\t0:00:01\n")
    return folder


def test_scorecard_figures_and_seconds_are_kept(run, tmp_path):
    out = tmp_path / "reference"
    assert cli.run(main, ["--run", str(run), "--out", str(out)]) == 0
    kept = sorted(path.relative_to(out).as_posix() for path in out.rglob("*") if path.is_file())
    told = [
        "cards/figures/nakada2018/b.json",
        "cards/nets/a.json",
        "cost.csv",
        "demos/hold.json",
        "figures/a.png",
        "figures/b.mp4",
    ]
    assert kept == [*told, "run_card.json", "scorecard.csv", "selections/a.json"]
    assert read_json(out / "run_card.json")["job_seconds"] == {"body.tsv": 1.0, "nets": 4.0}


def test_an_unfinished_run_is_refused_in_one_line(run, tmp_path, capsys):
    (run / "scorecard.csv").unlink()
    assert cli.run(main, ["--run", str(run), "--out", str(tmp_path / "reference")]) == 2
    assert capsys.readouterr().err.count("\n") == 1
