"""A user's own families: data in a TOML file, or a Python file where a reward law is one's own as well.

    [[families]]
    name = "lean"
    quantity = { name = "x_pitch", components = ["x", "pitch"], unit = "m, rad", label = "place and pitch" }
    targets = [{ low = [1.0, 0.2], high = [4.0, 0.6] }]
    floor = 0.5
    tolerance = 0.3

A Python file has `LAWS`, a list of `RewardLaw`, and `families()`, a function that returns a list of `Family`, since a
family may name a law only once it is known. Artifacts hold what is data; of a law they hold the hash of its file, which
must be named again when they are loaded.
"""

import hashlib
import runpy
import tomllib
from dataclasses import replace
from pathlib import Path

from rebody.errors import RebodyError
from rebody.store.files import TEXT, read_file, reason
from rebody.store.typed import Misfit, typed
from rebody.tasks.catalogue import SHIPPED
from rebody.tasks.family_set import FamilySet
from rebody.tasks.laws import LAWS, add_law

WANTED = "See docs/own-families.md."


def read_families(path: Path | None) -> FamilySet:
    """The families of a file and those that ship, their laws known from now on; RebodyError that says what is wrong.

    None for those that ship alone. A Python file is run: read it before you trust it.
    """
    return SHIPPED if path is None else own_families(path).beside(SHIPPED)


def own_families(path: Path) -> FamilySet:
    """Those of a file alone, as `read_families`."""
    try:
        content = read_file(path, TEXT)
    except OSError as error:
        raise RebodyError(f"cannot read the families' file '{path}': {reason(error)}.") from error
    read = _of_python if path.suffix == ".py" else _of_toml
    families = read(path, content)
    if taken := sorted(set(families.names) & set(SHIPPED.names)):
        raise RebodyError(f"'{path}': the name '{taken[0]}' is taken by a family that ships; choose another one.")
    return families


def _of_toml(path: Path, content: bytes) -> FamilySet:
    try:
        return typed(tomllib.loads(content.decode("utf-8-sig")), FamilySet)
    except (tomllib.TOMLDecodeError, UnicodeDecodeError, RecursionError) as error:
        raise RebodyError(f"'{path}' is not a TOML file: {error}. {WANTED}") from error
    except Misfit as misfit:
        raise RebodyError(f"'{path}' does not describe families ({misfit}). {WANTED}") from misfit


def _of_python(path: Path, content: bytes) -> FamilySet:
    source = hashlib.sha256(content).hexdigest()
    try:
        said = runpy.run_path(str(path))
        for law in said.get("LAWS", ()):
            add_law(replace(law, source=source))
        return FamilySet(tuple(replace(each, law_source=LAWS[each.law].source) for each in said["families"]()))
    except RebodyError as error:
        raise RebodyError(f"'{path}': {error}") from error
    except (Exception, SystemExit) as error:  # it is anybody's code
        raise RebodyError(f"'{path}' does not give families: {type(error).__name__}: {error}. {WANTED}") from error
