"""The minimal-effort solver: optimality, agreement with another solver, torques out of reach."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from anthro import cli
from anthro.errors import UserError
from anthro.figures import command
from anthro.figures.nakada2018 import solver_comparison
from anthro.motor import compare_solvers, qp_solvers
from anthro.motor.effort import MAX_ITERATIONS, SLACK, agonists_by_joint, minimal_effort
from anthro.scorecard import judge

WRIST_TO_SHOULDER = np.array([0.5, 2.0, 5.0, 10.0, 20.0, 40.0, 60.0])  # N m


def arm_like(seed, reach=1.0, m=7, n=29):
    """Random A, a, b = reach * A a: half of the muscles cross a joint, some a at a bound."""
    rng = np.random.default_rng(seed)
    A = rng.normal(size=(m, n)) * (rng.random((m, n)) < 0.5)
    A *= np.resize(WRIST_TO_SHOULDER, m)[:, None] / 3.0
    a = np.clip(1.6 * rng.random(n) - 0.6, 0.0, 1.0)
    return A, a, reach * A @ a


def strength(A):
    norm = np.linalg.norm(A, axis=1)
    return np.where(norm > 0.0, norm, 1.0)


@pytest.mark.parametrize(
    ("torque", "activation", "drive"),
    [
        (3.0, [0.3, 0.0], [0.3, -0.15]),  # the antagonist is silent: y = 0.3 / 10
        (-4.0, [0.0, 0.8], [-1.6, 0.8]),
        (0.0, [0.0, 0.0], [0.0, 0.0]),
    ],
)
def test_two_muscles_by_hand(torque, activation, drive):
    found = minimal_effort([[10.0, -5.0]], [torque], 0.0)
    np.testing.assert_allclose(found.activation, activation, atol=1e-7)
    np.testing.assert_allclose(found.drive, drive, atol=1e-7)
    assert found.residual < 1e-6


def test_two_muscles_with_tone_by_hand():
    """Both contract: a = tone + y (10, -5), 125 y = 3 - (10 - 5) 0.2."""
    found = minimal_effort([[10.0, -5.0]], [3.0], 0.2)
    np.testing.assert_allclose(found.activation, [0.2 + 0.16, 0.2 - 0.08], atol=1e-7)


@settings(max_examples=150, deadline=None)
@given(
    seed=st.integers(0, 2**32 - 1),
    m=st.integers(1, 8),
    n=st.integers(1, 30),
    reach=st.sampled_from([0.1, 1.0, 1.0, 30.0]),
    tone=st.sampled_from([0.0, 0.02, 0.3]),
    flaw=st.sampled_from(["", "zero row", "equal rows", "equal muscles"]),
)
def test_optimality_conditions(seed, m, n, reach, tone, flaw):
    """Bounds, a = clip(tone + A^T y), and S (A a - b) = -slack y / S: necessary and sufficient."""
    A, a, _ = arm_like(seed, m=m, n=n)
    if flaw == "zero row":
        A[0] = 0.0
    elif flaw == "equal rows":
        A[-1] = A[0]
    elif flaw == "equal muscles":
        A[:, -1] = A[:, 0]
    b = reach * A @ a
    found = minimal_effort(A, b, tone)
    y, scale = found.multiplier, strength(A)
    assert found.iterations <= MAX_ITERATIONS
    assert np.isfinite(found.drive).all()
    assert np.array_equal(found.activation, np.clip(found.drive, 0.0, 1.0))
    np.testing.assert_allclose(found.drive, tone + A.T @ y, rtol=1e-9, atol=1e-9 * (1 + np.abs(y * scale).max()))
    shortfall = (A @ found.activation - b) / scale
    np.testing.assert_allclose(shortfall, -SLACK * y * scale, atol=1e-6 * (1 + reach))
    if reach <= 1.0:
        assert np.abs(shortfall).max() < 1e-5
        # no cheaper than the least, no dearer than the one known way to make the torque
        known = np.sum((reach * a - tone) ** 2)
        assert np.sum((found.activation - tone) ** 2) <= known + 1e-4


@pytest.mark.parametrize("seed", range(10))
def test_residual_is_the_largest_torque_error(seed):
    A, _, b = arm_like(seed)
    found = minimal_effort(A, b, 0.02)
    error = np.abs(A @ found.activation - b).max()
    assert error < 1e-5
    assert found.residual == pytest.approx(error, abs=1e-12)


@pytest.mark.parametrize("solver", [qp_solvers.daqp, qp_solvers.proxqp])
@pytest.mark.parametrize("slack", [0.0, 1e-6])
def test_agrees_with_an_independent_solver(solver, slack):
    for seed in range(15):
        A, _, b = arm_like(seed, reach=20.0 if slack else 1.0)
        problem = compare_solvers.Problem(A, b, A, b)
        other = solver(problem, slack)()[: A.shape[1]]
        own = minimal_effort(A, b, qp_solvers.TONE, slack or SLACK).activation
        np.testing.assert_allclose(own, other, atol=1e-6)


@pytest.mark.parametrize("reach", [3.0, 100.0, 1e6])
def test_torques_out_of_reach_are_approached(reach):
    """Nothing within bounds comes nearer to the torque, measured by every joint's strength."""
    from scipy.optimize import lsq_linear

    for seed in range(5):
        A, _, b = arm_like(seed, reach=reach)
        found = minimal_effort(A, b, 0.02)
        scale = strength(A)
        nearest = lsq_linear(A / scale[:, None], b / scale, (0.0, 1.0), method="bvls")
        missed = np.linalg.norm((A @ found.activation - b) / scale)
        assert found.iterations <= MAX_ITERATIONS
        assert np.isfinite(found.drive).all()
        assert missed == pytest.approx(np.sqrt(2.0 * nearest.cost), rel=1e-6)
        assert np.abs(found.multiplier * scale).max() <= missed / SLACK * (1 + 1e-6)


