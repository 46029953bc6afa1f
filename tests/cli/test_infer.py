"""`rebody infer` on the log that ships, and one clear message for a log that cannot be."""

import csv
import json
from pathlib import Path

import pytest

from rebody.cli.main import run

LOG = Path(__file__).parents[2] / "examples" / "logs" / "cheetah.csv"


def rows_of(path):
    with path.open() as file:
        return list(csv.DictReader(file))


def test_the_shipped_log(tmp_path, capsys):
    out = tmp_path / "belief"
    assert run(["infer", str(LOG), "--inference", "goal-velocity", "--out", str(out)]) == 0
    printed = capsys.readouterr().out
    assert "not looked at: pitch_rad" in printed
    assert "doubtful" not in printed
    assert "goal-velocity believes at 20.0 s: velocity -" in printed
    assert sorted(path.name for path in out.iterdir()) == ["belief.csv", "belief.png"]
    rows = rows_of(out / "belief.csv")
    assert len(rows) == 200
    for i, family, target in ((90, "goal", 6.0), (190, "velocity", -2.0)):
        assert rows[i]["inferred_family"] == family
        assert float(rows[i]["inferred_target"]) == pytest.approx(target, abs=0.3)
    assert (out / "belief.png").read_bytes().startswith(b"\x89PNG")


def test_of_an_evaluation_it_says_what_the_agent_believed(own_module, tmp_path):
    tasks, results, log, out = (tmp_path / name for name in ("tasks.json", "results.json", "log.csv", "out"))
    tasks.write_text(json.dumps([{"family": "goal", "target": 2.0}]))
    module = ["--inference", str(own_module)]
    where = ["--robot", "point-mass", "--tasks", str(tasks), "--seconds", "3", "--json", str(results)]
    assert run(["evaluate", *module, *where]) == 0
    (episode,) = json.loads(results.read_text())["episodes"]
    columns = ("time_s", "position_m", "velocity_m_s", "reward")
    with log.open("w", newline="") as file:
        csv.writer(file).writerows([columns, [0.0] * 4, *zip(*(episode[name] for name in columns), strict=True)])
    assert run(["infer", str(log), *module, "--out", str(out)]) == 0
    rows = rows_of(out / "belief.csv")
    assert [row["inferred_family"] for row in rows] == episode["inferred_family"]
    inferred = [float(row["inferred_target"]) for row in rows]
    assert inferred == pytest.approx(episode["inferred_target"], abs=2e-3)


def test_without_a_folder_it_only_says(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert run(["infer", str(LOG), "--inference", "position"]) == 0
    assert "position believes at 20.0 s: goal" in capsys.readouterr().out
    assert list(tmp_path.iterdir()) == []


def test_a_doubt_is_said(tmp_path, capsys):
    log = tmp_path / "log.csv"
    log.write_text(
        "time_s,position_m,velocity_m_s,reward\n" + "".join(f"{0.1 * i},{0.1 * i},1000,-1\n" for i in range(9))
    )
    assert run(["infer", str(log)]) == 0
    assert "doubtful: velocity_m_s says 1e+03 where position_m moves at 1 per second" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("content", "options", "says"),
    [
        (None, [], "there is no log log.csv"),
        ("", [], "log.csv is empty"),
        ("time_s,reward\n0,0\n", [], "lacks position_m, velocity_m_s"),
        ("time_s,reward\n0,0\n", ["--inference", "positoin"], "position"),
        (LOG.read_text().replace("\n0.1,", "\n-3,", 1), [], "line 4: time_s is -3 after 0.05"),
        (LOG.read_text(), ["--out", "log.csv"], "log.csv is a file, not a folder"),
    ],
)
def test_what_the_user_can_mend_is_one_message(content, options, says, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    if content is not None:
        Path("log.csv").write_text(content)
    assert run(["infer", "log.csv", "--out", "out", *options]) == 2
    complaint = capsys.readouterr().err
    assert complaint.startswith("error: ")
    assert complaint.count("\n") == 1
    assert says in complaint
    assert [path.name for path in tmp_path.iterdir()] == ([] if content is None else ["log.csv"])


def test_a_log_is_not_written_over(tmp_path, capsys):
    log = tmp_path / "belief.csv"
    log.write_text(LOG.read_text())
    assert run(["infer", str(log), "--out", str(tmp_path)]) == 2
    assert "would write over the log" in capsys.readouterr().err
    assert log.read_text() == LOG.read_text()
