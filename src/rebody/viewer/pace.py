"""Simulated time that keeps step with the clock on the wall."""

LONGEST_S = 0.25
"""What is made up for at once, of time that was lost [s]: after a stall the simulation goes on, it does not race."""
MEASURED_S = 1.0
"""Over how long the speed that was reached is measured [s]."""


class Pace:
    """Says how many steps are due."""

    def __init__(self, step_s: float, now: float):
        """`now` is a reading of any clock [s]."""
        self._step_s, self._last, self._owed = step_s, now, 0.0
        self._since, self._steps, self._reached = now, 0, 0.0

    def due(self, now: float, speed: float) -> int:
        """Steps to take at this moment for a speed in simulated seconds per second."""
        self._owed += min(now - self._last, LONGEST_S) * speed
        self._last = now
        steps = int(self._owed / self._step_s + 1e-9)
        self._owed -= steps * self._step_s
        self._measure(now, steps)
        return steps

    def wait(self, now: float) -> None:
        """Let time pass without the simulation."""
        self._last = self._since = now
        self._steps, self._reached = 0, 0.0

    @property
    def share(self) -> float:
        """How far the moment lies between the last step and the next one, from 0 to 1."""
        return max(0.0, min(1.0, self._owed / self._step_s))

    @property
    def reached(self) -> float:
        """The speed of late; 0 before it has been measured."""
        return self._reached

    def _measure(self, now: float, steps: int) -> None:
        self._steps += steps
        if now - self._since >= MEASURED_S:
            self._reached = self._steps * self._step_s / (now - self._since)
            self._since, self._steps = now, 0
