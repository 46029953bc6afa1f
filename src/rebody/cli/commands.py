"""The commands of `rebody`: what each is called and where it is. Only the one that is asked for is imported."""

from collections.abc import Sequence
from dataclasses import dataclass, make_dataclass
from importlib import import_module
from typing import Annotated, Any

import tyro


@dataclass(frozen=True)
class Command:
    """One command."""

    name: str
    module: str
    """Where it is, below `rebody.cli`."""
    offers: str
    """Its class there, or a function: arguments -> class, where defaults depend on the arguments."""
    line: str
    """What it does: the docstring of its class, which says it once more for its own help."""

    def load(self, arguments: Sequence[str]) -> type:
        """The class, with all that it needs."""
        found = getattr(import_module(f"rebody.cli.{self.module}"), self.offers)
        return found if isinstance(found, type) else found(arguments)

    def stand_in(self) -> type:
        """What a list of commands shows of it."""
        return make_dataclass(self.offers, [], namespace={"__doc__": self.line})


COMMANDS = (
    Command(
        "demo", "demo", "Demo",
        "Transfer to every robot that has a tracker, zero-shot: tables, figures and videos on the shipped artifacts.",
    ),
    Command("run", "run", "RunTask", "Run one episode on a hidden task; say how it went, draw it, film it."),
    Command(
        "view", "view", "View",
        "Watch a robot find out its hidden task in a browser, change the task, push the robot.",
    ),
    Command(
        "evaluate", "evaluate", "Evaluate",
        "Judge an agent on a file of hidden tasks: table, and JSON with every decision.",
    ),
    Command(
        "diagnose", "diagnose", "Diagnose",
        "Which part lost what: the same tasks by agents that differ by one part each, up to `reuse`.",
    ),
    Command(
        "infer", "infer", "Infer",
        "What a frozen module believes over a logged run: the first test for a robot of one's own.",
    ),
    Command("train", "train", "train_command", "Train a part; every shipped artifact is made by these commands."),
    Command("figure", "figure", "Figures", "Draw figures of the thesis' chapter 6 by number."),
    Command(
        "report", "report", "Report",
        "One HTML page, which needs no network, of runs, artifacts, results, figures and videos.",
    ),
    Command(
        "robot", "robot", "Robot",
        "Robots of one's own, a short TOML beside an MJCF: load one, run it, and say what is missing.",
    ),
    Command(
        "stress", "stress", "Stress", "Random subgoals and pushes: how often does a robot's tracker let it fall?"
    ),
    Command(
        "list", "listing", "List", "Bodies, task families, agents, presets, shipped artifacts and figures."
    ),
)  # fmt: skip


def union_of(arguments: Sequence[str]) -> Any:
    """The type that tyro reads a command line as: the command that it names, beside stand-ins for the others."""
    names = [command.name for command in COMMANDS]
    named = next((argument for argument in arguments if argument in names), None)
    union: Any = None
    for command in COMMANDS:
        kind = command.load(arguments) if command.name == named else command.stand_in()
        subcommand: Any = Annotated[kind, tyro.conf.subcommand(command.name)]
        union = subcommand if union is None else union | subcommand
    return union
