"""The commands of `rebody`: what each is called and where it is. Only the one that is asked for is imported."""

import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, make_dataclass
from importlib import import_module
from pathlib import Path
from typing import Annotated, Any

import tyro
from tyro.constructors import ConstructorRegistry, PrimitiveConstructorSpec, PrimitiveTypeInfo

from rebody.names import first_lines


@dataclass(frozen=True)
class Command:
    """One command."""

    name: str
    module: str
    """Where it is, below `rebody.cli`."""
    offers: str
    """Its class there, or a function: arguments -> class, where subcommands depend on the arguments."""

    @property
    def line(self) -> str:
        """What it does: its docstring, which is read without importing it."""
        return first_lines(Path(__file__).with_name(f"{self.module}.py"))[self.offers]

    def load(self, arguments: Sequence[str]) -> type:
        """The class, with all that it needs."""
        found = getattr(import_module(f"rebody.cli.{self.module}"), self.offers)
        return found if isinstance(found, type) else found(arguments)

    def stand_in(self) -> type:
        """What a list of commands shows of it."""
        return make_dataclass(self.offers, [], namespace={"__doc__": self.line})


COMMANDS = (
    Command("demo", "demo", "Demo"),
    Command("run", "run", "RunTask"),
    Command("view", "view", "View"),
    Command("evaluate", "evaluate", "Evaluate"),
    Command("diagnose", "diagnose", "Diagnose"),
    Command("infer", "infer", "Infer"),
    Command("train", "train", "train_command"),
    Command("figure", "figure", "Figures"),
    Command("report", "report", "Report"),
    Command("robot", "robot", "Robot"),
    Command("export", "export", "Export"),
    Command("stress", "stress", "Stress"),
    Command("list", "listing", "List"),
)


def union_of(arguments: Sequence[str]) -> Any:
    """The type that tyro reads a command line as: the command that it names, beside stand-ins for the others."""
    names = [command.name for command in COMMANDS]
    named = next((argument for argument in arguments if argument in names), None)
    return subcommands(
        {command.name: command.load(arguments) if command.name == named else command.stand_in() for command in COMMANDS}
    )


def own_types() -> ConstructorRegistry:
    """Settings that are not written as they are: families come from a file."""
    registry = ConstructorRegistry()

    @registry.primitive_rule
    def families(asked: PrimitiveTypeInfo) -> PrimitiveConstructorSpec[Any] | None:
        known = sys.modules.get("rebody.tasks.family_set")  # no command that does without JAX waits for it
        if known is None or asked.type is not known.FamilySet:
            return None
        from rebody.tasks.family_file import own_families

        return PrimitiveConstructorSpec(
            nargs=1,
            metavar="FILE",
            instance_from_str=lambda arguments: own_families(Path(arguments[0])),
            is_instance=lambda value: isinstance(value, known.FamilySet),
            str_from_instance=lambda families: [", ".join(families.names)],
        )

    return registry


def subcommands(kinds: Mapping[str, Any], lines: Mapping[str, str] = {}) -> Any:
    """A type that tyro reads as one of these, by name: classes, or instances that say a class's defaults.

    `lines` say what a name stands for, in place of its class's docstring.
    """
    union: Any = None
    for name, kind in kinds.items():
        of_class, default = (kind, {}) if isinstance(kind, type) else (type(kind), {"default": kind})
        choice = tyro.conf.subcommand(name, description=lines.get(name), prefix_name=False, **default)
        union = Annotated[of_class, choice] if union is None else union | Annotated[of_class, choice]
    return union
