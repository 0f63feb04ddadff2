"""The table of costs (anthro.cost)."""

import csv
from pathlib import Path

import pytest

from anthro import cli, config, cost
from anthro.files import write_json

ROOT = Path(__file__).resolve().parents[2]
NETS = ("right_arm_voluntary_paper", "right_arm_voluntary_proprioceptive", "right_arm_reflex")


@pytest.fixture
def run(tmp_path, monkeypatch):
    """A run of the arm: 2 and 4 ms a pair, 1,000 pairs a shard of 5,000 bytes, 500 pairs a second of training."""
    monkeypatch.chdir(ROOT)
    for dataset, told in (("right_arm_voluntary", "2.000"), ("right_arm_reflex", "4.000")):
        log = tmp_path / "logs" / "data" / dataset / "round0" / "shard0000.log"
        log.parent.mkdir(parents=True)
        log.write_text(f"pairs: 1000/1000\nshard: 1000 pairs, {told} ms a pair, {{}}\n")
        shard = tmp_path / "data" / dataset / "round0" / "shard0000.h5"
        shard.parent.mkdir(parents=True)
        shard.write_bytes(bytes(5000))
        write_json(tmp_path / "specs" / "data" / f"{dataset}.json", {"pairs": 1000})
    for net in NETS:
        for number in range(2):
            card = {"epochs": 5, "pairs": {"training": 900}, "training_seconds": 9.0, "weights": 1000}
            write_json(tmp_path / "nets" / net / f"round{number}" / "run_card.json", card)
    return tmp_path


def test_costs_are_those_of_the_scale_at_the_runs_speeds(run):
    sizes = config.load({"scale": "paper"})["sizes"]["limbs"]["arm"]
    assert sizes["rounds"] == 5 and sizes["epochs"]["voluntary"] == 2000
    rows = {row["net"]: row for row in cost.table(run, config.load({"scale": "paper"}))}
    assert list(rows) == [*NETS, "all"]
    first, second, reflex = (rows[net] for net in NETS)
    assert first["pairs"] == 1_000_000
    assert first["synthesis_cpu_hours"] == pytest.approx(2000 / 3600)
    assert first["shard_gigabytes"] == pytest.approx(5.0e-3)
    assert "synthesis_cpu_hours" not in second  # it learns from the same pairs
    seen = 0.9 * (0.2 + 0.4 + 0.6 + 0.8 + 1.0) * 1e6 * 2000  # a round learns from all pairs so far
    assert first["training_cpu_hours"] == second["training_cpu_hours"] == pytest.approx(seen / 500 / 3600)
    assert first["training_petaflop"] == pytest.approx(6 * 1000 * seen / 1e15)
    assert reflex["training_cpu_hours"] == pytest.approx(0.9 * 1e6 * 2000 / 500 / 3600)
    assert rows["all"]["synthesis_cpu_hours"] == pytest.approx((2000 + 4000) / 3600)


def test_the_table_is_written_and_shown(run, capsys):
    out = run / "cost.csv"
    assert cli.run(cost.main, ["--run", str(run), "--out", str(out)]) == 0
    with out.open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert [row["net"] for row in rows] == [*NETS, "all"]
    assert float(rows[0]["pairs"]) == 1e6
    shown = capsys.readouterr().out.splitlines()
    assert len(shown) == 6 and len({line.count("|") for line in shown}) == 1


@pytest.mark.parametrize("lost", ["logs", "nets"])
def test_what_is_missing_is_named_in_one_line(run, capsys, lost):
    (run / lost).rename(run / "lost")
    assert cli.run(cost.main, ["--run", str(run)]) == 2
    told = capsys.readouterr().err
    assert told.count("\n") == 1 and str(run) in told
