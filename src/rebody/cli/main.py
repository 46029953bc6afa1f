"""`rebody`: reads the command, runs it, and turns errors into one clear message."""

import os
import sys
from pathlib import Path
from typing import Annotated, Any

import tyro
from rich.console import Console

from rebody.errors import RebodyError

DESCRIPTION = "Learn to infer a task once, on a point mass; reuse that module, frozen, on any robot."


def main() -> None:
    """Entry point; exit code 2 for errors that the user can mend, 130 after Ctrl-C."""
    sys.exit(run(sys.argv[1:]))


def run(arguments: list[str]) -> int:
    """Run one command line; returns its exit code."""
    _prepare_environment()
    from rebody.training.run import Interrupted

    try:
        command = parse(arguments)
        command.run()
    except RebodyError as error:
        return _complain(error)
    except OSError as error:  # no permission, a full disk
        return _complain(f"{error.filename}: {error.strerror}" if error.filename else error)
    except Interrupted as interruption:
        Console(stderr=True, soft_wrap=True).print(_plain(interruption), highlight=False)
        return 130
    except KeyboardInterrupt:
        return 130
    return 0


def parse(arguments: list[str]) -> Any:
    """The command with its options; prints help or usage and exits where tyro does."""
    from rebody.cli.demo import Demo
    from rebody.cli.diagnose import Diagnose
    from rebody.cli.evaluate import Evaluate
    from rebody.cli.figure import Figures
    from rebody.cli.infer import Infer
    from rebody.cli.listing import List
    from rebody.cli.report import Report
    from rebody.cli.robot import Robot
    from rebody.cli.run import RunTask
    from rebody.cli.stress import Stress
    from rebody.cli.train import train_command

    train: Any = Annotated[train_command(arguments), tyro.conf.subcommand("train")]
    commands: Any = (
        Annotated[Demo, tyro.conf.subcommand("demo")]
        | Annotated[RunTask, tyro.conf.subcommand("run")]
        | Annotated[Evaluate, tyro.conf.subcommand("evaluate")]
        | Annotated[Diagnose, tyro.conf.subcommand("diagnose")]
        | Annotated[Infer, tyro.conf.subcommand("infer")]
        | train
        | Annotated[Figures, tyro.conf.subcommand("figure")]
        | Annotated[Report, tyro.conf.subcommand("report")]
        | Annotated[Robot, tyro.conf.subcommand("robot")]
        | Annotated[Stress, tyro.conf.subcommand("stress")]
        | Annotated[List, tyro.conf.subcommand("list")]
    )
    return tyro.cli(commands, prog="rebody", args=arguments, description=DESCRIPTION)


def _complain(message: object) -> int:
    Console(stderr=True, soft_wrap=True).print(f"[bold red]error:[/] {_plain(message)}", highlight=False)
    return 2


def _plain(message: object) -> str:
    return str(message).replace("[", r"\[")


def _prepare_environment() -> None:
    """Before JAX is imported: compile once per machine."""
    cache = Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache")) / "rebody" / "jax"
    os.environ.setdefault("JAX_COMPILATION_CACHE_DIR", str(cache))
    os.environ.setdefault("JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS", "0.2")
