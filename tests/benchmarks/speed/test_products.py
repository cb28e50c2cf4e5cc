"""The matrix products of an update."""

from benchmarks.speed.products import update_products
from tactile_cube.agent.networks import Sizes


def test_an_update_of_the_paper_takes_two_point_six_giga_operations() -> None:
    shapes = update_products(Sizes(120, 25, 12), batch=256, hidden=512)
    operations = 2 * sum(rows * inner * columns for rows, inner, columns in shapes)
    assert 2.5e9 < operations < 2.7e9
