"""The one training loop, for every network.

Adam on the mean squared error of normalised labels, early stopping, the best epoch's weights kept
(Nakada 2018, Sec. 5, footnote 1). Errors in ``loss.csv`` are normalised: inputs and labels are
standardised with the training side's mean and standard deviation, so that an MSE of 1 is that of
predicting the mean. The run card gives the MSE in the labels' own units too. ``train_mse`` is the
mean over the epoch's batches, taken while the weights move; ``validation_mse`` is measured at the
epoch's end. ``unexplained_variance`` is the validation MSE over the variance of the validation
labels, both summed over outputs in the labels' own units.

Every random draw comes from a stream named by the seed and the epoch, so that a training that was
killed and taken up again ends with the same bytes as one that was not (given the same threads and
the same device).
"""

import argparse
import csv
import math
import os
import sys
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import torch

from anthro import cli
from anthro.errors import UserError
from anthro.files import atomic, canonical, digest
from anthro.learn import checkpoint
from anthro.learn.data import Moments, find_pairs, survey
from anthro.learn.device import DEVICES, choose_device, repeatable
from anthro.learn.linear import start_linear
from anthro.learn.networks import Network
from anthro.learn.retinotopic import start_retinotopic
from anthro.learn.rows import Activations, Rows, Table
from anthro.learn.spec import TrainingSpec, read_spec
from anthro.motor.network import FeedForward, harden, reach_of
from anthro.progress import progress
from anthro.runcard import RunCard
from anthro.streams import stream

SPARING = 10  # states of large nets are written so seldom that ten times as long is spent on epochs
COLUMNS = ("epoch", "train_mse", "validation_mse", "unexplained_variance", "learning_rate", "seconds")


