"""A cheetah whose hidden task changes while it runs. The agent is told neither the tasks nor that
they change: all it hears is how it is paid.

    python examples/driving.py
"""

from collections.abc import Iterator, Sequence

import gymnasium

import rebody

TASKS = (("goal", 4.0), ("velocity", -1.5))  # m, m/s
FIELDS = {"goal": "x", "velocity": "vx"}
CONTROL_DT = 0.05  # s


def drive(tasks: Sequence[tuple[str, float]] = TASKS, seconds: float = 8.0) -> Iterator[tuple]:
    """Every second: time [s], the task, what is believed, where the robot is [m] and how fast [m/s]."""
    env = gymnasium.make("rebody/HalfCheetah-v0")
    agent = rebody.load_agent(robot="cheetah", inference="goal-velocity")
    observation, info = env.reset(seed=0)
    reward, steps = 0.0, 0
    for family, target in tasks:
        for _ in range(round(seconds / CONTROL_DT)):
            observation, *_, info = env.step(agent.step(observation, reward))
            # in place of the environment's own reward, which is for one task from its reset on
            reward = -abs(info[FIELDS[family]] - target) / abs(target)
            steps += 1
            if steps % round(1 / CONTROL_DT) == 0:
                yield steps * CONTROL_DT, (family, target), agent.inferred, info["x"], info["vx"]


if __name__ == "__main__":
    for time, (family, target), (believed, (amount,)), x, vx in drive():
        tasks = f"hidden: {family:8} {target:5.1f}   believed: {believed:8} {amount:5.2f}"
        print(f"{time:4.0f} s   {tasks}   at {x:5.2f} m, {vx:5.2f} m/s")
