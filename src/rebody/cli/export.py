"""`rebody export`."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro
from rich.console import Console

from rebody.bodies.walking.export import export_onnx
from rebody.bodies.walking.joystick import WAYS
from rebody.bodies.walking.trained import TrainedPolicy, WalkingSettings
from rebody.cli.output import check_output


@dataclass(frozen=True)
class Export:
    """Write a walking policy that was learned here as ONNX, with what a robot needs in its metadata."""

    policy: Annotated[str, tyro.conf.Positional]
    """The artifact of `rebody train tracker` for a robot that follows a joystick: a shipped name or a folder."""
    out: Path = tyro.MISSING
    """Where the ONNX file goes."""

    def run(self) -> None:
        """Write it, say what a description says of it."""
        check_output(self.out, "--out", (".onnx",))
        policy = TrainedPolicy(self.policy)
        export_onnx(policy, self.out)
        console = Console(soft_wrap=True)
        console.print(f"written: {self.out}; as a robot's policy (docs/walking-robots.md):\n", markup=False)
        console.print(_table(self.out, policy.settings), markup=False, highlight=False)


def _table(path: Path, settings: WalkingSettings) -> str:
    """Of a description: all that the file does not say itself."""
    limits = zip(WAYS, settings.low, settings.high, strict=True)
    ways = "\n".join(f"{way} = [{low:g}, {high:g}]" for way, low, high in limits)
    slow = "\n".join(f"{name} = {list(getattr(settings, name))}" for name in ("dead", "drift"))
    stick = f"at_once = {settings.at_once:g}\nrate = {settings.joystick.rate:g}"
    return f'[policy]\nonnx = "{path}"\n\n[policy.joystick]\n{ways}\n{slow}\n{stick}'
