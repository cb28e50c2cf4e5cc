"""The matrix products of an update."""

import pytest
import torch

from benchmarks.speed.products import multiplying, update_products
from tactile_cube.agent.networks import Sizes


def test_an_update_of_the_paper_takes_two_point_six_giga_operations() -> None:
    shapes = update_products(Sizes(120, 25, 12), batch=256, hidden=512)
    operations = 2 * sum(rows * inner * columns for rows, inner, columns in shapes)
    assert 2.5e9 < operations < 2.7e9


@pytest.mark.parametrize("dtype", [torch.float32, torch.bfloat16])
def test_every_product_is_computed_in_the_precision_asked_for(dtype, monkeypatch) -> None:
    seen = []
    monkeypatch.setattr(torch, "mm", lambda left, right, out: seen.append((*left.shape, *right.shape, out.dtype)))
    multiplying([(3, 4, 5), (2, 3, 1)], dtype)()
    assert seen == [(3, 4, 4, 5, dtype), (2, 3, 3, 1, dtype)]
