"""What `rebody list` prints agrees with what it is about."""

from rebody import names
from rebody.agents.kinds import KINDS
from rebody.evaluation.trial import POINT_MASS
from rebody.report.thesis import FIGURES
from rebody.store import load_artifact, shipped_artifacts
from rebody.tasks import SHIPPED
from rebody.training.inference import PRESETS


def test_families():
    lines = {each.name: f"{each.label}: {each.unit}, solved within {each.tolerance:g}" for each in SHIPPED}
    assert list(names.families().items()) == list(lines.items())


def test_agents():
    assert list(names.AGENTS) == list(KINDS)


def test_presets():
    lines = {name: preset.__doc__.splitlines()[0] for name, preset in PRESETS.items()}
    assert list(names.presets().items()) == list(lines.items())


def test_figures():
    assert list(names.FIGURES) == list(FIGURES)


def test_artifacts():
    assert list(names.artifact_titles()) == [name for name, _ in shipped_artifacts()]
    card = load_artifact("tracker-cheetah").card
    assert card.startswith(f"# {names.artifact_titles()['tracker-cheetah']}\n")


def test_the_toy():
    assert names.POINT_MASS == POINT_MASS
