"""Where a robot's model is: a file of one's own, or one that a package brings."""

import importlib
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import ClassVar

from rebody.errors import RebodyError

MENAGERIE = "mujoco_menagerie"


@dataclass(frozen=True)
class InPackage:
    """A file of an installed package, written `package:NAME/PATH`."""

    package: str
    file: str

    def path(self, robot: str) -> Path:
        """RebodyError where the package is not installed."""
        return _folder(self.package, robot, "'rebody[robots]' (for the robots that ship)") / self.file


@dataclass(frozen=True)
class InMenagerie:
    """A model of MuJoCo Menagerie, written `menagerie:NAME` or `menagerie:NAME/ENTRY`: a scene of it, or the robot
    alone. The package `mujoco-menagerie` fetches it once.
    """

    name: str
    entry: str | None
    package: ClassVar[str] = MENAGERIE

    def path(self, robot: str) -> Path:
        """RebodyError where the package is not installed, has no such model, or cannot fetch it."""
        _folder(self.package, robot, "mujoco-menagerie")
        menagerie = importlib.import_module(MENAGERIE)
        try:
            return menagerie.get(self.name).xml(self.entry)
        except menagerie.MenagerieError as error:
            raise RebodyError(f"robot '{robot}': MuJoCo Menagerie has no '{self.name}' for it: {error}") from error


Source = Path | InPackage | InMenagerie


def source(said: str, beside: Path) -> Source:
    """What a description says of its model; files are relative to its folder."""
    kind, _, where = said.partition(":")
    name, _, rest = where.partition("/")
    if kind == "gymnasium":
        return InPackage("gymnasium", f"envs/mujoco/assets/{where}")
    if kind == "package":
        return InPackage(name, rest)
    if kind == "menagerie":
        return InMenagerie(name, rest or None)
    return beside / said


def model_file(where: Source, robot: str) -> Path:
    """The file; RebodyError where a package that has it is not installed."""
    return where if isinstance(where, Path) else where.path(robot)


def is_there(where: Source) -> bool:
    """Whether the package is installed that a model comes with, if any."""
    return isinstance(where, Path) or _installed(where.package) is not None


def _installed(package: str) -> Path | None:
    """Its folder."""
    found = find_spec(package) if package.isidentifier() else None
    return None if found is None or not found.submodule_search_locations else Path(found.submodule_search_locations[0])


def _folder(package: str, robot: str, brings: str) -> Path:
    folder = _installed(package)
    if folder is None:
        needs = f"its model comes with the package '{package}', which is not installed"
        raise RebodyError(f"robot '{robot}': {needs}: pip install {brings}.")
    return folder
