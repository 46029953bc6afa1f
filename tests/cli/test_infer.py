"""`rebody infer` on the log that ships, and one clear message for a log that cannot be."""

import csv
import json
import os
from pathlib import Path

import numpy as np
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
    x = episode["quantities"]["x"]
    vx = np.diff([0.0, *x]) / 0.1
    with log.open("w", newline="") as file:
        rows = zip(episode["time_s"], x, vx, episode["reward"], strict=True)
        csv.writer(file).writerows([columns, [0.0] * 4, *rows])
    assert run(["infer", str(log), *module, "--sharpen", "--out", str(out)]) == 0
    rows = rows_of(out / "belief.csv")
    assert [row["inferred_family"] for row in rows] == episode["inferred_family"]
    inferred = [float(row["inferred_target"]) for row in rows]
    # decimals of the file: while little is known, a thousandth of a reward is some centimetres
    assert inferred == pytest.approx([target for (target,) in episode["inferred_target"]], abs=0.15)
    assert inferred[10:] == pytest.approx([target for (target,) in episode["inferred_target"][10:]], abs=0.05)


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


def damage(rows):
    """Of the shipped log: something wrong in seven rows, and half a second without any."""
    cells = [row.split(",") for row in rows]
    cells[30][1], cells[77][4], cells[120][1] = "nan", "", "1e12"
    cells[150] = cells[149]
    cells[220][0], cells[260][0] = "0.5", "99999"
    cells[300].pop()
    return [",".join(row) for i, row in enumerate(cells) if not 340 <= i < 350]


def test_damaged_rows_are_left_out_and_the_belief_is_the_same(tmp_path, capsys):
    header, *rows = LOG.read_text().splitlines()
    log = tmp_path / "log.csv"
    log.write_text("\n".join([header, *damage(rows)]))
    assert run(["infer", str(log)]) == 2
    assert "line 32: position_m is 'nan', not a finite number; --skip-bad-rows" in capsys.readouterr().err
    believed = {}
    for path, options in ((LOG, []), (log, ["--skip-bad-rows"])):
        assert run(["infer", str(path), *options, "--out", str(tmp_path / path.stem)]) == 0
        believed[path] = rows_of(tmp_path / path.stem / "belief.csv")
    printed = capsys.readouterr().out
    assert (
        "note: skipped 7 of 391 rows: 1 not finite, 1 unreadable, 1 too large, 1 with a wrong number of cel" in printed
    )
    assert "2 with a repeated time stamp, 1 with a time stamp out of order." in printed
    assert "note: 1 gap of more than 0.3 s without a sample, 0.55 s in all: the belief hears nothing there." in printed
    for whole, damaged in zip(believed[LOG], believed[log], strict=True):
        in_gap = 16.95 < float(whole["time_s"]) < 17.55
        assert (damaged["reward"] == "") == in_gap
        if float(whole["time_s"]) > 1.5:
            assert damaged["inferred_family"] == whole["inferred_family"]
    for i in (90, 190, 199):
        assert float(believed[log][i]["inferred_target"]) == pytest.approx(
            float(believed[LOG][i]["inferred_target"]), abs=0.05
        )


def test_semicolons_decimal_commas_and_milliseconds(tmp_path, capsys):
    """The error names what reads them, and then the belief is the same to the last digit."""
    header, *rows = (row.split(",") for row in LOG.read_text().splitlines())
    rows = [[f"{1000 * float(time):g}", *others] for time, *others in rows]
    log = tmp_path / "log.csv"
    log.write_text("\ufeff" + "\r\n".join(";".join(row).replace(".", ",") for row in [header, *rows]))
    assert run(["infer", str(log)]) == 2
    options = "--delimiter semicolon --decimal-comma --time-unit ms"
    assert f"Read it with {options}." in capsys.readouterr().err
    assert run(["infer", str(log), *options.split(), "--out", str(tmp_path / "other")]) == 0
    assert run(["infer", str(LOG), "--out", str(tmp_path / "plain")]) == 0
    assert (tmp_path / "other" / "belief.csv").read_bytes() == (tmp_path / "plain" / "belief.csv").read_bytes()


