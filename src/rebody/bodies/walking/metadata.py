"""What a walking policy's ONNX file says of itself: metadata as mjlab and holosoma write them."""

import json
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float

from rebody.bodies.walking.settings import Term
from rebody.errors import RebodyError

TERMS: dict[str, Term] = {
    "base_lin_vel": "linear_velocity",
    "base_ang_vel": "angular_velocity",
    "projected_gravity": "gravity",
    "joint_pos": "joint_positions",
    "joint_vel": "joint_velocities",
    "actions": "last_action",
    "command": "command",
    "velocity_commands": "command",
}
"""What mjlab and Isaac Lab call them."""
KEYS = {"joint_names": "dof_names", "joint_stiffness": "kp", "joint_damping": "kd"}
"""What mjlab writes under the first, holosoma writes under the second."""


@dataclass(frozen=True)
class FileSays:
    """Nothing, where a file does not say it; the misfit for what no description could have."""

    metadata: Mapping[str, str]
    misfit: Callable[[str], RebodyError]
    """The error that says why."""

    @cached_property
    def inputs(self) -> tuple[Term, ...]:
        """What it hears, in its order."""
        names = self._list("observation_names")
        if unknown := [name for name in names if name not in TERMS]:
            raise self.misfit(f"its file names an input '{unknown[0]}'; say [policy] inputs in the description's words")
        if any(math.isfinite(end) for ends in self._list("observation_terms_clip") for end in _split(ends)):
            raise self.misfit("its file clips single inputs, which is not known; say [policy] inputs, and clip for all")
        return tuple(TERMS[name] for name in names)

    @cached_property
    def scales(self) -> dict[Term, Float[np.ndarray, " number"]]:
        """What inputs are multiplied by, one number or one of each of theirs."""
        said = self._list("observation_terms_scale")
        return {name: np.array(_split(scale)) for name, scale in zip(self.inputs, said, strict=False)}

    @cached_property
    def history(self) -> int | None:
        """Control steps that each input is shown of."""
        lengths = sorted({max(1, int(length)) for length in self._numbers("observation_terms_history_length")})
        if len(lengths) > 1:
            raise self.misfit(f"its inputs have histories of different lengths ({', '.join(map(str, lengths))})")
        return lengths[0] if lengths else None

    @property
    def joints(self) -> tuple[str, ...]:
        """In its order."""
        return tuple(self._list("joint_names"))

    def of_joints(self, key: str, joints: int) -> Float[np.ndarray, " joint"] | None:
        """A number of each joint, in its order; one may stand for all."""
        numbers = self._numbers(key)
        if len(numbers) not in (0, 1, joints):
            raise self.misfit(f"its file says {len(numbers)} numbers of {key} for {joints} joints")
        return np.broadcast_to(numbers, joints) if len(numbers) else None

    def _list(self, key: str) -> list[str]:
        """JSON or with commas."""
        said = self.metadata.get(key) or self.metadata.get(KEYS.get(key, key))
        if not said:
            return []
        try:
            values = json.loads(said)
        except ValueError:
            values = said.split(",")
        return [str(value).strip() for value in (values if isinstance(values, list) else [values])]

    def _numbers(self, key: str) -> Float[np.ndarray, " number"]:
        """Finite ones, or none."""
        try:
            numbers = np.array([float(number) for number in self._list(key)])
        except ValueError:
            return np.zeros(0)
        return numbers if np.isfinite(numbers).all() else np.zeros(0)


def _split(said: str) -> list[float]:
    """Numbers with semicolons between them, as mjlab has them of one input; none where there are none."""
    try:
        return [float(number) for number in said.split(";")]
    except ValueError:
        return []
