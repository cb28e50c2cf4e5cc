"""The matrix products of one update and nothing else: a lower bound for every implementation on this machine."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence

import torch
from torch import Tensor

from tactile_cube.agent.networks import Sizes

Shape = tuple[int, int, int]
"""Rows, inner width and columns of a product."""


def update_products(sizes: Sizes, batch: int, hidden: int) -> list[Shape]:
    """Shapes of all products of an update of SAC with twin critics.

    Args:
        sizes: widths of observation, privileged state and action.
        batch: transitions.
        hidden: width of the two hidden layers.
    """
    actor = (sizes.observation, hidden, hidden, 2 * sizes.action)
    critic = (sizes.critic, hidden, hidden, 1)
    # next and current observations at once; targets on the next ones; critics on replayed and proposed actions
    forward = _forward(actor, 2 * batch) + 2 * _forward(critic, batch) + 2 * _forward(critic, 2 * batch)
    backward = _backward(actor, batch, batch) + 2 * _backward(critic, batch, 2 * batch)
    return forward + backward + 2 * [(batch, hidden, sizes.action)]


def _forward(widths: Sequence[int], rows: int) -> list[Shape]:
    return [(rows, fan_in, fan_out) for fan_in, fan_out in itertools.pairwise(widths)]


def _backward(widths: Sequence[int], trained: int, passed: int) -> list[Shape]:
    """Gradients of the weights from `trained` rows, and of the hidden layers in `passed` rows."""
    weights = [(fan_in, trained, fan_out) for fan_in, fan_out in itertools.pairwise(widths)]
    return weights + [(passed, fan_out, fan_in) for fan_in, fan_out in itertools.pairwise(widths[1:])]


def multiplying(shapes: Sequence[Shape], dtype: torch.dtype) -> Callable[[], None]:
    """A call that computes products of these shapes, each with operands of its own."""
    operands = [
        (
            torch.rand(rows, inner).to(dtype),
            torch.rand(inner, columns).to(dtype),
            torch.empty(rows, columns, dtype=dtype),
        )
        for rows, inner, columns in shapes
    ]
    return lambda: _multiply(operands)


def _multiply(operands: Sequence[tuple[Tensor, Tensor, Tensor]]) -> None:
    for left, right, result in operands:
        torch.mm(left, right, out=result)
