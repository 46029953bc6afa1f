"""The exact posterior by particles: the yardstick of families of more than one number (agent `bayes`).

A grid in two dimensions is coarser than a sharpened belief. Here tasks are particles: as many of each base task, spread
evenly over its range. Every decision moves each by Gauss-Newton steps on all rewards that were heard, by the true
reward law, and weighs it by Laplace's approximation of the probability around it (Tierney and Kadane 1986); the least
likely begin anew somewhere else.
"""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import scipy.stats
from jaxtyping import Array, Bool, Float, Int

from rebody.inference.refine import levenberg_marquardt
from rebody.inference.roots import log_determinant, root_of
from rebody.ranges import Box
from rebody.tasks import Family, FamilySet
from rebody.types import AnyArray, Belief, GlobalState, Task, Transition, global_state

REWARD_STD = 2e-3
"""Standard deviation of the reward's likelihood, in units of the reward: rewards are exact."""
PARTICLES, FRESH = 32, 8
"""Of each base task, and how many of them begin anew at every decision."""
STEPS = 3
"""Of Gauss-Newton at a decision; a particle goes on from where it was."""
HEARD = 64
"""Rewards that are kept. When there are more, each second one stays and stands for its neighbour."""
STAYS = 1.0
"""How much likelier another task must be than the one that was said before to be said in its place [nats]."""
UNEXPLAINED = 18.0
"""The task has changed where no particle explains all that was heard to so many nats: 6 standard deviations."""
STARTS = 512


class Heard(eqx.Module):
    """Rewards, and the states that they were paid in."""

    states: GlobalState  # [*batch, heard]
    rewards: Float[AnyArray, "*batch heard"]
    stands_for: Float[AnyArray, "*batch heard"]
    """How many rewards each stands for; 0 behind the last."""

    def adding(self, state: GlobalState, reward: Float[AnyArray, ""], forget: Bool[AnyArray, ""]) -> "Heard":
        """With one more, of one body; all others are forgotten where the task is another one."""
        many = jnp.where(forget, 0.0, self.stands_for)
        is_full = many[-1] > 0
        halves = jnp.sum(many.reshape(-1, 2), axis=-1)
        many = jnp.where(is_full, jnp.concatenate([halves, jnp.zeros_like(halves)]), many)
        last = jnp.sum(many > 0)

        def kept(old, new):
            thinned = jnp.concatenate([old[1::2], old[1::2]])
            return jnp.where(is_full, thinned, old).at[last].set(new)

        states = jax.tree.map(kept, self.states, state)
        return Heard(states, kept(self.rewards, reward), many.at[last].set(1.0))


class Memory(eqx.Module):
    """What is carried from decision to decision."""

    heard: Heard
    shares: tuple[Float[AnyArray, "*batch particle _"], ...]
    """Where the particles of each base task are within its range, the likeliest first."""
    said: Int[AnyArray, "*batch"]
    """The likeliest base task."""
    changed: Bool[AnyArray, "*batch"]
    """Whether nothing explained all that was heard."""
    decision: Int[AnyArray, "*batch"]


