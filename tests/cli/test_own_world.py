"""A family of two numbers with an angle in it, a reward law and a robot, all of a user's own, reach every command."""

import csv
import json

import numpy as np
import pytest

from rebody.agents.parts import load_inference, load_tracker
from rebody.cli.main import run
from rebody.cli.trial import TrialOptions
from rebody.evaluation import read_results
from rebody.tasks import LAWS
from rebody.tasks.task_file import parse_task
from rebody.viewer.session import Session

FAMILIES = """
from rebody.ranges import Box
from rebody.tasks import Direction, Family, Quantity, RewardLaw

LAWS = [RewardLaw("saturating", "-error / (1 + error)", lambda distance, scale: -distance / (1 + distance))]


def families():
    return [
        Family(
            name="lean",
            quantity=Quantity("lean", ("x", "pitch"), "m, rad", "place and pitch"),
            targets=(Box((1.0, 0.2), (4.0, 0.6)), Box((-4.0, 0.2), (-1.0, 0.6))),
            floor=0.5,
            tolerance=0.3,
            law="saturating",
            directions=(Direction("front", (2.0, 0.4)), Direction("back", (-2.0, 0.4))),
        ),
        Family("hurry", Quantity("hurry", ("vx",), "m/s", "speed"), (Box((0.5,), (1.0,)),), 0.5, 0.25, "saturating"),
    ]
"""
BOX = """
<mujoco>
  <option timestep="0.01"/>
  <default><motor ctrllimited="true" ctrlrange="-1 1" gear="20"/></default>
  <worldbody>
    <geom type="plane" size="50 9 1"/>
    <body name="trunk" pos="0 0 0.4">
      <freejoint/>
      <geom type="box" size="0.3 0.1 0.1"/>
      <body name="front" pos="0.25 0 0">
        <joint name="shoulder" axis="0 1 0" damping="1"/>
        <geom type="capsule" fromto="0 0 0 0 0 -0.3" size="0.04"/>
      </body>
      <body name="back" pos="-0.25 0 0">
        <joint name="hip" axis="0 1 0" damping="1"/>
        <geom type="capsule" fromto="0 0 0 0 0 -0.3" size="0.04"/>
      </body>
    </body>
  </worldbody>
  <actuator><motor name="front" joint="shoulder"/><motor name="back" joint="hip"/></actuator>
</mujoco>
"""
ROBOT = """
mjcf = "box.xml"
frame_skip = 5

[root]
body = "trunk"

[fall]
max_pitch = 1.5

[reach]
lean = [[-2.0, 2.0], [-0.5, 0.5]]
hurry = [-0.5, 1.0]
"""
SAC = "--sac.hidden 8 8 --sac.batch-size 8"
MODULE = f"""
    train inference goal-velocity --toy full --inference.fields x vx pitch --inference.scales 4 1 1
    --inference.latent 6 --inference.kinds 2 --policy-fields vx pitch_rate --policy-scales 1 1
    --episodes 8 --decisions 24 --groups 2 --wander-iterations 1 --joint-iterations 1 --policy-iterations 0
    --inference-updates 2 --policy-updates 2 --inference.units 8 --inference.window 4 --inference.batch-size 4
    --inference.decoded 2 {SAC} --sac.projections 2 --prior gaussian --held-out 8 --held-out-at-end 8 --held-out-s 6
"""
TRACKER = f"--robots 4 --steps 4 --updates 2 --iterations 2 --replay 60 {SAC} --held-out 4 --held-out-s 3"
CLASSIFIER = "--episodes 4 --decisions 30 --held-out 6 --iterations 1 --updates 2 --batch-size 8 --hidden 4"
TASKS = [
    {"family": "lean", "target": [1.5, 0.4]},
    {"family": "hurry", "target": 0.8, "switch": {"at_s": 1.0, "family": "lean", "target": [-1.5, 0.4]}},
]


@pytest.fixture(scope="module")
def world(tmp_path_factory):
    """Folder of all that is the user's own."""
    folder = tmp_path_factory.mktemp("world")
    for name, text in (("families.py", FAMILIES), ("box.xml", BOX), ("box.toml", ROBOT)):
        (folder / name).write_text(text)
    (folder / "tasks.json").write_text(json.dumps(TASKS))
    return folder


@pytest.fixture(scope="module")
def trained(world):
    """The same folder, with a module, a tracker and a classifier that learned next to nothing."""
    own = ["--families", str(world / "families.py")]
    for arguments, name in (
        (MODULE.split(), "module"),
        (["train", "tracker", str(world / "box.toml"), *TRACKER.split()], "tracker"),
        (["train", "classifier", "--inference", str(world / "module"), *CLASSIFIER.split()], "classifier"),
    ):
        assert run([*arguments, *own, "--out", str(world / name)]) == 0
    return world


def options(world, **more):
    """Of a trial of the user's own parts."""
    parts = {name: str(world / folder) for name, folder in PARTS.items()}
    return TrialOptions(**parts, families=world / "families.py", seconds=3.0, **more)