class Training:
    """A training between two epochs.

    Parameters
    ----------
    spec : TrainingSpec
        What is asked for.
    rows : Rows
        The data set, normalised, and the device to train on.

    Attributes
    ----------
    history : list of dict
        One row of ``loss.csv`` an epoch.
    best : dict
        ``epoch``, ``validation_mse``, ``validation_mse_physical``, ``unexplained_variance``,
        ``unexplained_variance_per_output`` and ``weights`` of the best epoch; 0 is a linear start, and it is empty
        before the first epoch of any other.
    """

    def __init__(self, spec: TrainingSpec, rows: Rows):
        self.spec, self.rows = spec, rows
        self.network = Network((rows.n_in, *spec.hidden, rows.n_out), stream(spec.seed, "learn/initial"))
        if spec.start == "linear":
            start_linear(self.network, rows)
        elif spec.start == "retinotopic":
            start_retinotopic(self.network, rows, spec)
        self.network.to(rows.device)
        self.optimiser = torch.optim.Adam(
            self.network.parameters(), lr=spec.learning_rate, betas=(0.9, 0.999), fused=True
        )
        labels = Moments()
        for _, y in rows.held_out():
            labels.add(self._physical(y))
        self._variance = labels.variance
        self.history: list[dict] = []
        self.best: dict = {}
        self._activations: Activations | None = None
        if spec.start == "linear":
            self._remember(0, self.validate())

    @property
    def finished(self) -> bool:
        """Whether all epochs are done, or `patience` of them brought no gain."""
        done = len(self.history)
        return done >= self.spec.epochs or (bool(self.best) and done - self.best["epoch"] >= self.spec.patience)

    def run_epoch(self) -> None:
        """Train for one epoch, validate, and remember the weights if they are the best so far.

        Raises
        ------
        FloatingPointError
            When a loss is not finite; `history` and `best` stay those of the epoch before.
        """
        started = time.perf_counter()
        epoch = len(self.history) + 1
        rate = self.spec.rate(epoch)
        train_mse = self._pass(epoch, rate)
        scores = self.validate()
        if not math.isfinite(train_mse + scores["validation_mse"]):
            raise FloatingPointError(f"the loss is not finite at epoch {epoch}")
        row = {"epoch": epoch, "train_mse": train_mse, "learning_rate": rate} | scores
        row["seconds"] = time.perf_counter() - started
        self.history.append({name: row[name] for name in COLUMNS})
        if not self.best or scores["validation_mse"] < self.best["validation_mse"]:
            self._remember(epoch, scores)

    def _remember(self, epoch: int, scores: dict) -> None:
        weights = {name: value.to("cpu", copy=True) for name, value in self.network.state_dict().items()}
        self.best = {"epoch": epoch, "weights": weights} | scores

    def _pass(self, epoch: int, rate: float) -> float:
        """Take every training pair once, in the epoch's order; return the mean loss."""
        for group in self.optimiser.param_groups:
            group["lr"] = rate
        order = stream(self.spec.seed, "learn/order", epoch).permutation(self.rows.training)
        source, after = self._source(epoch)
        total = torch.zeros((), dtype=torch.float64, device=self.rows.device)
        for inputs, outputs in source.batches(order, self.spec.batch_size):
            self.optimiser.zero_grad(set_to_none=True)
            loss = torch.nn.functional.mse_loss(self.network(inputs, after), outputs)
            loss.backward()
            self.optimiser.step()
            total += loss.detach().double() * len(inputs)
        return total.item() / self.rows.training

    def _source(self, epoch: int) -> tuple[Table, int]:
        """Rows for an epoch, and how many layers they have passed: one while the first layer stays fixed."""
        is_fixed = epoch <= self.spec.fixed_epochs
        self.network.layers[0].requires_grad_(not is_fixed)
        if not is_fixed:
            self._activations = None
            return self.rows, 0
        self._activations = self._activations or Activations(self.rows, self.network.layers[0])
        return self._activations, 1

    @torch.no_grad()
    def validate(self) -> dict:
        """Return the validation side's errors (the numbers of `best`)."""
        source, after = self._source(len(self.history) + 1)
        squared, squared_physical = np.zeros((2, self.rows.n_out))
        for inputs, outputs in source.held_out():
            predicted = self.network(inputs, after)
            squared += (predicted - outputs).double().square().sum(0).cpu().numpy()
            squared_physical += np.square(self._physical(predicted) - self._physical(outputs)).sum(axis=0)
        mse, mse_physical = squared / self.rows.validation, squared_physical / self.rows.validation
        total = self._variance.sum()
        return {
            "validation_mse": float(mse.mean()),
            "validation_mse_physical": float(mse_physical.mean()),
            "unexplained_variance": float(mse_physical.sum() / total) if total else math.nan,
            "unexplained_variance_per_output": [
                float(error / spread) if spread else None
                for error, spread in zip(mse_physical, self._variance, strict=True)
            ],
        }

    def _physical(self, outputs: torch.Tensor) -> np.ndarray:
        """Turn normalised outputs into the labels' own units, float64."""
        factors = self.rows.factors
        values = outputs.cpu().numpy().astype(float) * factors["output_scale"] + factors["output_mean"]
        softening = factors["output_softening"]
        return harden(values, softening, reach_of(softening, factors["output_limit"]))

    def state(self) -> dict:
        """Return all that the next epoch depends on."""
        return {
            "network": self.network.state_dict(),
            "optimiser": self.optimiser.state_dict(),
            "history": self.history,
            "best": self.best,
        }

    def resume(self, state: dict) -> None:
        """Go back to where `state` was taken."""
        self.network.load_state_dict(state["network"])
        self.optimiser.load_state_dict(state["optimiser"])
        self.history, self.best = state["history"], state["best"]

    def result(self, content: dict) -> FeedForward:
        """Return the best epoch's network; `content` is the whole spec, kept as an attribute."""
        network = Network(self.network.sizes)
        network.load_state_dict(self.best["weights"])
        attrs = {"name": self.spec.name, "spec": canonical(content), "spec_digest": self.spec.digest}
        attrs |= {name: self.best[name] for name in ("epoch", "validation_mse", "unexplained_variance")}
        return network.export(self.rows.factors, attrs)