def test_a_log_from_elsewhere_begins_at_zero(tmp_path, capsys):
    header, *rows = (row.split(",") for row in LOG.read_text().splitlines())
    log = tmp_path / "log.csv"
    with log.open("w", newline="") as file:
        moved = [[f"{1.7e9 + float(time):.2f}", float(x) + 100, *others] for time, x, *others in rows]
        csv.writer(file).writerows([header, *moved])
    assert run(["infer", str(log), "--out", str(tmp_path)]) == 0
    printed = capsys.readouterr().out
    assert "note: time_s begins at 1700000000 s" in printed
    assert "note: position_m begins at 100 m" in printed
    assert "doubtful" not in printed
    row = rows_of(tmp_path / "belief.csv")[90]
    assert (row["time_s"], row["inferred_family"]) == ("9.1", "goal")
    assert float(row["inferred_target"]) == pytest.approx(6.0, abs=0.3)


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


@pytest.mark.parametrize("place", [lambda log, there: None, os.symlink, os.link], ids=["itself", "symlink", "link"])
@pytest.mark.parametrize("name", ["belief.csv", "belief.png"])
def test_a_log_is_not_written_over(name, place, tmp_path, capsys):
    log = there = tmp_path / name
    if place in (os.symlink, os.link):
        log = tmp_path / "log.csv"
    log.write_text(LOG.read_text())
    place(log, there)
    assert run(["infer", str(log), "--out", str(tmp_path)]) == 2
    assert "would write over what is read" in capsys.readouterr().err
    assert log.read_text() == there.read_text() == LOG.read_text()


@pytest.fixture
def walk(tmp_path):
    """A function: reward of (x, height) -> log of a body in the plane, with its height beside it."""

    def write(pay):
        time = 0.1 * np.arange(61)
        x, y, yaw = 3 * np.sin(0.6 * time), np.sin(0.9 * time), np.sin(0.4 * time)
        z = 0.5 + 0.1 * np.sin(7 * time) + 0.05 * np.sin(17 * time)
        poses = {"position_m": x, "position_y_m": y, "yaw_rad": yaw, "position_z_m": z}
        speeds = {"velocity_m_s": np.gradient(x, 0.1), "velocity_y_m_s": np.gradient(y, 0.1)}
        columns = {"time_s": time, **poses, **speeds, "battery_v": time, "reward": pay(x, z)}
        log = tmp_path / "log.csv"
        with log.open("w", newline="") as file:
            csv.writer(file).writerows([columns, *zip(*columns.values(), strict=True)])
        return log

    return write


def test_rewards_that_no_known_task_explains_are_explained_by_another_column(walk, capsys):
    assert run(["infer", str(walk(lambda x, z: 3 - 2 * abs(z - 0.6))), "--inference", "plane-any"]) == 0
    printed = capsys.readouterr().out
    assert "not looked at: battery_v\n" in printed
    assert "doubtful: no task that the module knows explains the last 60 rewards: only " in printed
    assert (
        "what would explain them:\n  height (z), target 0.60 m, distance times 2, plus 3; explains 100.0 %" in printed
    )


def test_known_tasks_are_explained_and_nothing_else_is_proposed(walk, capsys):
    assert run(["infer", str(walk(lambda x, z: 3 - 2 * abs(x - 5))), "--inference", "plane-any"]) == 0
    printed = capsys.readouterr().out
    assert "that explains " in printed
    assert "doubtful: no task" not in printed
    assert "what would explain them" not in printed


def test_noise_is_explained_by_no_column(walk, capsys):
    noise = np.random.default_rng(0).normal(size=61)
    assert run(["infer", str(walk(lambda x, z: noise)), "--inference", "plane-any"]) == 0
    assert "nor does any quantity that the log has a column for" in capsys.readouterr().out
