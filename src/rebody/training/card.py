"""What a finished training run leaves behind: the artifact and its card."""

import os
import platform
import shlex
import sys
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

import jax
import mujoco

from rebody import __version__
from rebody.store import save_artifact
from rebody.training.run import Run


def save(kind: str, settings: Any, weights: Any, run: Run, title: str, what: str, figures: Mapping[str, str]) -> Path:
    """Write the artifact of a kind, with its card, into the run's folder; returns the folder."""
    text = card(title, what, run, figures)
    return save_artifact(run.out, kind=kind, config=asdict(settings), weights=weights, card=text, log=run.log)


def card(title: str, what: str, run: Run, figures: Mapping[str, str]) -> str:
    """Markdown: what it is, the exact command and seed that made it, wall time, machine, figures."""
    machine = f"{os.cpu_count()} x {_processor()}, {platform.system()}, Python {platform.python_version()}"
    rows = "\n".join(f"| {name} | {value} |" for name, value in figures.items())
    remarks = "".join(f"- {remark}\n" for remark in run.remarks)
    return (
        f"# {title}\n\n{what}\n\n"
        f"- Made by: `{command_line()}`\n- Seed: {run.settings['seed']}\n"
        f"- Training time: {run.wall_s / 60:.1f} minutes\n{remarks}"
        f"- Machine: {machine}\n- Versions: {versions()}\n\n"
        f"Measured by the same command after training:\n\n| figure | value |\n|---|---|\n{rows}\n"
    )


def command_line() -> str:
    """The command that is running, fit for a shell."""
    arguments = sys.argv[1:]
    if "--finish" not in arguments:  # a resumed run ends as the uninterrupted one would have
        arguments = [argument for argument in arguments if argument != "--resume"]
    return shlex.join([Path(sys.argv[0]).name, *arguments])


def versions() -> str:
    """Of what results depend on most."""
    return f"rebody {__version__}, JAX {jax.__version__}, MuJoCo {mujoco.__version__}"


def _processor() -> str:
    """The processor's name as the system tells it."""
    cpuinfo = Path("/proc/cpuinfo")
    if cpuinfo.exists():
        for line in cpuinfo.read_text().splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    return platform.processor() or platform.machine()
