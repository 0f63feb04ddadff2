"""Rows of what the nets came to (anthro.learn.outcome)."""

import pytest

from anthro import cli, registry
from anthro.files import read_json, write_json
from anthro.learn import outcome
from anthro.learn.outcome import paper_epochs, rows_of
from anthro.registry import Net
from anthro.scorecard import judge


def card(name, epochs, unexplained=0.3) -> dict:
    return {
        "spec": {"name": name, "paper": "nakada2018"},
        "best": {"unexplained_variance": unexplained, "validation_mse": 0.2},
        "epochs": epochs,
        "pairs": {"training": 90, "validation": 10},
        "weights": 477_000,
    }


@pytest.mark.parametrize(
    ("net", "epochs"),
    [
        (Net("nakada2018", "right_arm", "voluntary"), 1777),
        (Net("nakada2018", "left_arm", "voluntary"), 1865),
        (Net("nakada2018", "right_leg", "voluntary"), 1850),
        (Net("nakada2018", "left_leg", "voluntary"), 2000),
        (Net("nakada2018", "neck_seated", "voluntary"), 2000),
        (Net("nakada2018", "neck_seated", "reflex"), "1200-1600"),
        (Net("zhou2021", "core", "voluntary"), 2000),
        (Net("zhou2021", "core", "reflex"), 1200),
        (Net("zhou2021", "neck", "voluntary"), None),
    ],
)
def test_epochs_of_the_papers(net, epochs):
    assert paper_epochs(net)[0] == epochs


def test_every_net_has_its_rows(tmp_path):
    paths = []
    for name in registry.NETS:
        for number in range(2):
            paths.append(tmp_path / f"{name}{number}.json")
            write_json(paths[-1], card(name, 10 + number, 0.3 - 0.1 * number))
    selection = tmp_path / "neck_voluntary_paper" / "selection.json"
    write_json(selection, {"kept": 0})
    asked = ["--cards", *map(str, paths), "--selections", str(selection), "--out", str(tmp_path / "rows.json")]
    assert cli.run(outcome.main, asked) == 0
    rows = read_json(tmp_path / "rows.json")
    assert {row["item"] for row in rows} == set(registry.NETS)
    for row in rows:
        assert judge(row)["status"] == ""
        assert row["paper"] == registry.NETS[row["item"]].paper
    ours = {(row["item"], row["metric"]): row for row in rows}
    epochs = ours["right_arm_voluntary_paper", "epochs over all rounds"]
    assert (epochs["value"], epochs["target"], epochs["source"]) == (21, 1777, "Sec. 5.1.2")
    assert ours["right_arm_reflex", "unexplained variance, validation pairs"]["value"] == pytest.approx(0.2)
    kept = ours["neck_voluntary_paper", "unexplained variance, validation pairs"]
    assert kept["value"] == pytest.approx(0.3)
    write_json(selection, [])
    assert cli.run(outcome.main, asked) == 2


def test_unknown_nets_and_other_files_are_told(tmp_path, capsys):
    write_json(tmp_path / "a.json", card("right_wing_reflex", 3))
    write_json(tmp_path / "b.json", [])
    for name, word in (("a", "right_wing_reflex"), ("b", "b.json")):
        assert (
            cli.run(outcome.main, ["--cards", str(tmp_path / f"{name}.json"), "--out", str(tmp_path / "r.json")]) == 2
        )
        assert word in capsys.readouterr().err
    with pytest.raises(outcome.UserError, match="unknown net"):
        rows_of("none", [])