def test_larger_slack_bounds_the_drive():
    A, _, b = arm_like(3, reach=20.0)
    assert np.abs(minimal_effort(A, b, 0.02).drive).max() > 1e6
    assert np.abs(minimal_effort(A, b, 0.02, slack=1e-2).drive).max() < 1e4


@pytest.mark.parametrize("reach", [1.0, 5.0])
def test_slack_of_each_row_softens_that_row_alone(reach):
    """The optimality conditions S (A a - b) = -slack y / S hold row by row; a soft row gives way to the others."""
    A, _, b = arm_like(3, reach)
    slack = np.array([1e-3, 1e-3, 0.3, 1e-3, 1e-3, 0.3, 1e-3])
    found, scale = minimal_effort(A, b, 0.02, slack=slack), strength(A)
    shortfall = (A @ found.activation - b) / scale
    np.testing.assert_allclose(shortfall, -slack * found.multiplier * scale, atol=1e-9)
    even = minimal_effort(A, b, 0.02, slack=np.full(7, 1e-3))
    np.testing.assert_array_equal(even.drive, minimal_effort(A, b, 0.02, slack=1e-3).drive)
    softened = np.abs(shortfall) > np.abs((A @ even.activation - b) / scale)
    assert softened[[2, 5]].all()


@pytest.mark.parametrize("reach", [1.0, 20.0])
def test_start_changes_the_work_and_not_the_answer(reach):
    A, _, b = arm_like(11, reach)
    cold = minimal_effort(A, b, 0.02)
    warm = minimal_effort(A, b, 0.02, start=cold.multiplier)
    assert warm.iterations <= 1 < cold.iterations
    for start in (cold.multiplier, np.full(7, 1e5), -np.ones(7)):
        again = minimal_effort(A, b, 0.02, start=start)
        # out of reach y is about 1e10, and rounding leaves an activation some 1e-6 uncertain
        np.testing.assert_allclose(again.activation, cold.activation, atol=1e-5)


def test_drive_tells_silent_from_saturated():
    """Silent muscles' drive is below 0 by what they would cost, saturated ones' above 1."""
    A = np.array([[10.0, 2.0, -5.0]])
    found = minimal_effort(A, [11.0], 0.0)  # the first at 1, the second makes the rest
    np.testing.assert_allclose(found.activation, [1.0, 0.5, 0.0], atol=1e-7)
    np.testing.assert_allclose(found.drive, [2.5, 0.5, -1.25], atol=1e-6)
    for seed in range(10):
        A, _, b = arm_like(seed)
        found = minimal_effort(A, b, 0.02)
        pull = A.T @ found.multiplier
        assert np.all(found.activation[pull < -0.02] == 0.0)
        assert np.all(found.activation[pull > 0.98] == 1.0)


