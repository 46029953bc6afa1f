"""Laws drawn anew for each episode, so that a module hears what is meant, whatever way it is paid."""

from dataclasses import dataclass

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Bool, Float, Int, PRNGKeyArray

from rebody.ranges import NotNegative, Number, Positive, Share
from rebody.tasks import LAWS, FamilySet, RewardLaw
from rebody.tasks.payment import FORMS, MOST_LATE_S
from rebody.types import DECISION_DT, AnyArray, GlobalState, Task

LATEST = round(MOST_LATE_S / DECISION_DT)


class DrawnLaws(eqx.Module):
    """How the tasks of each episode are paid: arrays of what `rebody.tasks.Payment` says of one."""

    form: Int[AnyArray, "*batch"]
    relative: Bool[AnyArray, "*batch"]
    scale: Float[AnyArray, "*batch"]
    offset: Float[AnyArray, "*batch"]
    width: Float[AnyArray, "*batch"]
    control_cost: Float[AnyArray, "*batch"]
    noise: Float[AnyArray, "*batch"]
    delay: Int[AnyArray, "*batch"]
    forms: tuple[str, ...] = eqx.field(static=True)

    def earned(
        self, families: FamilySet, task: Task, state: GlobalState, action: Float[AnyArray, "*batch action"]
    ) -> Float[AnyArray, "*batch"]:
        """What a decision earns that led to a state by an action in [-1, 1]."""
        error, size = families.error(task, state), families.scale(task)
        paid = []
        for form in (FORMS[name] for name in self.forms):
            distance = RewardLaw("", "", LAWS["plain"].pay, measure=form.measure).distance(error, task.target)
            far = jnp.where(self.relative, distance / size, distance)
            width = jnp.where(self.relative, self.width, self.width * size)
            paid.append(form.pay(far, width, 1.0))
        chosen = jnp.select([self.form == i for i in range(len(paid))], paid)
        return self.scale * (chosen - self.control_cost * jnp.mean(action**2, axis=-1)) + self.offset


class Pay(eqx.Module):
    """What episodes are paid, decision after decision."""

    laws: DrawnLaws | None
    """None for each family's own law."""
    owed: Float[AnyArray, "late *batch"]
    """What was earned last, the newest first."""
    decision: Int[AnyArray, ""]

    def after(
        self,
        families: FamilySet,
        task: Task,
        state: GlobalState,
        action: Float[AnyArray, "*batch action"],
        key: PRNGKeyArray,
    ) -> tuple["Pay", Float[AnyArray, "*batch"]]:
        """The pay after one more decision, and what is heard then: before anything is due, the first that is earned."""
        if self.laws is None:
            return self, families.reward(task, state)
        earned = self.laws.earned(families, task, state, action)
        owed = jnp.where(self.decision == 0, earned, jnp.concatenate([earned[None], self.owed[:-1]]))
        due = jnp.take_along_axis(owed, self.laws.delay[None], axis=0)[0]
        noise = self.laws.scale * self.laws.noise * jax.random.normal(key, due.shape)
        return Pay(self.laws, owed, self.decision + 1), due + noise


def first_pay(laws: DrawnLaws | None, shape: tuple[int, ...]) -> Pay:
    """Before the first decision."""
    return Pay(laws, jnp.zeros((LATEST + 1, *shape)), jnp.zeros((), jnp.int32))


@dataclass(frozen=True)
class LawDistribution:
    """How laws are drawn. Widths are told in sizes of the target, costs and noise in units of the scale."""

    forms: tuple[str, ...] = ("distance", "l1", "squared", "gaussian", "clipped")
    """Each as likely as any other."""
    relative: Share = 0.5
    """Share whose distances are told in sizes of the target."""
    scale: tuple[Positive, Positive] = (0.1, 10.0)
    """Log-uniform between these."""
    offset: NotNegative = 5.0
    """Largest bonus that is paid at every moment."""
    width: tuple[Positive, Positive] = (0.5, 2.0)
    """Narrowest and widest of the forms that have one."""
    control_cost: NotNegative = 0.2
    """Largest price of the mean squared action."""
    noise: NotNegative = 0.02
    """Largest standard deviation of noise."""
    latest: Number = LATEST
    """Decisions that a reward is late at most."""
    plain: Share = 0.5
    """Share of episodes without each: a bonus, a cost, noise, a delay."""

    def draw(self, key: PRNGKeyArray, shape: tuple[int, ...]) -> DrawnLaws:
        """Laws of a batch of episodes."""
        keys = jax.random.split(key, 12)
        low, high = (jnp.log(end) for end in self.scale)

        def up_to(i: int, most: float) -> Float[AnyArray, "*batch"]:
            has = jax.random.bernoulli(keys[i], 1 - self.plain, shape)
            return jnp.where(has, most * jax.random.uniform(keys[i + 1], shape), 0.0)

        return DrawnLaws(
            form=jax.random.randint(keys[0], shape, 0, len(self.forms)),
            relative=jax.random.bernoulli(keys[1], self.relative, shape),
            scale=jnp.exp(jax.random.uniform(keys[2], shape, minval=low, maxval=high)),
            width=jax.random.uniform(keys[3], shape, minval=self.width[0], maxval=self.width[1]),
            offset=up_to(4, self.offset),
            control_cost=up_to(6, self.control_cost),
            noise=up_to(8, self.noise),
            delay=jnp.round(up_to(10, float(self.latest))).astype(jnp.int32),
            forms=self.forms,
        )
