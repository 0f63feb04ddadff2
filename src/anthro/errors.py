"""The one exception that the command lines turn into a line and exit code 2."""


class UserError(Exception):
    """Bad input, or a machine that cannot go on; its message is one clear line for a person."""
