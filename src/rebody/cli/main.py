"""`rebody`: reads the command, runs it, and turns errors into one clear message."""

import os
import sys
from contextlib import AbstractContextManager, nullcontext
from io import TextIOWrapper
from pathlib import Path
from typing import Any

import tyro
from rich.console import Console

from rebody.cli.commands import own_types, union_of
from rebody.cli.machine import fault_of_machine
from rebody.errors import RebodyError
from rebody.ranges import check_ranges

DESCRIPTION = "Learn to infer a task once, on a point mass; reuse that module, frozen, on any robot."


def main() -> None:
    """Entry point; exit code 2 for errors that the user can mend, 130 after Ctrl-C, 1 where nobody reads the output."""
    _open_streams()
    try:
        code = run(sys.argv[1:])
    except SystemExit as leaving:  # tyro, after help or usage
        code = leaving.code
    sys.exit(_flush() or code)


def run(arguments: list[str]) -> int:
    """Run one command line; returns its exit code."""
    _prepare_environment()
    try:
        command = parse(arguments)
        check_ranges(command)
        with _own_settings():
            command.run()
    except RebodyError as error:
        return _complain(error)
    except BrokenPipeError:
        return 1
    except OSError as error:  # no permission, a full disk
        return _complain(f"{error.filename}: {error.strerror}" if error.filename else error.strerror or error)
    except _interrupted() as interruption:
        Console(stderr=True, soft_wrap=True).print(_plain(interruption), highlight=False)
        return 130
    except KeyboardInterrupt:
        return 130
    except Exception:
        fault = fault_of_machine()
        if fault is None:
            raise
        return _complain(fault)
    return 0


def parse(arguments: list[str]) -> Any:
    """The command with its options; prints help or usage and exits where tyro does."""
    command = union_of(arguments)
    return tyro.cli(command, prog="rebody", args=arguments, description=DESCRIPTION, registry=own_types())


def _own_settings() -> AbstractContextManager[None]:
    """Of JAX, which not every command imports."""
    if "jax" not in sys.modules:
        return nullcontext()
    from rebody.jax_settings import own_jax_settings

    return own_jax_settings()


def _complain(message: object) -> int:
    Console(stderr=True, soft_wrap=True).print(f"[bold red]error:[/] {_plain(message)}", highlight=False)
    return 2


def _plain(message: object) -> str:
    return str(message).replace("[", r"\[")


def _interrupted() -> type[Exception] | tuple[()]:
    """What Ctrl-C raises where a run was checkpointed; no other command imports what trains."""
    training = sys.modules.get("rebody.training.run")
    return training.Interrupted if training else ()


def _open_streams() -> None:
    """Whatever the caller gives as output can be written to: one that is closed, or that does not know all letters."""
    for name in ("stdout", "stderr"):
        stream = getattr(sys, name)
        if stream is None:
            setattr(sys, name, open(os.devnull, "w"))  # noqa: SIM115 (to the end)
        elif isinstance(stream, TextIOWrapper):
            stream.reconfigure(errors="replace")


def _flush() -> int:
    """Write what is left of the output; 0, or the exit code where that fails.

    The interpreter would try again at its end, and show a traceback.
    """
    try:
        sys.stdout.flush()
    except OSError as error:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1 if isinstance(error, BrokenPipeError) else _complain(error.strerror)
    return 0


def _prepare_environment() -> None:
    """Before JAX is imported: compile once per machine."""
    try:
        cache = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "rebody" / "jax"
    except RuntimeError:  # a user without a home
        return
    os.environ.setdefault("JAX_COMPILATION_CACHE_DIR", str(cache))
    os.environ.setdefault("JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS", "0.2")