def test_same_input_same_bytes():
    A, _, b = arm_like(5)
    first, second = (
        minimal_effort(A, b, 0.02),
        minimal_effort(A.copy(), b.copy(), np.full(29, 0.02)),
    )
    assert first.drive.tobytes() == second.drive.tobytes()


@pytest.mark.parametrize(("m", "n"), [(21, 216), (112, 443)])
def test_neck_and_whole_body_sizes(m, n):
    A, _, b = arm_like(1, m=m, n=n)
    found = minimal_effort(A, b, 0.02)
    assert found.residual < 1e-4
    assert found.iterations < 20


@pytest.mark.parametrize("value", [np.nan, np.inf])
@pytest.mark.parametrize("name", ["A", "b", "tone", "start"])
def test_not_finite_is_refused(name, value):
    A, _, b = arm_like(0)
    inputs = {"A": A, "b": b, "tone": np.full(29, 0.02), "start": np.zeros(7)}
    inputs[name].flat[3] = value
    with pytest.raises(UserError, match="not all finite"):
        minimal_effort(**inputs)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"b": np.zeros(6)}, "b has shape"),
        ({"tone": np.zeros(28)}, "tone has shape"),
        ({"start": np.zeros(8)}, "start has shape"),
        ({"A": np.zeros(29)}, "A has shape"),
        ({"slack": 0.0}, "slack"),
        ({"slack": np.nan}, "slack"),
        ({"slack": np.full(6, 1e-3)}, "slack has shape"),
        ({"slack": np.r_[np.full(6, 1e-3), 0.0]}, "slack"),
    ],
)
def test_wrong_arguments_are_refused(change, message):
    A, _, b = arm_like(0)
    with pytest.raises(UserError, match=message):
        minimal_effort(**({"A": A, "b": b, "tone": 0.02} | change))


def test_joint_by_joint_misses_the_torque_only_with_biarticular_muscles():
    tone = np.full(4, 0.1)
    single = np.array([[9.0, -6.0, 0.0, 0.0], [0.0, 0.0, 4.0, -3.0]])
    b = np.array([3.0, -1.0])
    np.testing.assert_allclose(single @ agonists_by_joint(single, b, tone), b, atol=1e-6)
    shared = single.copy()
    shared[1, 0] = -4.0
    assert np.abs(shared @ agonists_by_joint(shared, b, tone) - b).max() > 0.1


def test_comparison_of_solvers_on_small_problems():
    drawn = compare_solvers.random_problems(3, 12, 4, np.random.default_rng(0))
    assert all(compare_solvers.reachable(problem) for problem in drawn)
    table = compare_solvers.compare("arm, in reach", drawn, 0.0)
    assert [row["solver"] for row in table] == list(qp_solvers.SOLVERS)
    for row in table:
        assert tuple(row) == tuple(compare_solvers.COLUMNS)
        assert row["failed"] == 0, row
        assert row["max_distance"] < 1e-4, row
    rows = compare_solvers.scorecard_rows(table, compare_solvers.joint_by_joint(drawn))
    for row in rows:
        judge(row)


def write_comparison(run):
    drawn = compare_solvers.random_problems(2, 6, 2, np.random.default_rng(0))
    table = []
    for group in solver_comparison.PANELS:
        table += compare_solvers.compare(group, drawn, 0.0)
    compare_solvers.write_table(run / "demos" / "solvers" / "solver_comparison.csv", table)


def test_figure_of_the_comparison(tmp_path, capsys):
    arguments = ["--run", str(tmp_path), "--out", str(tmp_path / "solvers.png")]

    def draw(argv):
        return command(solver_comparison.draw, argv)

    assert cli.run(draw, arguments) == 2
    assert "solver_comparison.csv: no such file" in capsys.readouterr().err
    write_comparison(tmp_path)
    assert cli.run(draw, arguments) == 0
    assert (tmp_path / "solvers.png").stat().st_size > 10_000


def test_comparison_of_a_missing_body_ends_in_one_line(tmp_path, capsys):
    arguments = ["--body", str(tmp_path / "none"), "--out", str(tmp_path / "out")]
    assert cli.run(compare_solvers.main, arguments) == 2
    assert capsys.readouterr().err.count("\n") == 1
    assert not (tmp_path / "out").exists()
