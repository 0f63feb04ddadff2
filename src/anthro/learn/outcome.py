"""What each net of a run came to, as rows of the scorecard, with the epochs of the paper's net beside ours."""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from anthro import cli, registry
from anthro.errors import UserError
from anthro.files import read_json, write_json

# Epochs to converge, by paper, role and limb; None stands for every limb that is not named.
PAPER_EPOCHS = {
    ("nakada2018", "voluntary", "neck_seated"): (2000, "Sec. 5.1.1"),
    ("nakada2018", "voluntary", "left_arm"): (1865, "Sec. 5.1.2"),
    ("nakada2018", "voluntary", "right_arm"): (1777, "Sec. 5.1.2"),
    ("nakada2018", "voluntary", "left_leg"): (2000, "Sec. 5.1.2"),
    ("nakada2018", "voluntary", "right_leg"): (1850, "Sec. 5.1.2"),
    ("nakada2018", "reflex", None): ("1200-1600", "Sec. 5.2"),
    ("nakada2018", "foveation", None): (80, "Sec. 6.2.1"),
    ("nakada2018", "vision", None): (388, "Sec. 6.2.2"),
    ("zhou2021", "voluntary", "core"): (2000, "Fig. 5a, end of its axis"),
    ("zhou2021", "reflex", "core"): (1200, "Fig. 5b, end of its axis"),
}


def paper_epochs(net: registry.Net) -> tuple[int | str | None, str]:
    """Return the epochs that the paper's net took, and where it says so; None where it does not."""
    for limb in (net.limb, None):
        if found := PAPER_EPOCHS.get((net.paper, net.role, limb)):
            return found
    return None, "not given in the paper"


def rows_of(name: str, cards: Sequence[dict], kept: int = -1) -> list[dict]:
    """Rows of one net from its run cards, one a round of aggregation, oldest first; errors are of the kept round's.

    Raises
    ------
    UserError
        When the registry does not know the net.
    """
    if name not in registry.NETS:
        raise UserError(f"unknown net {name!r}; known: {', '.join(registry.NETS)}")
    net, best = registry.NETS[name], cards[kept]
    epochs, source = paper_epochs(net)
    values = (
        ("unexplained variance, validation pairs", best["best"]["unexplained_variance"], "ratio", None, ""),
        ("normalised validation MSE", best["best"]["validation_mse"], "ratio", None, ""),
        ("epochs over all rounds", sum(card["epochs"] for card in cards), "epochs", epochs, source),
        ("training pairs", best["pairs"]["training"], "pairs", None, ""),
        ("weights, biases not counted", best["weights"], "1", None, ""),
    )
    keys = ("metric", "value", "unit", "target", "source")
    fixed = {"paper": net.paper, "item": name, "sense": "info"}
    return [fixed | dict(zip(keys, row, strict=True)) for row in values]


def main(argv: Sequence[str] | None = None) -> None:
    """Write the rows of all nets whose run cards are given."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cards", required=True, nargs="+", type=Path, metavar="FILE", help="run cards, oldest first")
    parser.add_argument(
        "--selections", nargs="*", type=Path, default=[], metavar="FILE", help="nets/<net>/selection.json of some nets"
    )
    parser.add_argument("--out", required=True, type=Path, metavar="FILE", help="rows.json")
    given = parser.parse_args(argv)
    nets: dict[str, list[dict]] = {}
    for path in given.cards:
        card = read_json(path)
        try:
            nets.setdefault(card["spec"]["name"], []).append(card)
        except (KeyError, TypeError):
            raise UserError(f"{path}: not the card of a training") from None
    try:
        kept = {path.parent.name: int(read_json(path)["kept"]) for path in given.selections}
    except (KeyError, TypeError, ValueError):
        raise UserError("--selections: not the choice of a net's round") from None
    write_json(given.out, [row for name, cards in nets.items() for row in rows_of(name, cards, kept.get(name, -1))])


if __name__ == "__main__":
    sys.exit(cli.run(main))
