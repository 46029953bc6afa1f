"""The one exception that users are meant to see."""

import difflib
import re
from collections.abc import Iterable


class RebodyError(Exception):
    """Something the user can mend: the message says what was wrong and what to do.

    The command line prints the message alone and exits with code 2.
    """


def unknown(kind: str, name: object, known: Iterable[str], more: str = "") -> RebodyError:
    """What to raise for a name that there is not: the nearest, then all that are known, then `more`."""
    known = list(known)
    guess = did_you_mean(str(name), known)
    listed = ", ".join([*known, more] if more else known)
    plural = re.sub("(?<![aeiou])y$", "ie", kind) + "s"
    return RebodyError(f"unknown {kind} '{name}'.{guess} {plural.capitalize()} are: {listed}.")


def did_you_mean(name: str, known: Iterable[str]) -> str:
    """A question about a known name that is near, else nothing; goes behind a message's first sentence."""
    near = difflib.get_close_matches(name, list(known), n=1)
    return f" Did you mean '{near[0]}'?" if near else ""
