"""Stands where each plant's kernel has a module that `kernel_source` generates: C chains of N dofs and n joints each.

That module holds the plant's topology, the offsets of `memory_layout` in capitals, and a function `effects_..` for each
stage. All are constants to the compiler, which unrolls the loops over joints. The steps import it and each other
relatively: as members of the package that they are loaded into.
"""

from typing import Any

C = N = n = 0


def __getattr__(name: str) -> Any:
    raise AttributeError(f"'{name}' is known of a plant only: use Plant(..).kernel, which loads the steps for it")
