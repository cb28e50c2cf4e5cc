"""An environment that draws its noise from a generator of its own."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import torch
from tensordict import TensorDictBase
from torch import Tensor
from torchrl.envs import TransformedEnv


class OwnGeneratorEnv(TransformedEnv):  # type: ignore[misc]
    """A transformed environment on whose random numbers torch's global generator has no influence, nor they on it.

    Its sequence begins with `set_seed`.
    """

    _generator: Tensor | None = None

    def set_seed(self, seed: int | None = None, static_seed: bool = False) -> int | None:
        """Seed worlds and noise; gives the next seed."""
        with self._drawing():
            following: int | None = super().set_seed(seed, static_seed=static_seed)
        return following

    def _reset(self, tensordict: TensorDictBase | None = None, **kwargs: object) -> TensorDictBase:
        with self._drawing():
            return super()._reset(tensordict, **kwargs)

    def _step(self, tensordict: TensorDictBase) -> TensorDictBase:
        with self._drawing():
            return super()._step(tensordict)

    @contextmanager
    def _drawing(self) -> Iterator[None]:
        others = torch.get_rng_state()
        torch.set_rng_state(others if self._generator is None else self._generator)
        try:
            yield
        finally:
            self._generator = torch.get_rng_state()
            torch.set_rng_state(others)