PARTS = {"robot": "box.toml", "inference": "module", "tracker": "tracker", "classifier": "classifier"}


def flags(world):
    parts = [text for name, folder in PARTS.items() for text in (f"--{name}", str(world / folder))]
    return [*parts, "--families", str(world / "families.py"), "--seconds", "3"]


def test_what_was_trained_knows_the_families(trained):
    module, tracker = load_inference(str(trained / "module")), load_tracker(str(trained / "tracker"))
    assert module.contract.families.names == tracker.tracker.families.names == ("lean", "hurry")
    assert tracker.tracker.families.named("lean").range.high == (2.0, 0.5)
    assert module.contract.families.named("lean").law == "saturating"
    assert "lean median" in (trained / "module" / "card.md").read_text()


@pytest.mark.parametrize("agent", ["reuse", "oracle"])
def test_agents_are_judged_on_its_tasks(trained, agent, tmp_path, capsys):
    out = tmp_path / "out.json"
    arguments = ["evaluate", "--agent", agent, "--tasks", str(trained / "tasks.json"), "--json", str(out)]
    assert run([*arguments, *flags(trained)]) == 0
    assert "lean" in capsys.readouterr().out
    results = read_results(out)
    first, second = results.episodes
    assert (first.family, first.target) == ("lean", [1.5, 0.4])
    x, pitch = np.array(first.quantities["lean"]).T
    apart = np.hypot(x - 1.5, (pitch - 0.4 + np.pi) % (2 * np.pi) - np.pi)
    np.testing.assert_allclose(first.reward, -apart / (1 + apart), atol=1e-4)
    assert second.active_target[-1] == [-1.5, 0.4]
    if agent == "oracle":
        assert first.subgoal[-1] == pytest.approx([1.5, 0.4])


def test_a_log_is_listened_to_and_all_is_reported(trained, tmp_path):
    log, page = tmp_path / "log.csv", tmp_path / "report.html"
    with log.open("w", newline="") as file:
        rows = [[0.1 * i, 0.1 * i, 1.0, 0.0, -0.5] for i in range(40)]
        csv.writer(file).writerows([["time_s", "position_m", "velocity_m_s", "pitch_rad", "reward"], *rows])
    own = ["--families", str(trained / "families.py")]
    heard = tmp_path / "heard"
    assert run(["infer", str(log), "--inference", str(trained / "module"), "--out", str(heard), *own]) == 0
    assert (heard / "belief.png").exists()
    results = tmp_path / "out.json"
    assert run(["evaluate", "--tasks", str(trained / "tasks.json"), "--json", str(results), *flags(trained)]) == 0
    assert run(["report", str(results), str(trained / "module"), "--out", str(page)]) == 0
    assert "lean" in page.read_text()


def test_one_episode_is_drawn_and_filmed(trained, tmp_path):
    figure, task = tmp_path / "episode.png", ["--task", "lean=1.5,0.4"]
    assert run(["run", *task, "--figure", str(figure), *flags(trained)]) == 0
    assert figure.stat().st_size > 10_000


def test_the_live_page_shows_it(trained):
    trial = options(trained).load()
    session = Session(trial, parse_task("lean=1.5,0.4", trial.in_play))
    for _ in range(8):
        session.step()
    moment = session.moments[-1]
    assert len(moment.reached["lean"]) == 2
    assert np.isfinite(moment.reading.target).all()


@pytest.mark.parametrize(
    "command",
    [
        "run --inference module --robot point-mass --task lean=1.5,0.4 --seconds 3",
        "stress --robot box.toml --tracker tracker --episodes 2",
        f"train step-predictor --robot box.toml --tracker tracker --robots 2 --steps 20 {SAC} "
        "--updates 1 --iterations 1 --replay 60 --held-out 2 --held-out-s 2 --out predictor",
    ],
    ids=lambda command: command.split(" -")[0],
)
def test_without_its_file_a_law_is_refused(command, trained, monkeypatch, capsys):
    """Artifacts carry no code."""
    monkeypatch.chdir(trained)
    monkeypatch.delitem(LAWS, "saturating")
    assert run(command.split()) == 2
    assert "name the file that defines it, --families FILE" in capsys.readouterr().err
    assert run([*command.split(), "--families=families.py"]) == 0


def test_results_of_a_law_are_shown_with_its_file(trained, tmp_path, monkeypatch, capsys):
    results, page = tmp_path / "out.json", ["--out", str(tmp_path / "report.html")]
    assert run(["evaluate", "--tasks", str(trained / "tasks.json"), "--json", str(results), *flags(trained)]) == 0
    monkeypatch.delitem(LAWS, "saturating")
    assert run(["report", str(results), *page]) == 2
    assert "name the file that defines it, --families FILE" in capsys.readouterr().err
    assert run(["report", str(results), *page, "--families", str(trained / "families.py")]) == 0
