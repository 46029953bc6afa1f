"""Anybody's environment, with a frozen module's belief about the task beside its observation."""

from collections.abc import Callable, Mapping
from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces
from jaxtyping import Float

from rebody import inputs
from rebody.agents.belief import LiveBelief, Reading
from rebody.agents.parts import load_inference
from rebody.errors import RebodyError
from rebody.types import DECISION_DT

Observe = Callable[[Any, dict[str, Any]], Mapping[str, Any]]
"""(observation, info) -> the fields that the module sees, as `LiveBelief.update` has them."""
TaskReward = Callable[[Any, float, dict[str, Any]], float | None]
"""(observation, reward, info) -> the task's share of the reward: -|error|, without costs and bonuses; None where
nothing was heard."""


def _info(observation: Any, info: dict[str, Any]) -> Mapping[str, Any]:
    return info


def _reward(observation: Any, reward: float, info: dict[str, Any]) -> float:
    return reward


class BeliefObservation(gymnasium.Wrapper, gymnasium.utils.RecordConstructorArgs):
    """Appends mean and standard deviation of the latent; they change once per decision of 0.1 s."""

    def __init__(
        self,
        env: gymnasium.Env,
        inference: str = "goal-velocity",
        *,
        control_dt: float,
        observe: Observe = _info,
        task_reward: TaskReward = _reward,
        sharpen: bool = False,
    ):
        """`control_dt` is what a step of the environment lasts [s]; `inference` a shipped name or a folder.

        With `sharpen` beliefs are refined, for rewards of single states, not of a mean over steps. As they are,
        `observe` and `task_reward` serve the environments of this package. RebodyError where steps do not divide a
        decision, or observations are no vector.
        """
        made_of = {"inference": inference, "control_dt": control_dt, "observe": observe, "task_reward": task_reward}
        made_of |= {"sharpen": sharpen}
        gymnasium.utils.RecordConstructorArgs.__init__(self, **made_of)
        gymnasium.Wrapper.__init__(self, env)
        if not inputs.number(control_dt, "control_dt") > 0:
            raise RebodyError(f"control_dt is {control_dt:g} s; a step of the environment lasts longer than 0.")
        self._per_decision = round(DECISION_DT / control_dt)
        if self._per_decision < 1 or not np.isclose(self._per_decision * control_dt, DECISION_DT):
            raise RebodyError(f"steps of {control_dt:g} s do not divide a decision of {DECISION_DT} s.")
        if not isinstance(env.observation_space, spaces.Box) or len(env.observation_space.shape) != 1:
            raise RebodyError(f"observations must be a vector, not {env.observation_space}; flatten them first.")
        self._inference, self._sharpen = load_inference(inference), sharpen
        self._observe, self._task_reward = observe, task_reward
        self._belief: LiveBelief | None = None
        self._rewards: list[float | None] = []
        self.observation_space = _with_belief(env.observation_space, self._inference.parts.module.encoder.latent)

    @property
    def reading(self) -> Reading:
        """What is believed now; RebodyError before the first reset."""
        return self._heard.reading

    @property
    def doubts(self) -> tuple[str, ...]:
        """About rewards of the last seconds that no task could have paid; they were not believed."""
        return self._heard.doubts()

    @property
    def _heard(self) -> LiveBelief:
        if self._belief is None:
            raise RebodyError("nothing is believed before the first reset: call reset.")
        return self._belief

    def reset(self, *, seed: Any = None, options: Any = None):
        """Start anew and forget; RebodyError where `observe` does not give what the module sees."""
        observation, info = self.env.reset(seed=seed, options=options)
        self._belief, self._rewards = None, []
        self._belief = self._inference.begin(self._observe(observation, info), self._sharpen)
        return self._beside(observation), info

    def step(self, action: Any):
        """One step; the last of each decision changes the belief, which hears the mean of the rewards that there are.

        RebodyError for a reward or a state that is no finite number, and before the first reset.
        """
        belief = self._heard
        observation, reward, terminated, truncated, info = self.env.step(action)
        self._rewards.append(inputs.reward(self._task_reward(observation, _number(reward), info)))
        if len(self._rewards) == self._per_decision:
            heard, self._rewards = [reward for reward in self._rewards if reward is not None], []
            belief.update(self._observe(observation, info), float(np.mean(heard)) if heard else None)
        return self._beside(observation), reward, terminated, truncated, info

    def _beside(self, observation: Float[np.ndarray, " n"]) -> Float[np.ndarray, " n_and_twice_latent"]:
        both = [observation, np.asarray(self.reading.latent.features())]
        return np.concatenate(both).astype(self.observation_space.dtype)


def _number(reward: Any) -> float:
    try:
        return float(reward)
    except (TypeError, ValueError):
        raise RebodyError(f"the environment's reward is {reward!r}; it must be a number.") from None


def _with_belief(space: spaces.Box, latent: int) -> spaces.Box:
    mean, deviation = np.full(latent, -np.inf), np.zeros(latent)
    low, high = np.concatenate([space.low, mean, deviation]), np.concatenate([space.high, np.full(2 * latent, np.inf)])
    dtype = np.result_type(space.dtype, np.float32)
    return spaces.Box(low.astype(dtype), high.astype(dtype), dtype=dtype.type)
