"""The error for input that cannot be used, and warnings about input that is odd but can be."""

import sys


class InputError(ValueError):
    """Input that cannot be used: a configuration value, a recording, a model or a policy file.

    The message names the file, key, column or row, the value received and what to do. The command line prints it as
    one line and exits with status 2.
    """


def warn(line: str) -> None:
    """Print a warning, in yellow on a terminal."""
    yellow, plain = ("\x1b[33m", "\x1b[0m") if sys.stderr.isatty() else ("", "")
    print(f"{yellow}warning: {line}{plain}", file=sys.stderr)
