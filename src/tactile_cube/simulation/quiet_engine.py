"""Import PyBullet without the line it prints on stderr, where a user's mistake shall be the only line."""

import os
import sys


def import_quietly() -> None:
    """Load pybullet with stderr turned away; does nothing where it is loaded already."""
    if "pybullet" in sys.modules:
        return
    sys.stderr.flush()
    stderr, nowhere = os.dup(2), os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(nowhere, 2)
        import pybullet  # noqa: F401
    finally:
        os.dup2(stderr, 2)
        os.close(stderr)
        os.close(nowhere)


import_quietly()
