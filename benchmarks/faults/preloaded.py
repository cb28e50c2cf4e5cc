"""What every training command loads and compiles, for a process that commands are forked from.

It spares each of them the five CPU seconds of its imports; nothing else about them is different.
"""

import torch
import torch.utils.tensorboard
from hydra.utils import instantiate

from tactile_cube.composition import composed
from tactile_cube.training.build import as_environment

torch.set_num_threads(1)
worlds = as_environment(instantiate(composed("train", ["+experiment=smoke"]).env)).make(worlds=1, seed=0)
worlds.rollout(1)
worlds.close()
