"""What a scale costs, net by net, from what a finished run measured: ``--run results/laptop --scale paper``.

Synthesis: milliseconds a pair, from the logs of the run's shards, times the scale's pairs; the two voluntary nets of a
limb learn from the same pairs, so the first of them bears their cost. Training: each round of aggregation starts anew
on all pairs so far and takes all its epochs, as if none stopped early. CPU hours come from the pairs a second that the
run's trainings took on one thread; GPU hours from the floating-point operations, six for each weight and pair (two
forward, four backward), and `GPU_FLOPS`.
"""

import argparse
import csv
import re
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

from anthro import cli, registry
from anthro.config import load, role_of, sizes_of
from anthro.errors import UserError
from anthro.files import atomic, read_json

GPU_FLOPS = 2e12  # operations a second that such small batches draw from a data centre's GPU, a few percent of its peak
PASSES = 6  # operations for each weight and pair
VALIDATING = 0.1  # share of the pairs that do not train
HOUR = 3600.0
COLUMNS = {
    "pairs": ",",
    "synthesis_ms_a_pair": ".2f",
    "synthesis_cpu_hours": ".2f",
    "shard_gigabytes": ".3f",
    "weights": ",",
    "training_petaflop": ".1f",
    "training_cpu_hours": ".1f",
    "training_gpu_hours": ".1f",
}


def pair_seconds(run: Path, dataset: str) -> float:
    """Seconds a pair took in a run, mean over its shards.

    Raises
    ------
    UserError
        When no log of the data set tells.
    """
    folder = run / "logs" / "data" / dataset
    told = [re.findall(r"([\d.]+) ms a pair", path.read_text(errors="replace")) for path in folder.rglob("*.log")]
    found = [float(values[-1]) for values in told if values]
    if not found:
        raise UserError(f"{folder}: no shard's log tells the time of a pair")
    return 1e-3 * sum(found) / len(found)


def pair_bytes(run: Path, dataset: str) -> float:
    """Bytes of a pair in a run's first shard.

    Raises
    ------
    UserError
        When there is none.
    """
    shards = sorted((run / "data" / dataset).rglob("shard*.h5"))
    if not shards:
        raise UserError(f"{run / 'data' / dataset}: no shards")
    return shards[0].stat().st_size / read_json(run / "specs" / "data" / f"{dataset}.json")["pairs"]


def row_of(run: Path, net: str, settings: Mapping, synthesizes: bool) -> dict:
    """Costs of one net at a scale.

    Parameters
    ----------
    run : Path
        The finished run.
    net : str
    settings : mapping
        Of `anthro.config.load`, at the scale that is asked for.
    synthesizes : bool
        Whether the data's cost is this net's.

    Raises
    ------
    UserError
        Naming the file, when the run lacks what is needed.
    """
    dataset = settings["nets"][net]["dataset"]
    role, sizes = role_of(dataset), sizes_of(settings, dataset)
    rounds = sizes["rounds"] if role == "voluntary" else 1
    pairs = sizes[role]["shards"] * sizes[role]["pairs"]  # a round
    cards = [read_json(path) for path in sorted((run / "nets" / net).glob("round*/run_card.json"))]
    taken = sum(card["epochs"] * card["pairs"]["training"] for card in cards)
    rate = taken / sum(card["training_seconds"] for card in cards)
    steps = (1 - VALIDATING) * pairs * rounds * (rounds + 1) / 2 * sizes["epochs"][role]
    operations = PASSES * cards[-1]["weights"] * steps
    row = {"net": net, "pairs": pairs * rounds}
    if synthesizes:
        seconds = pair_seconds(run, dataset)
        row["synthesis_ms_a_pair"] = 1e3 * seconds
        row["synthesis_cpu_hours"] = seconds * pairs * rounds / HOUR
        row["shard_gigabytes"] = pair_bytes(run, dataset) * pairs * rounds / 1e9
    return row | {
        "weights": cards[-1]["weights"],
        "training_petaflop": operations / 1e15,
        "training_cpu_hours": steps / rate / HOUR,
        "training_gpu_hours": operations / GPU_FLOPS / HOUR,
    }


def table(run: Path, settings: Mapping) -> list[dict]:
    """Costs of all nets that a run trained, and their sum.

    Raises
    ------
    UserError
        When the run trained none, or lacks what is needed.
    """
    trained = [net for net in registry.NETS if list((run / "nets" / net).glob("round*/run_card.json"))]
    if not trained:
        raise UserError(f"{run}: no trained nets")
    rows, seen = [], set()
    for net in trained:
        dataset = settings["nets"][net]["dataset"]
        rows.append(row_of(run, net, settings, dataset not in seen))
        seen.add(dataset)
    summed = [name for name in COLUMNS if name not in ("pairs", "synthesis_ms_a_pair", "weights")]
    return [*rows, {"net": "all"} | {name: sum(row.get(name, 0.0) for row in rows) for name in summed}]


def texts(row: dict) -> list[str]:
    """A row's cells for a person."""
    return [row["net"], *(format(row[name], form) if name in row else "" for name, form in COLUMNS.items())]


def markdown(rows: Sequence[dict]) -> str:
    """The table in Markdown."""
    head = ["net", *(name.replace("_", " ") for name in COLUMNS)]
    lines = [head, ["---"] * len(head), *map(texts, rows)]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def main(argv: Sequence[str] | None = None) -> None:
    """Print the table in Markdown, or write it as CSV."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--run", required=True, type=Path, metavar="DIR", help="a finished run, results/<run>")
    parser.add_argument("--scale", default="paper", help="the scale whose cost is asked for (default paper)")
    parser.add_argument("--out", metavar="FILE", help="CSV file to write")
    given = parser.parse_args(argv)
    rows = table(given.run, load({"scale": given.scale}))
    if given.out:
        with atomic(given.out) as partial, open(partial, "w", newline="", encoding="utf-8") as file:
            writer = csv.writer(file, lineterminator="\n")
            writer.writerow(["net", *COLUMNS])
            writer.writerows([text.replace(",", "") for text in texts(row)] for row in rows)
    print(markdown(rows))


if __name__ == "__main__":
    sys.exit(cli.run(main))
