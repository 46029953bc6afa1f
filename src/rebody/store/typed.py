"""JSON that a file holds, as the type that it should have: names, kinds and ranges, all at once."""

import math
import re
from typing import Any, TypeVar

import msgspec

Typed = TypeVar("Typed")
PLACE = re.compile(r"(?P<what>.*) - at `\$\.?(?P<key>.*)`", re.DOTALL)
LONGEST = 300
"""Characters of a message: what a file says may be long."""


class Misfit(ValueError):
    """What a file says is not what it should; the message begins with the key."""


def typed(value: Any, kind: type[Typed], key: str = "") -> Typed:
    """What JSON says as a dataclass whose annotations set the ranges; `key` is where it stands in the file.

    A `__post_init__` that raises ValueError says what the annotations cannot.

    Raises:
        Misfit: a key is unknown or missing, or a value of another type, out of range or NaN.
    """
    try:
        found = msgspec.convert(value, kind)
        _check_all_understood(value, msgspec.to_builtins(found), key)
    except msgspec.ValidationError as error:
        place = PLACE.fullmatch(str(error))
        what, inner = place.group("what", "key") if place else (str(error), "")
        raise Misfit(_said(_within(key, inner), what)) from error
    except RecursionError as error:
        raise Misfit(_said(key, "it is nested too deeply")) from error
    except UnicodeEncodeError as error:  # JSON may hold half of a surrogate pair
        raise Misfit(_said(key, "it holds what is no text")) from error
    return found


def _check_all_understood(said: Any, understood: Any, key: str) -> None:
    """Misfit for the first key that a type does not know, or number that is none: a range lets NaN through."""
    if isinstance(said, dict):
        for name, value in said.items():
            inner = _within(key, name)
            if name not in understood:
                raise Misfit(_said(inner, "it is unknown"))
            _check_all_understood(value, understood[name], inner)
    elif isinstance(said, list | tuple):
        for i, (value, item) in enumerate(zip(said, understood, strict=True)):
            _check_all_understood(value, item, f"{key}[{i}]")
    elif isinstance(said, float) and not math.isfinite(said):
        raise Misfit(_said(key, "it is not finite"))


def _within(key: str, inner: str) -> str:
    return f"{key}.{inner}" if key and inner and not inner.startswith("[") else key + inner


def _said(key: str, what: str) -> str:
    """In one line, without what a terminal would obey."""
    text = "".join(sign if sign.isprintable() else "?" for sign in (f"{key}: {what}" if key else what))
    return text if len(text) <= LONGEST else f"{text[:LONGEST]}..."
