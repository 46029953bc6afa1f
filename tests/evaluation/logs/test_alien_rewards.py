"""A log whose rewards are paid in another form than the module learned is doubted."""

import csv
from pathlib import Path

import pytest

from rebody.cli.main import run

LOG = Path(__file__).parents[3] / "examples" / "logs" / "cheetah.csv"


@pytest.fixture
def said(tmp_path, capsys):
    """A function: what becomes of each reward of the shipped log -> what `rebody infer` says of that."""

    def infer(change):
        with LOG.open() as file:
            rows = list(csv.DictReader(file))
        for row in rows:
            row["reward"] = change(float(row["reward"]))
        path = tmp_path / "run.csv"
        with path.open("w", newline="") as file:
            writer = csv.DictWriter(file, rows[0])
            writer.writeheader()
            writer.writerows(rows)
        assert run(["infer", str(path)]) == 0
        return " ".join(capsys.readouterr().out.split())

    return infer


def test_the_log_as_it_is_is_not_doubted(said):
    assert "doubtful" not in said(lambda reward: reward)


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (lambda reward: 100 * reward, "which no target of goal or velocity pays there"),
        (
            lambda reward: 6 * reward,
            "The module expects -|error| / max(|target|, floor)",
        ),  # in metres: the goal is at 6
        (lambda reward: reward + 1, "without bonuses, costs or another scale"),
        (lambda reward: 0.0, "the same to the last digit, though the body moved"),
        (lambda reward: -9999.0, "the reward was -1e+04 in 200 decisions"),
        (lambda reward: 7.0, "believes nothing: there was no reward that it could believe"),
    ],
)
def test_alien_rewards_are_doubted(change, says, said):
    text = said(change)
    assert "doubtful:" in text
    assert says in text
