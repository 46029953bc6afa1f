"""What an inference module expects of a body before it may be attached to it."""

from dataclasses import dataclass

from rebody.errors import RebodyError
from rebody.ranges import Decisions, Finite, Positive
from rebody.tasks import RewardForm, family_index
from rebody.types import DECISION_DT

CONTRACT_VERSION = 1


@dataclass(frozen=True)
class Contract:
    """Inputs, time and tasks of an inference module; stored with it and checked when it is attached."""

    fields: tuple[str, ...]
    """Fields of the global state that the encoder sees (m, m/s, rad, rad/s)."""
    window: Decisions | None
    """Decisions that a belief rests on; None for all since the episode began."""
    target_ranges: dict[str, tuple[Finite, Finite]]
    """Smallest and largest target per family."""
    reward: RewardForm
    """Form of the reward that the encoder hears."""
    decision_dt: Positive = DECISION_DT
    """Seconds between two transitions."""
    version: int = CONTRACT_VERSION

    @property
    def families(self) -> tuple[int, ...]:
        """Indices of the families that the module can tell apart, ascending."""
        return tuple(sorted(family_index(name) for name in self.target_ranges))

    def check_time(self) -> None:
        """RebodyError if the module does not hear of a body as often as this release decides."""
        if problems := self._problems_of_time():
            raise RebodyError(f"the inference module does not fit: {problems[0]}.")

    def check_body(self, name: str, moving_fields: tuple[str, ...], slots: tuple[str, ...]) -> None:
        """RebodyError with all that does not fit a body that moves these fields and follows these slots."""
        problems = self._problems_of_time()
        if missing := [field for field in self.fields if field not in moving_fields]:
            problems.append(f"its encoder sees {', '.join(missing)}, which '{name}' does not have")
        if missing := [family for family in self.target_ranges if family not in slots]:
            problems.append(f"the tracker has no slot for {', '.join(missing)} (it has {', '.join(slots)})")
        if problems:
            raise RebodyError(f"the inference module does not fit '{name}': {'; '.join(problems)}.")

    def _problems_of_time(self) -> list[str]:
        if self.decision_dt == DECISION_DT:
            return []
        return [f"it expects a decision every {self.decision_dt:g} s, here one takes {DECISION_DT} s"]
