"""What each net of a run came to, as rows of the scorecard: unexplained variance, epochs, pairs."""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from anthro import cli
from anthro.files import read_json, write_json

# Nakada 2018: the right arm's voluntary net converged after 1777 epochs, reflex nets after 1200 to 1600.
PAPER_EPOCHS = {"voluntary": "1777 epochs (Sec. 5.1.2)", "reflex": "1200-1600 epochs (Sec. 5.2)"}


def rows_of(net: str, cards: Sequence[dict]) -> list[dict]:
    """Rows of one net from its run cards, one a round of aggregation, oldest first."""
    role = "reflex" if net.endswith("_reflex") else "voluntary"
    last, source = cards[-1], f"the paper: {PAPER_EPOCHS[role]}"
    values = (
        ("unexplained variance, validation pairs", last["best"]["unexplained_variance"], "ratio"),
        ("normalised validation MSE", last["best"]["validation_mse"], "ratio"),
        ("epochs over all rounds", sum(card["epochs"] for card in cards), "epochs"),
        ("training pairs, last round", last["pairs"]["training"], "pairs"),
        ("weights, biases not counted", last["weights"], "1"),
    )
    fixed = {"paper": last["spec"]["paper"], "item": net, "target": None, "sense": "info", "source": source}
    return [fixed | {"metric": metric, "value": value, "unit": unit} for metric, value, unit in values]


def main(argv: Sequence[str] | None = None) -> None:
    """Write the rows of all nets whose run cards are given."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--cards", required=True, nargs="+", type=Path, metavar="FILE", help="run cards, oldest first")
    parser.add_argument("--out", required=True, type=Path, metavar="FILE", help="rows.json")
    given = parser.parse_args(argv)
    nets: dict[str, list[dict]] = {}
    for path in given.cards:
        card = read_json(path)
        nets.setdefault(card["spec"]["name"], []).append(card)
    write_json(given.out, [row for net, cards in nets.items() for row in rows_of(net, cards)])


if __name__ == "__main__":
    sys.exit(cli.run(main))
