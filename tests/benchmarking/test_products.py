"""The matrix products of an update."""

import torch

from tactile_cube.agent.batch import Sizes
from tactile_cube.benchmarking.products import multiplying, update_products


def test_an_update_of_the_paper_takes_two_point_six_giga_operations() -> None:
    shapes = update_products(Sizes(120, 25, 12), batch=256, hidden=512)
    operations = 2 * sum(rows * inner * columns for rows, inner, columns in shapes)
    assert 2.5e9 < operations < 2.7e9


def test_products_run_in_either_precision() -> None:
    for dtype in (torch.float32, torch.bfloat16):
        multiplying([(3, 4, 5), (2, 3, 1)], dtype)()
