"""What a checkpoint says beside the state is held against what a run can say."""

import equinox as eqx
import numpy as np
import pytest
from jaxtyping import Float, Int

from rebody.errors import RebodyError
from rebody.store import save_checkpoint
from rebody.training.run import Run
from rebody.types import AnyArray

SETTINGS = {"iterations": 5, "rate": 0.1}
SOUND = {"settings": SETTINGS, "wall_s": 1.5, "history": [{"loss": 0.5}, {"loss": 0.25}], "changes": []}


class State(eqx.Module):
    iteration: Int[AnyArray, ""]
    weights: Float[AnyArray, " n"]


def state(weight=1.0):
    return State(np.array(2), np.full(3, weight))


def resumed(out, meta, saved):
    save_checkpoint(out / "checkpoint", saved, meta)
    with Run(out, SETTINGS, resume=True) as run:
        run.restore(state(0.0))
    return run


@pytest.mark.parametrize("meta", [SOUND, {name: value for name, value in SOUND.items() if name != "changes"}])
def test_a_sound_checkpoint_is_resumed(meta, tmp_path):
    run = resumed(tmp_path, meta, state())
    assert (run.wall_s, run.history, run.changes) == (1.5, SOUND["history"], [])


@pytest.mark.parametrize(
    ("meta", "says"),
    [
        ({}, "missing required field `settings`"),
        (SOUND | {"settings": None}, "settings: Expected"),
        (SOUND | {"settings": {"rate": 0.1}}, r"settings\.iterations"),
        (SOUND | {"settings": SETTINGS | {"iterations": "5"}}, "settings"),
        (SOUND | {"settings": SETTINGS | {"iterations": -5}}, "settings"),
        (SOUND | {"wall_s": float("nan")}, "wall_s"),
        (SOUND | {"wall_s": -1.0}, "wall_s"),
        (SOUND | {"history": None}, "history: Expected"),
        (SOUND | {"history": [{"loss": "low"}]}, r"history\[0\]"),
        (SOUND | {"history": [{"loss": 10**400}]}, "history"),
        (SOUND | {"history": [{"loss": 0.5}]}, "is not that of its history"),
        (SOUND | {"changes": [3]}, r"changes\[0\]"),
        (SOUND | {"colour": "red"}, "colour: it is unknown"),
    ],
)
def test_a_foreign_one_is_refused_by_its_key(meta, says, tmp_path):
    with pytest.raises(RebodyError, match=rf"checkpoint in .* is not understood \(.*{says}"):
        resumed(tmp_path, meta, state())


def test_one_whose_state_is_not_finite_is_refused(tmp_path):
    with pytest.raises(RebodyError, match=r"is not understood \(.* not finite"):
        resumed(tmp_path, SOUND, state(np.nan))
