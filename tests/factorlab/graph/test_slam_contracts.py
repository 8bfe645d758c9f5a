"""A native factor and our vectorised rows say the same: error, and normal equations, in one chart."""

import gtsam
import numpy as np
import pytest
from factor_family import FACTORS

import sequential as sq
from factorlab.graph.slam.lowering import lowered, native_factors
from factorlab.graph.slam.rows import Rows
from factorlab.graph.slam.variables import insert_values, keys_of
from sequential.slam import Factors, SlamProblem, Values

LOSSES = [None, sq.Loss("huber", 1.0), sq.Loss("cauchy", 1.5)]
NATIVE = [member for member in FACTORS if lowered(member.model) is not None]
KINDS = "abc"


def problem_of(member, rng, count=100, loss=None):
    """As many variables of every slot as there are measurements, each joined once."""
    z, values = member.draw(rng, count)
    m = member.model.measured.dim
    root = rng.standard_normal((m, m)) + 2.0 * np.eye(m)
    slots = tuple(KINDS[: len(values)])
    index = np.arange(count)
    group = Factors(member.model, slots, np.tile(index[:, None], len(slots)), z, 0.01 * root @ root.T, loss)
    kinds = dict(zip(slots, member.model.manifolds, strict=True))
    return SlamProblem(kinds, (group,), moving=("a",)), Values(
        dict.fromkeys(slots, index.copy()), dict(zip(slots, map(np.array, values), strict=True))
    )


def test_most_models_have_a_native_factor():
    assert len(NATIVE) > 15


@pytest.mark.parametrize("loss", LOSSES, ids=lambda loss: loss.kind if loss else "squares")
@pytest.mark.parametrize("member", NATIVE, ids=lambda member: member.name)
def test_native_factors_are_our_rows(member, loss, rng):
    problem, values = problem_of(member, rng, loss=loss)
    rows = Rows(problem, dict(values.index))
    matrix, right, cost = rows.linearise(values)
    graph = gtsam.NonlinearFactorGraph()
    for factor in native_factors(problem.factors[0]):
        graph.add(factor)
    start = insert_values(problem, values)
    assert graph.error(start) == pytest.approx(cost, rel=1e-9)
    whole, group = matrix.toarray(), problem.factors[0]
    turned = group.model.errors(group.z, *values.rows.values())[:, -1]
    m = problem.factors[0].model.measured.dim
    for n in range(len(values.index["a"])):
        ours = whole[n * m : (n + 1) * m]
        columns = np.concatenate(
            [np.arange(*rows.column(kind, n).indices(rows.columns)) for kind in values.index]
        )
        a, b = ours[:, columns], right[n * m : (n + 1) * m]
        linear, ordering = gtsam.GaussianFactorGraph(), gtsam.Ordering()
        linear.push_back(graph.at(n).linearize(start))
        for kind in values.index:
            ordering.push_back(keys_of(kind, [n])[0])
        information, vector = linear.hessian(ordering)
        scale, size = np.sqrt(np.trace(a.T @ a)), max(1.0, np.linalg.norm(b))
        exact = 1e-9
        if isinstance(problem.factors[0].model.measured, sq.SE2):
            # close to zero, GTSAM's derivative of Pose2's logarithm loses digits
            exact = 1e-7 if abs(turned[n]) > 0.02 else 1e-2
        np.testing.assert_allclose(information, a.T @ a, rtol=0, atol=exact * scale**2)
        np.testing.assert_allclose(np.ravel(vector), a.T @ b, rtol=0, atol=exact * scale * size)
