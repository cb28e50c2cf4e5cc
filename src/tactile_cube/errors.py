"""The one error that a user's input can cause."""


class InputError(ValueError):
    """Input that cannot be used: a configuration value, a recording, a model or a policy file.

    The message names the file, key, column or row, the value received and what to do. The command line prints it as
    one line and exits with status 2.
    """
