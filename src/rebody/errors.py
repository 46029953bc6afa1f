"""The one exception that users are meant to see."""


class RebodyError(Exception):
    """Something the user can mend: the message says what was wrong and what to do.

    The command line prints the message alone and exits with code 2.
    """
