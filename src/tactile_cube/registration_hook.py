"""The environment's registration with Gymnasium, without importing Gymnasium."""

import importlib.util
import sys
from collections.abc import Sequence
from importlib.abc import MetaPathFinder
from importlib.machinery import ModuleSpec
from types import ModuleType


def register_with_gymnasium() -> None:
    """Registers now where Gymnasium is imported, else once somebody imports it: importing it here would take 0.2 s."""
    if "gymnasium" in sys.modules:
        importlib.import_module("tactile_cube.registration")
    else:
        sys.meta_path.insert(0, _WhenGymnasiumComes())


class _WhenGymnasiumComes(MetaPathFinder):
    _asking = False

    def find_spec(self, name: str, path: Sequence[str] | None, target: ModuleType | None = None) -> ModuleSpec | None:
        """Gymnasium's own spec, with the registration after its execution."""
        if name != "gymnasium" or self._asking:
            return None
        self._asking = (
            True  # the other finders are asked; this one stays, as many look for a module and import it later
        )
        spec = importlib.util.find_spec(name)
        self._asking = False
        if spec is not None and spec.loader is not None:
            execute = spec.loader.exec_module

            def execute_and_register(module: ModuleType) -> None:
                execute(module)
                if self in sys.meta_path:
                    sys.meta_path.remove(self)
                importlib.import_module("tactile_cube.registration")

            spec.loader.exec_module = execute_and_register  # type: ignore[method-assign]
        return spec
