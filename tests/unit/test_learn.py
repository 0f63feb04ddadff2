"""Networks, data sets and the one training loop (anthro.learn)."""

import errno
import json
import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from anthro import cli
from anthro.files import read_json, write_json, write_shard
from anthro.learn import checkpoint
from anthro.learn import rows as rows_module
from anthro.learn import train as train_module
from anthro.learn.data import TRAINING, UNUSED, VALIDATION, Moments, find_pairs, normalise, survey, validation_side
from anthro.learn.device import choose_device
from anthro.learn.networks import Network
from anthro.learn.rows import Rows
from anthro.learn.spec import read_spec
from anthro.learn.train import COLUMNS, Training, train
from anthro.motor.network import FeedForward

torch = pytest.importorskip("torch")

SPEC = {
    "name": "tiny",
    "paper": "nakada2018",
    "inputs": ["offset", "drive"],
    "outputs": ["voluntary"],
    "hidden": [12, 12],
    "learning_rate": 3e-3,
    "batch_size": 32,
    "epochs": 6,
    "patience": 10,
    "softening": {"offset": 0.02},
    "seed": 3,
}


def shard(path, n=300, seed=0, **replaced):
    generator = np.random.default_rng(seed)
    offset = generator.normal(0, 0.1, (n, 3))
    drive = generator.normal(0.5, 0.3, (n, 4))
    label = np.tanh(5 * offset[:, :2]) * drive[:, :2] + 0.01 * generator.normal(size=(n, 2))
    columns = {"offset": offset, "drive": drive, "voluntary": label} | replaced
    write_shard(path, {name: values.astype(np.float32) for name, values in columns.items()})
    return str(path)


@pytest.fixture
def job(tmp_path):
    """Return a function that writes a spec and gives the arguments of `train`."""
    shards = [shard(tmp_path / f"shard{i}.h5", seed=i) for i in range(2)]

    def make(name="a", **changes):
        write_json(tmp_path / f"{name}.json", SPEC | changes)
        return {
            "spec_path": tmp_path / f"{name}.json",
            "shards": shards,
            "out": tmp_path / name,
            "state_folder": tmp_path / "state" / name,
        }

    return make


def start(job: dict) -> Training:
    """Return a training before its first epoch."""
    spec = read_spec(job["spec_path"])[0]
    pairs = find_pairs(spec, job["shards"])
    return Training(spec, Rows(pairs, survey(pairs)[0], job["state_folder"]))


def joined(pairs) -> tuple[np.ndarray, ...]:
    """Return the inputs, outputs and sides of all pairs."""
    blocks = list(pairs.blocks())
    return tuple(np.concatenate([getattr(block, part) for block in blocks]) for part in ("inputs", "outputs", "side"))


def arguments(job: dict) -> list[str]:
    spec, out, state = (str(job[name]) for name in ("spec_path", "out", "state_folder"))
    return ["--spec", spec, "--shards", *job["shards"], "--out", out, "--state", state]


def losses(out, seconds=False) -> list[str]:
    rows = (out / "loss.csv").read_text().splitlines()
    return rows if seconds else [row.rpartition(",")[0] for row in rows]


def test_initial_weights_are_hes():
    network = Network((400, 300, 300, 200), np.random.default_rng(0))
    for layer in network.layers:
        weight = layer.weight.detach().numpy()
        assert np.abs(weight.std() / np.sqrt(2 / layer.in_features) - 1) < 0.02
        assert np.abs(weight.mean()) < 4 * weight.std() / np.sqrt(weight.size)
        assert not layer.bias.any()


def test_initial_weights_keep_the_signals_size():
    network = Network((200, *[300] * 6, 200), np.random.default_rng(0))
    x = torch.randn(500, 200, generator=torch.Generator().manual_seed(0))
    ratio = (network(x).square().mean() / x.square().mean()).item()
    assert 1 < ratio < 4  # He: each hidden layer keeps the mean square, the linear last one doubles it


