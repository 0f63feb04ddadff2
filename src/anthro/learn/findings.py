"""What the papers found about shapes, depths and widths (their Appendices A), checked on our own trainings.

Epochs to converge: the first epoch (interpolated) whose validation MSE is within 5 % of the best of
the table's worst net, a level that every net of the table reaches. Time per epoch: the median over
epochs of training and validation, on the machine of this run (the paper's was a GPU, where small
layers cost nearly as much as larger ones). A ratio of 1 is neither more nor less.
"""

import argparse
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from scipy.stats import spearmanr

from anthro import cli, registry
from anthro.errors import UserError
from anthro.files import write_json
from anthro.learn.curves import Trial, common_level, read_table

SHAPES = (
    (100,) * 5,
    (300,) * 5,
    (500,) * 5,
    (300, 250, 200, 150, 100),
    (500, 400, 300, 200, 100),
    (100, 200, 300, 400, 500),
    (100, 200, 300, 200, 100),
    (300, 200, 100, 200, 300),
    (3000, 3000),
)
DEPTHS = ((1800,), (900,) * 2, (600,) * 3, (450,) * 4, (360,) * 5, (300,) * 6, (257,) * 7, (225,) * 8)


def by_number(trials: list[Trial], known: Sequence[tuple[int, ...]]) -> dict[int, Trial]:
    """Return a table's rows by the paper's number, 1 to ``len(known)``.

    Raises
    ------
    UserError
        Naming the shapes that were not trained.
    """
    found = {trial.hidden: trial for trial in trials}
    if missing := [str(list(hidden)) for hidden in known if hidden not in found]:
        raise UserError(f"not trained: {', '.join(missing)}")
    return {number: found[hidden] for number, hidden in enumerate(known, start=1)}


def _rows(item: str, source: str, statements: Sequence[tuple], paper: str = "nakada2018") -> list[dict]:
    return [
        {
            "paper": paper,
            "item": item,
            "metric": metric,
            "value": round(float(value), 6),
            "unit": unit,
            "target": target,
            "source": source,
            "sense": sense,
        }
        for metric, value, unit, sense, target in statements
    ]


def _rises(values: Sequence[float]) -> int:
    """Count the steps that go up."""
    return int(np.sum(np.diff(values) > 0))


def shape_findings(trials: list[Trial]) -> list[dict]:
    """Check the statements of A.1 (nine shapes); rows for the scorecard."""
    nets = by_number(trials, SHAPES)
    level = common_level(trials)
    epochs = {number: net.epochs_to(level) for number, net in nets.items()}
    seconds = {number: net.epoch_seconds for number, net in nets.items()}
    best = {number: net.best for number, net in nets.items()}
    slender = np.median([epochs[number] for number in range(4, 9)])
    deep = [seconds[number] for number in range(1, 9)]
    wide = seconds[9] / np.mean(deep)
    order = spearmanr([net.weights for net in nets.values()], list(seconds.values())).statistic
    return _rows(
        "Fig. 28a,b",
        "A.1",
        (
            ("nets that converged, of 9", sum(net.settled for net in nets.values()), "", "equal", 9),
            ("epochs to converge, (2) over (1)", epochs[2] / epochs[1], "ratio", "max", 1),
            ("epochs to converge, (3) over (2)", epochs[3] / epochs[2], "ratio", "max", 1),
            (
                "(1) converges less well: MSE over the worse of (2), (3)",
                best[1] / max(best[2], best[3]),
                "ratio",
                "min",
                1.1,
            ),
            ("(3) among the best: rank of its MSE, of 9", sorted(best.values()).index(best[3]) + 1, "rank", "max", 3),
            (
                "(4) to (8) are slower: median epochs over those of (2), (3)",
                slender / np.mean([epochs[2], epochs[3]]),
                "ratio",
                "min",
                1,
            ),
            (
                "(9) needs fewer epochs: over the median of the others",
                epochs[9] / np.median([epochs[number] for number in range(1, 9)]),
                "ratio",
                "max",
                1,
            ),
        ),
    ) + _rows(
        "Fig. 29a",
        "A.1",
        (
            ("time an epoch grows with the weights: rank correlation", order, "", "min", 0.9),
            ("time an epoch, (9) over the mean of (1) to (8): at least", wide, "ratio", "min", 6),
            ("time an epoch, (9) over the mean of (1) to (8): at most", wide, "ratio", "max", 8),
            ("time an epoch, (9) over the costliest of (1) to (8)", seconds[9] / max(deep), "ratio", "info", None),
            (
                "weights, (9) over the mean of (1) to (8)",
                nets[9].weights / np.mean([nets[number].weights for number in range(1, 9)]),
                "ratio",
                "info",
                None,
            ),
        ),
    )


