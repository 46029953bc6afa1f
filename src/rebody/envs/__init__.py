"""Gymnasium environments that hide their task from the observation. Importing this is cheap."""

import gymnasium

_EPISODE_STEPS = {"PointMass": 200, "HalfCheetah": 400}
"""Steps in 20 simulated seconds."""


def register_environments() -> None:
    """Tell Gymnasium where `rebody/PointMass-v0` and `rebody/HalfCheetah-v0` are; they load when made."""
    for name, steps in _EPISODE_STEPS.items():
        gymnasium.register(
            f"rebody/{name}-v0",
            entry_point=f"rebody.envs.shipped:{name}Env",
            vector_entry_point=f"rebody.envs.shipped:{name}VectorEnv",
            max_episode_steps=steps,
        )
