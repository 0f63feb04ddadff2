"""The scorecard's verdicts and its refusals."""

import csv

import pytest

from anthro import cli, scorecard
from anthro.errors import UserError
from anthro.files import write_json


def row(**changes):
    return {
        "paper": "nakada2018",
        "item": "reach",
        "metric": "success_rate",
        "value": 0.93,
        "unit": "1",
        "target": 0.9,
        "source": "issue",
        "sense": "min",
    } | changes


@pytest.mark.parametrize(
    ("value", "target", "sense", "verdict"),
    [
        (0.93, 0.9, "min", "pass"),
        (0.9, 0.9, "min", "pass"),
        (0.73, 0.9, "min", "near"),
        (0.71, 0.9, "min", "miss"),
        (1.1, 1.0, "max", "near"),
        (1.3, 1.0, "max", "miss"),
        (29, 29, "equal", "pass"),
        (True, True, "equal", "pass"),
        (False, True, "equal", "miss"),
        (float("nan"), 1.0, "max", "miss"),
        (5.0, None, "info", ""),
    ],
)
def test_status(value, target, sense, verdict):
    assert scorecard.status(value, target, sense) == verdict


@pytest.mark.parametrize("changes", [{"sense": "least"}, {"extra": 1}, {"target": None}])
def test_bad_rows_are_refused(changes):
    with pytest.raises(UserError, match=r"rows\.json"):
        scorecard.judge(row(**changes), "rows.json")


def test_command_line_writes_the_table_and_refuses_a_repeated_metric(tmp_path, capsys):
    first, second, out = tmp_path / "a.json", tmp_path / "b.json", tmp_path / "scorecard.csv"
    write_json(first, [row(), row(metric="median_error_m", value=0.0123456, target=0.015, sense="max")])
    write_json(second, [row(item="hold", target=None, sense="info")])
    arguments = ["--run", "results/x", "--rows", str(first), str(second), "--out", str(out)]
    assert cli.run(scorecard.main, arguments) == 0
    assert "3 rows, 2 pass, 0 near, 0 miss" in capsys.readouterr().out
    with out.open(newline="") as file:
        table = list(csv.DictReader(file))
    assert tuple(table[0]) == scorecard.COLUMNS
    assert [line["status"] for line in table] == ["pass", "pass", ""]
    assert table[1]["value"] == "0.01235" and table[2]["target"] == ""
    assert cli.run(scorecard.main, [*arguments[:4], str(first), "--out", str(out)]) == 2
