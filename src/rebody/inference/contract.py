"""What an inference module expects of a body before it may be attached to it."""

from collections.abc import Sequence
from dataclasses import dataclass

from rebody.errors import RebodyError
from rebody.ranges import Decisions, Positive
from rebody.tasks import FamilySet
from rebody.types import DECISION_DT

CONTRACT_VERSION = 2


@dataclass(frozen=True)
class Contract:
    """Inputs, time and tasks of an inference module; stored with it and checked when it is attached."""

    fields: tuple[str, ...]
    """Fields of the global state that the encoder sees (m, m/s, rad, rad/s)."""
    window: Decisions | None
    """Decisions that a belief rests on; None for all since the episode began."""
    families: FamilySet
    """What it tells apart, with the targets that it learned and the rewards that it hears."""
    decision_dt: Positive = DECISION_DT
    """Seconds between two transitions."""
    version: int = CONTRACT_VERSION
    any_law: bool = False
    """Whether it hears rewards of any law, in any scale and with any bonus; else those of its families' own laws."""

    def check_time(self) -> None:
        """RebodyError if the module does not hear of a body as often as this release decides."""
        if problems := self._problems_of_time():
            raise RebodyError(f"the inference module does not fit: {problems[0]}.")

    def check_body(self, name: str, moving_fields: Sequence[str], slots: Sequence[str]) -> None:
        """RebodyError with all that does not fit a body that moves these fields and follows these slots."""
        problems = self._problems_of_time()
        if missing := [field for field in self.fields if field not in moving_fields]:
            problems.append(f"its encoder sees {', '.join(missing)}, which '{name}' does not have")
        if missing := [family for family in self.families.names if family not in slots]:
            problems.append(f"the tracker has no slot for {', '.join(missing)} (it has {', '.join(slots)})")
        if problems:
            raise RebodyError(f"the inference module does not fit '{name}': {'; '.join(problems)}.")

    def _problems_of_time(self) -> list[str]:
        if self.decision_dt == DECISION_DT:
            return []
        return [f"it expects a decision every {self.decision_dt:g} s, here one takes {DECISION_DT} s"]