def write_history(path: str | os.PathLike, history: Sequence[dict]) -> None:
    """Write ``loss.csv``, atomically."""
    with atomic(path) as partial, open(partial, "w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(COLUMNS)
        for row in history:
            numbers = (f"{row[name]:.8g}" for name in COLUMNS[1:])
            writer.writerow((row["epoch"], *numbers))


def run_epochs(training: Training, folder: str | os.PathLike | None, stamp: str) -> None:
    """Train until nothing is to be done, leaving the state in `folder` after epochs.

    Raises
    ------
    UserError
        Naming the epoch, when a loss is not finite; the best weights so far are kept in `folder`.
    """
    if folder and (state := checkpoint.load_state(folder, stamp)):
        training.resume(state)
        print(f"{training.spec.name}: resumes after epoch {len(training.history)}", file=sys.stderr)
    left = range(len(training.history), training.spec.epochs)
    due = 0.0
    for _ in progress(left, total=len(left), label=f"{training.spec.name} epochs"):
        if training.finished:
            break
        try:
            training.run_epoch()
        except FloatingPointError as error:
            raise UserError(f"{training.spec.name}: {error}{_rescue(training, folder)}") from None
        if folder and ((started := time.monotonic()) >= due or training.finished):
            checkpoint.save_state(folder, stamp, training.state())
            due = time.monotonic() + SPARING * (time.monotonic() - started)


def _rescue(training: Training, folder: str | os.PathLike | None) -> str:
    """Keep the best weights of a training that failed; return words that say so."""
    if not training.best or not folder:
        return ""
    path = Path(folder) / "best_weights.h5"
    training.result({}).save(path)
    return f"; the best weights so far, of epoch {training.best['epoch']}, are kept in {path}"


def train(
    spec_path: str | os.PathLike,
    shards: Sequence[str | os.PathLike],
    out: str | os.PathLike,
    state_folder: str | os.PathLike | None = None,
    threads: int = 1,
    device: str = "auto",
) -> FeedForward:
    """Train one network and write ``weights.h5``, ``loss.csv`` and ``run_card.json``.

    Parameters
    ----------
    spec_path : path-like
        See `anthro.learn.spec.TrainingSpec`.
    shards : sequence of path-like
        Training pairs, oldest round of aggregation first.
    out : path-like
        Folder of the results.
    state_folder : path-like, optional
        Folder of resume files; a state of another spec, data or device is ignored. The
        normalised pairs lie there too while the training runs (in `out`, if it is not given).
    threads : int
        Threads of the matrix products; the result depends on it in the last bits.
    device : {"auto", "cpu", "cuda"}
        Where to compute; "auto" takes a GPU if there is one. The result depends on it in the last bits.

    Returns
    -------
    FeedForward
        The best epoch's network.

    Raises
    ------
    UserError
        On a bad spec, shard or device, and when a loss is not finite.
    OSError
        When a file cannot be written; what was finished before stays.
    """
    place = choose_device(device)
    spec, content = read_spec(spec_path)
    out = Path(out)
    told = RunCard(out / "run_card.json", spec=content, seed=spec.seed, device=place.type)
    with repeatable(threads), told as card:
        pairs = find_pairs(spec, shards)
        factors, data = survey(pairs)
        rows = Rows(pairs, factors, state_folder or out, place)
        training = Training(spec, rows)
        run_epochs(training, state_folder, digest([spec.digest, data, place.type, torch.__version__]))
        network = training.result(content)
        network.save(out / "weights.h5")
        write_history(out / "loss.csv", training.history)
        card.note(
            data_digest=data,
            threads=threads,
            pairs={"training": rows.training, "validation": rows.validation},
            units=network.units,
            weights=network.weights,
            epochs=len(training.history),
            stopped_early=len(training.history) < spec.epochs,
            training_seconds=round(sum(row["seconds"] for row in training.history), 3),
            best={name: value for name, value in training.best.items() if name != "weights"},
        )
    if state_folder:
        checkpoint.drop_state(state_folder)
    return network


def main(argv: Sequence[str] | None = None) -> None:
    """Train one network and say how well it explains its labels."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--spec", required=True, metavar="FILE", help="what to train (JSON)")
    parser.add_argument("--shards", required=True, nargs="+", metavar="FILE", help="training pairs, oldest round first")
    parser.add_argument("--out", required=True, metavar="DIR", help="for weights.h5, loss.csv, run_card.json")
    parser.add_argument("--state", metavar="DIR", help="resume files; a killed training goes on from there")
    parser.add_argument("--threads", type=int, default=1, help="threads of the matrix products (default 1)")
    parser.add_argument("--device", choices=DEVICES, default="auto", help="where to compute (default: a GPU if any)")
    given = parser.parse_args(argv)
    network = train(given.spec, given.shards, given.out, given.state, given.threads, given.device)
    attrs = network.attrs
    print(
        f"{attrs['name']}: {network.n_in} inputs, {network.n_out} outputs, {network.weights} weights; "
        f"best epoch {attrs['epoch']}, validation MSE {attrs['validation_mse']:.4g} (normalised), "
        f"unexplained variance {attrs['unexplained_variance']:.4g}"
    )


if __name__ == "__main__":
    sys.exit(cli.run(main))
