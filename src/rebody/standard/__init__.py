"""The tasks that meta-learning papers compare themselves on, as Gymnasium environments with the published rewards."""

import gymnasium

__all__ = ["register_environments"]

_STEPS = 200
_ENVIRONMENTS = (
    ("CheetahVel", "cheetah:CheetahVelEnv", _STEPS, {}),
    ("CheetahDir", "cheetah:CheetahDirEnv", _STEPS, {}),
    ("AmagoCheetahVel", "cheetah:AmagoCheetahVelEnv", 1000, {}),
    ("MeltsCheetah", "melts:MeltsCheetahEnv", _STEPS, {}),
    ("MeltsCheetahChanging", "melts:MeltsCheetahEnv", _STEPS, {"change_every": 80}),
    ("AntGoal", "ant:AntGoalEnv", _STEPS, {}),
    ("AntDir", "ant:AntDirEnv", _STEPS, {}),
    ("HumanoidDir", "humanoid:HumanoidDirEnv", _STEPS, {}),
)
"""Name, where it is, steps of an episode, and settings."""


def register_environments() -> None:
    """Tell Gymnasium where `rebody-standard/CheetahVel-v0` ... are; they load when made."""
    for name, where, steps, settings in _ENVIRONMENTS:
        gymnasium.register(
            f"rebody-standard/{name}-v0",
            entry_point=f"{__name__}.{where}",
            max_episode_steps=steps,
            kwargs=settings,
        )
