"""Tiny artifacts, made by the command line itself."""

from pathlib import Path

import pytest

from rebody.cli.main import run
from rebody.training.inference import report as inference_report
from rebody.training.tracker import report as tracker_report

TRACKER = """
    train tracker --robot cheetah --robots 4 --steps 4 --updates 2 --iterations 9 --replay 60
    --sac.hidden 8 8 --sac.batch-size 8
"""
INFERENCE = """
    train inference --episodes 8 --decisions 24 --groups 2
    --wander-iterations 1 --joint-iterations 2 --policy-iterations 6 --inference-updates 2 --policy-updates 2
    --inference.units 8 --inference.window 4 --inference.batch-size 4 --inference.decoded 2
    --sac.hidden 8 8 --sac.projections 2 --sac.batch-size 8
"""


@pytest.fixture(scope="session")
def trained(tmp_path_factory) -> dict[str, Path]:
    """Folders of a tracker and of an inference module that learned next to nothing."""
    folder = tmp_path_factory.mktemp("trained")
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(tracker_report, "COMMANDS", 4)
        patched.setattr(tracker_report, "SECONDS", 3.0)
        patched.setattr(inference_report, "HELD_OUT", 8)
        patched.setattr(inference_report, "DECISIONS", 40)
        assert run([*TRACKER.split(), "--out", str(folder / "tracker")]) == 0
        assert run([*INFERENCE.split(), "--out", str(folder / "inference")]) == 0
    return {name: folder / name for name in ("tracker", "inference")}
