"""The linear start of networks: numpy's least squares, the best of each rank, and all layers learn from it."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from anthro.learn import linear
from anthro.learn.linear import least_squares, start_linear
from anthro.learn.networks import Network

torch = pytest.importorskip("torch")


class Table:
    """Rows in memory: 2000 pairs to train on and 500 held out, of correlated inputs."""

    def __init__(self, seed, n_in=8, n_out=5, noise=0.0, training=2000):
        rng = np.random.default_rng(seed)
        mixing = np.eye(n_in) + 0.4 * rng.normal(size=(n_in, n_in))
        self.x = (rng.normal(size=(training + 500, n_in)) @ mixing + 0.1).astype(np.float32)
        self.map, self.offset = rng.normal(size=(n_in, n_out)) / n_in, rng.normal(size=n_out)
        clean = self.x.astype(float) @ self.map + self.offset
        self.y = (clean + noise * rng.normal(size=clean.shape)).astype(np.float32)
        self.training, self.validation, self.n_in, self.n_out = training, 500, n_in, n_out

    def batches(self, order, size):
        for part in np.split(order, range(size, len(order), size)):
            yield torch.from_numpy(self.x[part]), torch.from_numpy(self.y[part])

    def held_out(self):
        yield torch.from_numpy(self.x[self.training :]), torch.from_numpy(self.y[self.training :])

    def sides(self):
        """Inputs with a column of ones, and outputs, of the training side."""
        x = self.x[: self.training].astype(float)
        return np.column_stack([x, np.ones(len(x))]), self.y[: self.training].astype(float)


def predict(network, x):
    with torch.no_grad():
        return network(torch.from_numpy(x)).numpy()


@pytest.fixture(autouse=True)
def unridged(monkeypatch):
    monkeypatch.setattr(linear, "RIDGES", (1e-12,))


@settings(max_examples=10, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), depth=st.integers(1, 5))
def test_the_network_begins_as_numpys_least_squares(seed, depth):
    table = Table(seed, noise=0.3)
    network = Network((8, *[20] * depth, 5), np.random.default_rng(0))
    start_linear(network, table)
    x, y = table.sides()
    wanted = x @ np.linalg.lstsq(x, y, rcond=None)[0]
    # rows beyond the lift, some 5 of a million standard deviations, bend
    inside = np.abs(wanted - predict(network, table.x[: table.training])).max(axis=1) < 1e-3
    assert inside.mean() > 0.999
    np.testing.assert_allclose(predict(network, table.x[: table.training])[inside], wanted[inside], atol=2e-4)


@pytest.mark.parametrize("rank", [1, 2, 4])
def test_a_lower_rank_is_the_best_of_its_rank(rank):
    """Against the truncated SVD of least squares' predictions (Eckart and Young)."""
    table = Table(1, n_out=6, noise=0.5)
    into, out, offset = least_squares(table, rank)
    assert into.shape == (rank, 8) and out.shape == (6, rank) and offset.shape == (6,)
    x, y = table.sides()
    fitted = x @ np.linalg.lstsq(x, y, rcond=None)[0]
    mean = fitted.mean(axis=0)
    u, s, v = np.linalg.svd(fitted - mean, full_matrices=False)
    best = (u[:, :rank] * s[:rank]) @ v[:rank] + mean
    found = x[:, :-1] @ into.T @ out.T + offset
    np.testing.assert_allclose(found, best, atol=1e-5)
    inner = x[:, :-1] @ into.T
    np.testing.assert_allclose(np.cov(inner.T).reshape(rank, rank), np.eye(rank), atol=2e-3)


def test_narrow_layers_hand_on_as_many_directions_as_they_may():
    table = Table(2, n_in=30, n_out=25, noise=0.1)
    network = Network((30, 40, 20, 40, 25), np.random.default_rng(0))
    start_linear(network, table)
    found = predict(network, table.x)
    assert np.linalg.matrix_rank(found - found.mean(axis=0), tol=1e-2) == 20


def test_the_ridge_is_the_held_out_sides_choice(monkeypatch):
    """Few pairs of much noise ask for a ridge, many of none for hardly any."""
    monkeypatch.setattr(linear, "RIDGES", (1e-6, 1.0))
    for training, noise, ridge in ((12, 3.0, 1.0), (2000, 0.0, 1e-6)):
        table = Table(3, n_out=1, noise=noise, training=training)
        into, out, offset = least_squares(table, 1)
        x, y = table.sides()
        x = x[:, :-1] - x[:, :-1].mean(axis=0)
        weights = np.linalg.solve(x.T @ x / training + ridge * np.eye(8), x.T @ (y - y.mean(axis=0)) / training)
        np.testing.assert_allclose((into.T @ out.T)[:, 0], weights[:, 0], rtol=1e-3, atol=1e-5)


def test_gradients_reach_all_layers_after_some_steps():
    table = Table(4, noise=0.0)
    table.y = np.tanh(2.0 * table.y).astype(np.float32)
    network = Network((8, 24, 24, 24, 5), np.random.default_rng(0))
    start_linear(network, table)
    before = [layer.weight.detach().clone() for layer in network.layers]
    x, y = (torch.from_numpy(side[: table.training]) for side in (table.x, table.y))
    adam, losses = torch.optim.Adam(network.parameters(), lr=1e-3), []
    for _ in range(60):
        adam.zero_grad()
        loss = torch.nn.functional.mse_loss(network(x), y)
        loss.backward()
        adam.step()
        losses.append(loss.item())
    assert losses[-1] < 0.7 * losses[0]
    for layer, old in zip(network.layers, before, strict=True):
        moved = (layer.weight - old).abs()
        assert (moved.amax(dim=1) > 1e-6).float().mean() > 0.5  # units that hand on and those that do not
        assert layer.weight.grad.abs().max() > 0.0