@settings(deadline=None, max_examples=10)
@given(seed=st.integers(0, 1000))
def test_gradient_is_that_of_finite_differences(seed):
    generator = np.random.default_rng(seed)
    network = Network((3, 5, 4, 2), generator).double()
    x, y = (torch.from_numpy(generator.normal(size=(7, width))) for width in (3, 2))
    for layer in network.layers:
        layer.bias.data.copy_(torch.from_numpy(generator.normal(size=layer.bias.shape)))

    def loss():
        return torch.nn.functional.mse_loss(network(x), y)

    loss().backward()
    step = 1e-7
    for parameter in network.parameters():
        flat, gradient = parameter.data.view(-1), parameter.grad.view(-1)
        for index in range(len(flat)):
            kept, sides = flat[index].item(), []
            for sign in (1, -1):
                flat[index] = kept + sign * step
                sides.append(loss().item())
            flat[index] = kept
            assert abs((sides[0] - sides[1]) / (2 * step) - gradient[index].item()) < 1e-5


@given(n=st.integers(1, 3000), block=st.integers(1, 40), seed=st.integers(0, 99))
def test_a_tenth_validates(n, block, seed):
    side = validation_side(n, np.random.default_rng(seed), block)
    assert side.shape == (n,)
    assert abs(side.sum() - n / 10) <= block
    if n % (10 * block) == 0:
        assert side.sum() * 10 == n
    whole = side[: n // block * block].reshape(-1, block)
    assert (whole.all(axis=1) | ~whole.any(axis=1)).all()


def test_split_stays_when_a_round_is_added(job):
    spec = read_spec(job()["spec_path"])[0]
    shards = job()["shards"]
    before, after = (find_pairs(spec, part).sides for part in (shards[:1], shards))
    np.testing.assert_array_equal(before[0], after[0])
    assert (np.concatenate(after) == VALIDATION).sum() == 60
    assert before[0].tolist() != after[1].tolist()


def test_both_sides_hold_other_pairs(job):
    rows = start(job()).rows
    sides = [
        {tuple(row) for x, _ in side for row in x.numpy().tolist()}
        for side in (rows.batches(np.arange(rows.training), 32), rows.held_out())
    ]
    assert not sides[0] & sides[1]
    assert [len(side) for side in sides] == [rows.training, rows.validation] == [540, 60]


def test_samples_choose_so_many_pairs_and_always_the_same(job):
    arguments = job(samples=200)
    spec = read_spec(arguments["spec_path"])[0]
    pairs = find_pairs(spec, arguments["shards"])
    whole = find_pairs(read_spec(job("whole")["spec_path"])[0], arguments["shards"])
    assert (pairs.count(TRAINING), pairs.count(VALIDATION), pairs.count(UNUSED)) == (180, 20, 400)
    assert [len(part) for part in joined(pairs)] == [200] * 3
    for sides, known in zip(pairs.sides, whole.sides, strict=True):
        assert (sides[sides != UNUSED] == known[sides != UNUSED]).all()
    assert survey(pairs)[1] == survey(find_pairs(spec, arguments["shards"]))[1]
    other = read_spec(job("b", samples=200, seed=4)["spec_path"])[0]
    assert survey(pairs)[1] != survey(find_pairs(other, arguments["shards"]))[1]


def test_normalisation_comes_from_the_training_side(job, tmp_path):
    spec = read_spec(job()["spec_path"])[0]
    first = find_pairs(spec, job()["shards"][:1])
    inputs, outputs, side = joined(first)
    outputs[side == VALIDATION] += 100
    moved = [shard(tmp_path / "moved.h5", offset=inputs[:, :3], drive=inputs[:, 3:], voluntary=outputs)]
    pairs = find_pairs(spec, moved)
    factors, _ = survey(pairs)
    rows = np.concatenate([normalise(block, factors) for block in pairs.blocks()])
    training = rows[side == TRAINING]
    np.testing.assert_allclose(training.mean(axis=0), 0, atol=1e-5)
    np.testing.assert_allclose(training.std(axis=0), 1, atol=1e-4)
    raw = np.arcsinh(inputs[side == TRAINING][:, 0] / 0.02)
    np.testing.assert_allclose(training[:, 0], (raw - raw.mean()) / raw.std(), atol=1e-4)


@given(
    parts=st.lists(st.integers(0, 9), min_size=1, max_size=6).filter(lambda parts: sum(parts) > 0),
    offset=st.sampled_from([0.0, 1e4]),
    seed=st.integers(0, 99),
)
def test_moments_of_parts_are_those_of_the_whole(parts, offset, seed):
    generator = np.random.default_rng(seed)
    values = (generator.normal(offset, 1, (sum(parts), 3)) * [1, 1e-3, 1]).astype(np.float32)
    values[:, 2] = 0.7
    moments = Moments()
    for part in np.split(values, np.cumsum(parts)[:-1]):
        moments.add(part)
    exact = values.astype(float)
    np.testing.assert_allclose(moments.mean, exact.mean(axis=0), rtol=1e-12, atol=1e-15)
    np.testing.assert_allclose(moments.variance, exact.var(axis=0), rtol=1e-8, atol=1e-15)
    np.testing.assert_array_equal(moments.largest, np.abs(values).max(axis=0))
    assert moments.scale[2] == 1


def test_normalised_rows_are_the_pairs_whatever_the_block(job, monkeypatch):
    spec = read_spec(job()["spec_path"])[0]
    pairs = find_pairs(spec, job()["shards"])
    inputs, outputs, side = joined(pairs)
    factors, digest = survey(pairs)
    monkeypatch.setattr("anthro.learn.data.BLOCK", 70)
    again, _ = survey(pairs)
    for name in factors:
        np.testing.assert_allclose(again[name], factors[name], rtol=1e-6, atol=1e-7)
    rows = Rows(pairs, factors, job()["state_folder"])
    order = np.random.default_rng(0).permutation(rows.training)
    drawn = [torch.cat(part).numpy() for part in zip(*rows.batches(order, 32), strict=True)]
    expected = (outputs - factors["output_mean"]) / factors["output_scale"]
    np.testing.assert_allclose(drawn[1], expected[side == TRAINING][order], atol=1e-6)
    held = torch.cat([y for _, y in rows.held_out()]).numpy()
    np.testing.assert_allclose(held, expected[side == VALIDATION], atol=1e-6)
    drive = (inputs[:, 3:] - factors["input_mean"][3:]) / factors["input_scale"][3:]
    np.testing.assert_allclose(drawn[0][:, 3:], drive[side == TRAINING][order], atol=1e-6)
    assert os.listdir(job()["state_folder"]) == []


def test_pages_are_given_back_and_read_again(job, monkeypatch):
    def draw():
        rows = start(job()).rows
        order = np.random.default_rng(0).permutation(rows.training)
        for _ in range(2):
            drawn = [x.numpy() for x, _ in rows.batches(order, 32)]
        return np.concatenate(drawn + [x.numpy().copy() for x, _ in rows.held_out()]), rows

    (kept, _) = draw()
    monkeypatch.setattr(rows_module, "RESIDENT", 10_000)
    released, rows = draw()
    assert rows.bytes > 10_000 >= rows._resident
    np.testing.assert_array_equal(kept, released)


def test_a_constant_column_does_no_harm(job, tmp_path):
    arguments = job()
    arguments["shards"] = [shard(tmp_path / "flat.h5", drive=np.full((300, 4), 0.7))]
    network = train(**arguments)
    assert np.isfinite(network.predict(np.full(7, 0.7))).all()


def test_training_learns_and_reports(job):
    arguments = job(epochs=60, patience=60)
    network = train(**arguments)
    assert losses(arguments["out"], seconds=True)[0] == ",".join(COLUMNS)
    card = read_json(arguments["out"] / "run_card.json")
    best = card["best"]
    assert best["unexplained_variance"] < 0.2
    assert card["spec"]["hidden"] == [12, 12]
    assert (card["weights"], card["pairs"]["validation"]) == (7 * 12 + 12 * 12 + 12 * 2, 60)
    inputs, outputs, side = joined(find_pairs(read_spec(arguments["spec_path"])[0], arguments["shards"]))
    labels = outputs[side == VALIDATION]
    error = ((network.predict(inputs[side == VALIDATION]) - labels) ** 2).mean(axis=0)
    np.testing.assert_allclose(best["validation_mse_physical"], error.mean(), rtol=1e-4)
    np.testing.assert_allclose(best["unexplained_variance"], error.sum() / labels.var(axis=0).sum(), rtol=1e-4)
    np.testing.assert_allclose(best["unexplained_variance_per_output"], error / labels.var(axis=0), rtol=1e-4)
    mse = np.array([float(row.split(",")[2]) for row in losses(arguments["out"])[1:]])
    assert best["epoch"] == mse.argmin() + 1 == network.attrs["epoch"]
    assert not arguments["state_folder"].exists()


def test_the_same_training_gives_the_same_bytes(job):
    first, second = job("a"), job("a") | {"out": job("a")["out"].with_name("again")}
    for arguments in (first, second):
        train(**arguments)
    assert (first["out"] / "weights.h5").read_bytes() == (second["out"] / "weights.h5").read_bytes()
    assert losses(first["out"]) == losses(second["out"])


class Killed(BaseException):
    """Stands for the end of the process."""


@pytest.mark.parametrize("after", [1, 3, 6])
def test_resumed_training_equals_an_uninterrupted_one(job, monkeypatch, after, capsys):
    whole, broken = job("a", schedule="cosine"), job("a", schedule="cosine")
    broken |= {"out": whole["out"].with_name("broken"), "state_folder": whole["out"].with_name("resume")}
    train(**whole)
    save, epochs = checkpoint.save_state, []

    def save_and_die(folder, stamp, state):
        save(folder, stamp, state)
        epochs.append(len(state["history"]))
        if len(epochs) == after:
            raise Killed

    monkeypatch.setattr("anthro.learn.train.SPARING", 0)
    monkeypatch.setattr(checkpoint, "save_state", save_and_die)
    with pytest.raises(Killed):
        train(**broken)
    train(**broken)
    assert epochs == list(range(1, 7))
    assert (whole["out"] / "weights.h5").read_bytes() == (broken["out"] / "weights.h5").read_bytes()
    assert losses(whole["out"]) == losses(broken["out"])
    assert f"resumes after epoch {after}" in capsys.readouterr().err


def test_killed_process_goes_on(job):
    broken, whole = (job("a", epochs=80, patience=80, hidden=[40, 40]) for _ in range(2))
    whole |= {"out": whole["out"].with_name("whole"), "state_folder": None}
    command = [sys.executable, "-m", "anthro.learn.train", *arguments(broken)]
    process = subprocess.Popen(command, stderr=subprocess.DEVNULL, stdout=subprocess.DEVNULL)
    state = broken["state_folder"] / checkpoint.STATE
    limit = time.monotonic() + 60
    while not state.exists() and process.poll() is None and time.monotonic() < limit:
        time.sleep(0.005)
    time.sleep(0.05)
    os.kill(process.pid, signal.SIGKILL)
    assert process.wait() == -signal.SIGKILL
    assert not (broken["out"] / "weights.h5").exists()
    train(**broken)
    train(**whole)
    assert (whole["out"] / "weights.h5").read_bytes() == (broken["out"] / "weights.h5").read_bytes()
    assert not broken["state_folder"].exists()


def test_stale_or_broken_state_is_ignored(job, capsys):
    arguments = job()
    training = start(arguments)
    training.run_epoch()
    checkpoint.save_state(arguments["state_folder"], "another", training.state())
    assert checkpoint.load_state(arguments["state_folder"], "this") is None
    assert checkpoint.load_state(arguments["state_folder"], "another")["history"][0]["epoch"] == 1
    path = arguments["state_folder"] / checkpoint.STATE
    path.write_bytes(path.read_bytes()[:1000])
    train(**arguments)
    assert "starts afresh" in capsys.readouterr().err
    assert len(losses(arguments["out"])) == 7


@pytest.mark.parametrize("change", [{"seed": 5}, {"learning_rate": 1e-3}])
def test_a_state_of_another_spec_is_not_taken_up(job, monkeypatch, change):
    first = job("a")
    monkeypatch.setattr(checkpoint, "drop_state", lambda folder: None)
    train(**first)
    second = job("b", **change) | {"state_folder": first["state_folder"]}
    alone = job("b", **change) | {"out": second["out"].with_name("alone"), "state_folder": None}
    train(**second)
    train(**alone)
    assert losses(second["out"]) == losses(alone["out"]) != losses(first["out"])


def test_stops_early_and_keeps_the_best(job, tmp_path):
    arguments = job(epochs=200, patience=4, learning_rate=0.02)
    noise = np.random.default_rng(1).normal(size=(300, 2))
    arguments["shards"] = [shard(tmp_path / "noise.h5", voluntary=noise)]
    train(**arguments)
    card = read_json(arguments["out"] / "run_card.json")
    assert card["stopped_early"]
    assert card["epochs"] == card["best"]["epoch"] + 4 < 200
    mse = [float(row.split(",")[2]) for row in losses(arguments["out"])[1:]]
    assert np.argmin(mse) + 1 == card["best"]["epoch"]


def test_schedules(job):
    constant = read_spec(job()["spec_path"])[0]
    assert {constant.rate(epoch) for epoch in range(1, 7)} == {3e-3}
    cosine = read_spec(job(schedule="cosine")["spec_path"])[0]
    rates = [cosine.rate(epoch) for epoch in range(1, 7)]
    assert rates == sorted(rates, reverse=True)
    np.testing.assert_allclose([rates[0], rates[-1]], [3e-3, 3e-5])


def fails(arguments_: list[str], capsys, *words) -> None:
    """Check that the command ends with exit code 2 and one line that holds `words`."""
    assert cli.run(train_module.main, arguments_) == 2
    told = [line for line in capsys.readouterr().err.splitlines() if line.startswith("error:")]
    assert len(told) == 1
    for word in words:
        assert word in told[0]


@pytest.mark.parametrize("value", [np.nan, np.inf])
@pytest.mark.parametrize("column", ["drive", "voluntary"])
def test_bad_numbers_name_shard_and_column(job, tmp_path, capsys, value, column):
    values = np.zeros((300, 4 if column == "drive" else 2))
    values[17, 1] = value
    arguments_ = job()
    arguments_["shards"].append(shard(tmp_path / "bad.h5", **{column: values}))
    fails(arguments(arguments_), capsys, "bad.h5", column, "row 17")


def test_truncated_shard(job, capsys):
    arguments_ = job()
    with open(arguments_["shards"][1], "r+b") as file:
        file.truncate(3000)
    fails(arguments(arguments_), capsys, "shard1.h5")


def test_shard_of_another_width(job, tmp_path, capsys):
    arguments_ = job()
    arguments_["shards"].append(shard(tmp_path / "wide.h5", voluntary=np.zeros((300, 3))))
    fails(arguments(arguments_), capsys, "wide.h5", "width")


@pytest.mark.parametrize(
    "changes",
    [
        {"learning_rate": -1},
        {"hidden": []},
        {"hidden": [10, 0]},
        {"batch_size": 2.5},
        {"epochs": True},
        {"schedule": "linear"},
        {"softening": {"strain": 0.1}},
        {"seed": -1},
        {"inputs": "offset"},
        {"samples": 0},
    ],
)
def test_bad_spec_names_file_key_and_value(job, capsys, changes):
    fails(arguments(job(**changes)), capsys, "a.json", *changes)


def test_missing_key_and_too_few_pairs(job, capsys, tmp_path):
    arguments_ = job()
    write_json(arguments_["spec_path"], {k: v for k, v in SPEC.items() if k != "epochs"})
    fails(arguments(arguments_), capsys, "a.json", "epochs")
    fails(arguments(job("b", samples=10_000)), capsys, "10000", "600")
    fails([*arguments(job("c")), "--threads", "0"], capsys, "threads")
    few = job("d") | {"shards": [shard(tmp_path / "few.h5", n=1)]}
    fails(arguments(few), capsys, "too few")


def test_exploding_loss_names_the_epoch_and_keeps_the_best(job, capsys, monkeypatch):
    arguments_ = job()
    validate = Training.validate

    def explode(self):
        scores = validate(self)
        return scores | {"validation_mse": np.nan} if len(self.history) == 3 else scores

    monkeypatch.setattr(Training, "validate", explode)
    fails(arguments(arguments_), capsys, "epoch 4", "best_weights.h5")
    network = FeedForward.load(arguments_["state_folder"] / "best_weights.h5")
    assert network.attrs["epoch"] == 3
    assert not (arguments_["out"] / "run_card.json").exists()


def full_disk(*_args, **_kwargs):
    raise OSError(errno.ENOSPC, "No space left on device")


def test_full_disk_loses_no_finished_epoch(job, capsys, monkeypatch):
    whole = job("a") | {"out": job("a")["out"].with_name("whole"), "state_folder": None}
    train(**whole)
    arguments_ = job("a")
    run_epoch, write = Training.run_epoch, os.replace
    epochs = []

    def counted(self):
        run_epoch(self)
        epochs.append(len(self.history))
        if epochs == [1, 2, 3]:
            monkeypatch.setattr(os, "replace", full_disk)

    monkeypatch.setattr(Training, "run_epoch", counted)
    monkeypatch.setattr(train_module, "SPARING", 0)
    fails(arguments(arguments_), capsys, "No space left")
    assert sorted(os.listdir(arguments_["state_folder"])) == [checkpoint.STATE]
    monkeypatch.setattr(os, "replace", write)
    assert cli.run(train_module.main, arguments(arguments_)) == 0
    assert epochs == [1, 2, 3, 3, 4, 5, 6]
    assert (whole["out"] / "weights.h5").read_bytes() == (arguments_["out"] / "weights.h5").read_bytes()


def test_full_disk_at_the_end_repeats_no_epoch(job, capsys, monkeypatch):
    arguments_ = job()
    with monkeypatch.context() as patch:
        patch.setattr(FeedForward, "save", full_disk)
        fails(arguments(arguments_), capsys, "No space left")
    monkeypatch.setattr(Training, "run_epoch", lambda self: pytest.fail("an epoch was repeated"))
    assert cli.run(train_module.main, arguments(arguments_)) == 0
    assert len(losses(arguments_["out"])) == 7


def test_no_room_for_the_rows_is_told(job, capsys, monkeypatch):
    monkeypatch.setattr(Rows, "_write", full_disk)
    fails(arguments(job()), capsys, "state", "GiB", "No space left")


@pytest.mark.parametrize(("wanted", "there", "chosen"), [
    ("auto", True, "cuda"), ("auto", False, "cpu"), ("cpu", True, "cpu"), ("cuda", True, "cuda"),
])  # fmt: skip
def test_device(monkeypatch, wanted, there, chosen):
    monkeypatch.setattr(torch.cuda, "is_available", lambda: there)
    assert choose_device(wanted).type == chosen


def test_device_that_is_not_there(job, capsys, monkeypatch):
    monkeypatch.setattr(torch.cuda, "is_available", lambda: False)
    fails([*arguments(job()), "--device", "cuda"], capsys, "device", "cuda")


def test_batches_go_to_the_device(job, monkeypatch):
    monkeypatch.setattr(torch.Tensor, "pin_memory", lambda self: self)
    spec = read_spec(job()["spec_path"])[0]
    pairs = find_pairs(spec, job()["shards"])
    rows = Rows(pairs, survey(pairs)[0], job()["state_folder"], "meta")
    for x, y in [*rows.batches(np.arange(rows.training), 32), *rows.held_out()]:
        assert (x.device.type, y.device.type, x.shape[1], y.shape[1]) == ("meta", "meta", 7, 2)


@pytest.mark.parametrize("free", [0, 10**9])
def test_a_gpu_holds_all_rows_if_they_fit(job, monkeypatch, free):
    """The GPU's calls are stood in for by the CPU's: what is drawn stays the same."""
    plain = start(job()).rows
    monkeypatch.setattr(torch.cuda, "mem_get_info", lambda device: (free, free))
    empty = torch.empty
    monkeypatch.setattr(torch, "empty", lambda *shape, dtype, device: empty(*shape, dtype=dtype))
    spec = read_spec(job()["spec_path"])[0]
    pairs = find_pairs(spec, job()["shards"])
    monkeypatch.setattr(torch.Tensor, "pin_memory", lambda self: self)
    monkeypatch.setattr(torch.Tensor, "to", lambda self, *where, **how: self)
    rows = Rows(pairs, survey(pairs)[0], job()["state_folder"], "cuda")
    order = np.arange(540)[::-1].copy()
    for a, b in zip(plain.batches(order, 100), rows.batches(order, 100), strict=True):
        assert torch.equal(a[0], b[0])
        assert torch.equal(a[1], b[1])
    assert (rows._table.data_ptr() == torch.frombuffer(rows._map, dtype=torch.uint8).data_ptr()) == (not free)


def test_card_is_json_and_says_what_was_used(job):
    arguments_ = job()
    train(**arguments_, threads=1)
    card = json.loads((arguments_["out"] / "run_card.json").read_text())
    for name in ("spec", "spec_digest", "data_digest", "seed", "threads", "device", "wall_seconds", "versions", "best"):
        assert name in card
