import pytest
import torch

from tests.training.tiny_run import finish, tiny_run


@pytest.fixture(scope="session")
def reference(tmp_path_factory: pytest.TempPathFactory) -> torch.Tensor:
    """The weights that a tiny run ends with."""
    return finish(tiny_run(tmp_path_factory.mktemp("reference")))
