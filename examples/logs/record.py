"""Logs a run of the cheetah as one would log a robot of one's own: the task changes from a goal to a speed.

python examples/logs/record.py cheetah.csv
"""

import csv
import sys
from pathlib import Path

import gymnasium

import rebody

GOAL, SPEED, CHANGES_S = 6.0, -2.0, 10.0  # m, m/s, s
COLUMNS = ("time_s", "position_m", "velocity_m_s", "pitch_rad", "reward")


def record(path: Path, seconds: float = 20.0) -> None:
    """A row per control step of 0.05 s; the first is where it stands at the start."""
    env, agent = gymnasium.make("rebody/HalfCheetah-v0"), rebody.load_agent()
    observation, info = env.reset(seed=0)
    rows = [(0.0, info["x"], info["vx"], info["pitch"], 0.0)]
    for step in range(1, round(seconds / 0.05) + 1):
        observation, _, _, _, info = env.step(agent.step(observation, rows[-1][-1]))
        time = 0.05 * step
        reward = -abs(info["x"] - GOAL) / abs(GOAL) if time <= CHANGES_S else -abs(info["vx"] - SPEED) / abs(SPEED)
        rows.append((time, info["x"], info["vx"], info["pitch"], reward))
    with path.open("w", newline="") as file:
        csv.writer(file).writerow(COLUMNS)
        csv.writer(file).writerows([f"{number:.5g}" for number in row] for row in rows)


if __name__ == "__main__":
    record(Path(sys.argv[1]))
