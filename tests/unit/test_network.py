"""The networks online and on disk (anthro.motor.network)."""

import json
import subprocess
import sys
import time

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from anthro.errors import UserError
from anthro.files import write_shard
from anthro.learn.networks import Network
from anthro.motor.network import NORMALISATION, FeedForward, soften

torch = pytest.importorskip("torch")


def random_network(sizes=(5, 16, 8, 3), seed=0) -> tuple[Network, FeedForward]:
    generator = np.random.default_rng(seed)
    module = Network(sizes, generator)
    with torch.no_grad():
        for layer in module.layers:
            layer.bias.copy_(torch.from_numpy(generator.normal(size=layer.bias.shape)))
    n_in, n_out = sizes[0], sizes[-1]
    normalisation = {
        "input_softening": np.where(np.arange(n_in) < 2, 0.02, 0.0),
        "input_mean": generator.normal(size=n_in),
        "input_scale": generator.uniform(0.1, 3, n_in),
        "output_mean": generator.normal(size=n_out),
        "output_scale": generator.uniform(0.01, 2, n_out),
        "output_softening": np.where(np.arange(n_out) < 1, 0.05, 0.0),
        "output_limit": np.where(np.arange(n_out) < 1, 0.4, 0.0),
    }
    return module, module.export(normalisation, {"name": "test"})


def reference(module: Network, online: FeedForward, x: np.ndarray) -> np.ndarray:
    factors = {name: values.astype(float) for name, values in online.normalisation.items()}
    z = (soften(x, factors["input_softening"]) - factors["input_mean"]) / factors["input_scale"]
    y = module.double()(torch.from_numpy(z)).detach().numpy()
    y = y * factors["output_scale"] + factors["output_mean"]
    y[..., 0] = np.clip(0.05 * np.sinh(np.clip(y[..., 0], -50, 50)), -0.4, 0.4)
    return y


# A training switches subnormal numbers off for the whole process.
ELEMENTS = st.floats(-3, 3, width=32, allow_subnormal=False)


@settings(deadline=None, max_examples=40)
@given(x=hnp.arrays(np.float64, (4, 5), elements=ELEMENTS), seed=st.integers(0, 5))
def test_numpy_and_torch_predict_the_same(x, seed):
    module, online = random_network(seed=seed)
    expected = reference(module, online, x)
    batch = online.predict(x)
    # The softened output's sinh multiplies float32 rounding by up to eight.
    np.testing.assert_allclose(batch, expected, rtol=1e-4, atol=1e-5 * max(1, np.abs(expected).max()))
    for row, y in zip(x, batch, strict=True):
        np.testing.assert_allclose(online.predict(row), y, rtol=1e-4, atol=1e-5 * max(1, np.abs(y).max()))


def test_full_size_predicts_as_torch_does_to_1e_6():
    sizes = (32, *[300] * 6, 29)
    module = Network(sizes, np.random.default_rng(1))
    online = module.export()
    x = np.random.default_rng(2).normal(size=(50, 32)).astype(np.float32)
    expected = module(torch.from_numpy(x)).detach().numpy()
    scale = np.abs(expected).max()
    assert np.abs(online.predict(x) - expected).max() < 1e-6 * scale
    assert np.abs(np.array([online.predict(row) for row in x]) - expected).max() < 1e-6 * scale


def test_predictions_do_not_share_memory_and_inputs_stay():
    _, online = random_network()
    x = np.ones(5, dtype=np.float32)
    first = online.predict(x)
    kept = first.copy()
    online.predict(-x)
    np.testing.assert_array_equal(first, kept)
    np.testing.assert_array_equal(x, 1)


def test_prediction_of_six_by_three_hundred_is_fast():
    online = Network((58, *[300] * 6, 29), np.random.default_rng(0)).export()
    x = np.ones(58, dtype=np.float32)
    seconds = []
    for _ in range(2000):
        started = time.perf_counter()
        online.predict(x)
        seconds.append(time.perf_counter() - started)
    assert min(seconds) < 1e-4


@pytest.mark.parametrize("make", [Network, lambda sizes: Network(sizes).export()])
def test_core_controller_has_the_papers_units_and_weights(make):
    voluntary, reflex = make((446, *[600] * 6, 443)), make((886, *[600] * 6, 443))
    assert voluntary.units + reflex.units == 9418
    assert voluntary.weights + reflex.weights == 4_930_800


def test_limb_nets_have_the_papers_shape():
    for n_in in (32, 58):
        online = Network((n_in, *[300] * 6, 29)).export()
        assert (online.n_in, online.n_out, online.units) == (n_in, 29, n_in + 1800 + 29)
        assert online.weights == n_in * 300 + 5 * 300 * 300 + 300 * 29


def test_saved_and_loaded_is_the_same(tmp_path):
    _, online = random_network()
    online.save(tmp_path / "a.h5")
    loaded = FeedForward.load(tmp_path / "a.h5", inputs=5, outputs=3)
    loaded.save(tmp_path / "b.h5")
    assert (tmp_path / "a.h5").read_bytes() == (tmp_path / "b.h5").read_bytes()
    assert loaded.attrs == {"name": "test"}
    x = np.random.default_rng(0).normal(size=(6, 5))
    np.testing.assert_array_equal(loaded.predict(x), online.predict(x))
    assert set(loaded.normalisation) == set(NORMALISATION)


def spoil_truncate(path):
    path.write_bytes(path.read_bytes()[:-200])


def spoil_layer(path):
    _, online = random_network()
    columns = {f"weight{i}": m for i, m in enumerate(online.matrices)}
    columns |= {f"bias{i}": b[:-1] for i, b in enumerate(online.biases)}
    write_shard(path, columns | online.normalisation)


def spoil_nan(path):
    _, online = random_network()
    online.matrices[1][0, 0] = np.nan
    online.save(path)


def spoil_other(path):
    write_shard(path, {"strain": np.zeros((3, 2))})


@pytest.mark.parametrize("spoil", [lambda path: path.unlink(), spoil_truncate, spoil_layer, spoil_nan, spoil_other])
def test_bad_file_is_named(tmp_path, spoil):
    path = tmp_path / "weights.h5"
    random_network()[1].save(path)
    spoil(path)
    with pytest.raises(UserError, match="weights.h5"):
        FeedForward.load(path)


@pytest.mark.parametrize("needed", [{"inputs": 6}, {"outputs": 4}])
def test_other_widths_are_refused(tmp_path, needed):
    random_network()[1].save(tmp_path / "weights.h5")
    with pytest.raises(UserError, match=r"weights.h5: a network of 5 inputs and 3 outputs"):
        FeedForward.load(tmp_path / "weights.h5", **needed)


def test_wrong_vector_is_refused():
    with pytest.raises(ValueError, match="4 inputs"):
        random_network()[1].predict(np.zeros(4))


def test_online_needs_no_torch():
    code = "import sys, json, anthro.motor.network; print(json.dumps('torch' in sys.modules))"
    told = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert json.loads(told.stdout) is False