class ParticlePosterior(eqx.Module):
    """Particles over (family, target) that are moved and weighed by Bayes' rule."""

    families: FamilySet = eqx.field(static=True)

    def initial(self, shape: tuple[int, ...] = ()) -> Memory:
        """Nothing heard: particles all over the ranges."""
        none = jnp.zeros((*shape, HEARD))
        spread = [jnp.asarray(_evenly(box.size)[:PARTICLES]) for _, box in self._base_tasks]
        return Memory(
            Heard(global_state(x=none), none, none),
            tuple(jnp.broadcast_to(each, (*shape, *each.shape)) for each in spread),
            jnp.zeros(shape, jnp.int32),
            jnp.zeros(shape, bool),
            jnp.zeros(shape, jnp.int32),
        )

    def prior(self, shape: tuple[int, ...] = ()) -> Belief:
        """The belief before anything is seen."""
        memory = self.initial(shape)
        return self._belief(memory, jnp.full(shape, 1 / len(self._base_tasks)))

    def step(self, memory: Memory, transition: Transition) -> tuple[Memory, Belief]:
        """Take in a transition: its reward is all that tells."""
        one = self._of_one_body
        reward = jnp.asarray(transition.reward)
        for _ in reward.shape:
            one = jax.vmap(one)
        memory, chance = one(memory, transition.state, reward)
        return memory, self._belief(memory, chance)

    def unheard(self, memory: Memory, transition: Transition) -> Memory:
        """A decision in which no reward was heard leaves no trace; the transition's reward means nothing."""
        return memory

    @property
    def _base_tasks(self) -> list[tuple[Family, Box]]:
        return [(family, box) for family in self.families for box in family.targets]

    def _of_one_body(self, memory: Memory, state: GlobalState, reward: Float[AnyArray, ""]):
        """The memory after one more reward, and the probability of the base task that it says."""
        heard = memory.heard.adding(state, reward, memory.changed)
        moved, weights, costs = [], [], []
        for (family, box), shares in zip(self._base_tasks, memory.shares, strict=True):
            first = FRESH * memory.decision
            fresh = jnp.asarray(_evenly(box.size))[(first + jnp.arange(FRESH)) % STARTS]
            started = jnp.concatenate([shares[:-FRESH], fresh])
            ended, cost, weight = jax.vmap(lambda share, on=family, within=box: _moved(heard, on, within, share))(
                started
            )
            order = jnp.argsort(-weight.at[0].add(STAYS))
            moved.append(ended[order])
            weights.append(weight[order[0]])
            costs.append(jnp.min(cost))
        log_chance = jax.nn.log_softmax(jnp.stack(weights))
        said = jnp.argmax(log_chance.at[memory.said].add(STAYS))
        changed = jnp.min(jnp.stack(costs)) > UNEXPLAINED
        return Memory(heard, tuple(moved), said, changed, memory.decision + 1), jnp.exp(log_chance[said])

    def _belief(self, memory: Memory, chance: Float[AnyArray, "*batch"]) -> Belief:
        """The likeliest particle as (family, target ...); the variance is what is left of the probability."""
        base_tasks, families = self._base_tasks, self.families
        targets = [
            families.pad(target_at(box, shares[..., 0, :]))
            for (_, box), shares in zip(base_tasks, memory.shares, strict=True)
        ]
        target = jnp.take_along_axis(jnp.stack(targets), memory.said[None, ..., None], axis=0)[0]
        family = jnp.asarray([families.index(each.name) for each, _ in base_tasks], jnp.float32)[memory.said]
        mean = jnp.concatenate([family[..., None], target], axis=-1)
        return Belief(mean, jnp.broadcast_to(1 - chance[..., None], mean.shape))


def target_at(box: Box, share: Float[AnyArray, "*batch number"]) -> Float[Array, "*batch number"]:
    """The target that is so far between the ends of each number of a range."""
    low, high = jnp.asarray(box.low), jnp.asarray(box.high)
    drawn = low + (high - low) * share
    if not box.polar:
        return drawn
    length, bearing = drawn[..., 0], drawn[..., 1]
    return jnp.stack([length * jnp.cos(bearing), length * jnp.sin(bearing)], axis=-1)


def _moved(heard: Heard, family: Family, box: Box, start: Float[Array, " number"]):
    """A particle after its steps, what it leaves unexplained [nats], and the log-probability around it."""
    alone = FamilySet((family,))

    def unexplained(share):
        target = jnp.broadcast_to(target_at(box, share), (HEARD, box.size))
        task = Task(jnp.zeros(HEARD, jnp.int32), target)
        apart = (heard.rewards - alone.reward(task, heard.states)) / REWARD_STD
        return jnp.sqrt(heard.stands_for) * apart

    share, cost, slope = levenberg_marquardt(unexplained, start, STEPS, lambda share: _within(family, box, share))
    root = root_of(slope, 12**0.5 * jnp.eye(box.size))  # beside an even spread over the range
    return share, cost, -cost - 0.5 * log_determinant(root) + 0.5 * box.size * jnp.log(2 * jnp.pi)


def _within(family: Family, box: Box, share: Float[Array, " number"]) -> Float[Array, " number"]:
    """Shares between 0 and 1; what goes all round goes on from the other end."""
    span = np.subtract(box.high, box.low)
    is_angle = (False, True) if box.polar else family.quantity.wraps
    goes_round = np.array(is_angle) & np.isclose(span, 2 * np.pi)
    return jnp.where(goes_round, share % 1.0, jnp.clip(share, 0.0, 1.0))


def _evenly(size: int) -> Float[np.ndarray, "start number"]:
    """Points all over a unit cube, the same each time."""
    return scipy.stats.qmc.Halton(size, scramble=False).random(STARTS + 1)[1:].astype(np.float32)