def depth_findings(trials: list[Trial]) -> list[dict]:
    """Check the statements of A.2 (eight depths of about 1,800 hidden units); rows for the scorecard."""
    nets = by_number(trials, DEPTHS)
    level = common_level(trials)
    epochs = [net.epochs_to(level) for net in nets.values()]
    seconds = [net.epoch_seconds for net in nets.values()]
    return _rows(
        "Fig. 28c,d",
        "A.2",
        (
            ("nets that converged, of 8", sum(net.settled for net in nets.values()), "", "equal", 8),
            ("steps of depth from 1 to 6 that need fewer epochs, of 5", _rises([-n for n in epochs[:6]]), "", "min", 5),
            ("epochs to converge, depth 7 over 6", epochs[6] / epochs[5], "ratio", "min", 1),
            ("epochs to converge, depth 8 over 7", epochs[7] / epochs[6], "ratio", "max", 1),
        ),
    ) + _rows(
        "Fig. 29b",
        "A.2",
        (
            ("steps of depth from 1 to 6 that take longer an epoch, of 5", _rises(seconds[:6]), "", "min", 5),
            (
                "time an epoch, longest over shortest of depths 6 to 8",
                max(seconds[5:]) / min(seconds[5:]),
                "ratio",
                "max",
                1.1,
            ),
            ("time an epoch, depth 7 over 6", seconds[6] / seconds[5], "ratio", "max", 1),
            ("time an epoch, depth 8 over 7", seconds[7] / seconds[6], "ratio", "min", 1),
        ),
    )


def learning_rate_findings(trials: list[Trial]) -> list[dict]:
    """Compare the two rates that the paper prints, 1e-6 and 1e-3, on the same net and data."""
    best = {trial.learning_rate: trial.losses["unexplained_variance"].min() for trial in trials}
    if missing := {1e-6, 1e-3} - set(best):
        raise UserError(f"learning rates not trained: {', '.join(map(str, sorted(missing)))}")
    unexplained = [
        (f"unexplained variance at a rate of {rate:g}", value, "", "info", None) for rate, value in sorted(best.items())
    ]
    reading = ("1e-3 is Adam's step size: unexplained variance at 1e-3 over 1e-6", best[1e-3] / best[1e-6], "ratio")
    return _rows("learning rates", "Sec. 5, footnote 1", (*unexplained, (*reading, "max", 0.5)))


def core_width_findings(trials: list[Trial]) -> list[dict]:
    """Check what Zhou 2021 says of 300 against 600 units a hidden layer of the core's nets."""
    best = {trial.row: trial.best for trial in trials}
    wanted = [f"{role}_{width}" for role in ("voluntary", "reflex") for width in (300, 600)]
    if missing := [row for row in wanted if row not in best]:
        raise UserError(f"core widths not trained: {', '.join(missing)}")
    ratio = {role: best[f"{role}_600"] / best[f"{role}_300"] for role in ("voluntary", "reflex")}
    statements = (
        ("voluntary net, 600 does better: MSE over that of 300", ratio["voluntary"], "ratio", "max", 1),
        ("reflex net, not obvious: MSE of 600 over that of 300", ratio["reflex"], "ratio", "info", None),
    )
    return _rows("Fig. 15", "App. A", statements, "zhou2021")


CHECKS: dict[str, Callable[[list[Trial]], list[dict]]] = {
    "shapes": shape_findings,
    "depths": depth_findings,
    "learning_rates": learning_rate_findings,
    "core_widths": core_width_findings,
}


def main(argv: Sequence[str] | None = None) -> None:
    """Check the findings on a run's ablations."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--run", required=True, metavar="DIR", help="the run's folder, results/<run>")
    parser.add_argument("--out", required=True, metavar="DIR", help="folder for rows.json")
    given = parser.parse_args(argv)
    rows = [row for table in registry.ABLATIONS for row in CHECKS[table](read_table(given.run, table))]
    write_json(Path(given.out) / "rows.json", rows)
    print(f"{given.run}: {len(rows)} statements of the papers checked")


if __name__ == "__main__":
    sys.exit(cli.run(main))
