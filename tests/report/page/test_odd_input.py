"""Whatever is in a user's log, checkpoint, card or folder: a page, with a note on what cannot be shown."""

import json

import numpy as np
import pytest

from rebody.report.page import find, write_page
from rebody.report.page import log as log_file
from rebody.report.page.curves import learning_curves
from rebody.store import save_artifact, save_checkpoint

COUNTED = "The log has no column `iteration`: its rows are counted."
NAMES = [
    r"$\frac{$", "$x^2$", "_hidden", "", " ", "^_{", "<b>bold</b>&", 'a "quoted" one', "50 % $ and $", "中文 ü 🤖",
    "x" * 5000, "two\nlines\tand\x00nothing", r"back\slash\$", "critics", "$$", "[red]",
]  # fmt: skip


def curves_of(text):
    log, notes = log_file.read_csv(text)
    return learning_curves(log), notes


def page_of(tmp_path, **artifact):
    plain = {"kind": "other", "config": {}, "weights": {"w": np.ones(1)}, "card": "# Card", "log": ""}
    save_artifact(tmp_path / "run", **plain | artifact)
    write_page([find(str(tmp_path / "run"))], tmp_path / "report.html")
    return (tmp_path / "report.html").read_text(encoding="utf-8")


@pytest.mark.parametrize("name", NAMES)
def test_a_column_may_have_any_name(name):
    quoted = '"' + name.replace('"', '""') + '"'
    drawn, notes = curves_of(f"iteration,critic_loss,{quoted}\n1,1.0,2.0\n2,1.5,3.0\n")
    assert list(drawn) == ["critics", f"column {name}"]
    assert notes == []


def test_the_name_of_a_column_is_shown_as_it_is(tmp_path):
    text = page_of(tmp_path, log="iteration,$\\frac{$,<b>x</b>,$x$\n1,1,1,1\n2,2,2,2\n")
    for shown in (r">$\frac{$</text>", "&lt;b&gt;x&lt;/b&gt;</text>", ">$x$</text>", 'title="column $x$"'):
        assert shown in text
    assert "<b>x" not in text


@pytest.mark.parametrize(
    ("log", "expected", "notes"),
    [
        ("kl,novelty\n1,2\n2,3\n", ["belief against prior", "column novelty"], [COUNTED]),
        ("\ufeffiteration,kl\n1,2\n", ["belief against prior"], []),
        ("iteration,kl\n1,\n2,\n", [], []),
        ("iteration,kl\n", [], []),
        ("iteration\n1\n2\n", [], []),
        ("", [], []),
        ("\n\n", [], []),
        ("iteration,kl\n1,2\n\n2\n3,4,5,6\n", ["belief against prior"], []),
        (
            "iteration,kl,x\n1,inf,abc\n2,-1e200,0x1f\n3,2,5\n",
            ["belief against prior", "column x"],
            ["Cells that are no number that can be drawn, and are left out: kl (2), x (2)."],
        ),
        (
            "iteration,kl,kl,x,x\n1,2,3,4,5\n",
            ["belief against prior", "column x"],
            ["Columns that the log has more than once, the last of which is shown: kl, x."],
        ),
        *(
            (
                f"iteration,kl\n{first},1\n{second},2\n",
                ["belief against prior"],
                ["The log's column `iteration` does not ascend: its rows are counted."],
            )
            for first, second in ((1, 1), (2, 1), ("", 2), ("nan", ""))
        ),
        ("iteration,kl\n-5,1\n-3,2\n", ["belief against prior"], []),
        ("iteration,kl\n0,1\n", ["belief against prior"], []),
        ("iteration,kl\n1,-1\n2,0\n3,1e-320\n", [], []),
        ("iteration,kl,x\n1,1e99,1e99\n2,1e-99,-1e99\n", ["belief against prior", "column x"], []),
        ("iteration,kl,x\n1,5,1e99\n2,5,1e99\n", ["belief against prior", "column x"], []),
        ("iteration,kl\n1,1\n1e90,2\n", ["belief against prior"], []),
    ],
)
def test_a_log_may_hold_anything(log, expected, notes):
    drawn, noted = curves_of(log)
    assert list(drawn) == expected
    assert noted == notes


def test_a_log_that_is_no_table():
    drawn, (note,) = curves_of(f'iteration,kl\n1,"{"x" * 200_000}"\n')
    assert drawn == {}
    assert note.startswith("The log is no CSV table")


def test_notes_are_on_the_page(tmp_path):
    text = page_of(tmp_path, log="<i>a</i>\nb\n")
    assert "Cells that are no number that can be drawn, and are left out: &lt;i&gt;a&lt;/i&gt; (1)." in text
    assert COUNTED in text
    assert "Nothing was measured that can be drawn." in text


@pytest.mark.parametrize(
    ("meta", "words"),
    [
        ({}, ["tells no settings", "tells no measurements", "0 iterations"]),
        ({"settings": None, "history": None}, ["tells no settings", "tells no measurements"]),
        ({"settings": [1], "history": {"kl": [1.0]}}, ["tells no settings", "tells no measurements"]),
        ({"settings": {"a": "1"}, "history": [None, 3, {"kl": 1.0}]}, ["hold no measurements: 2", "1 iterations"]),
        ({"settings": {}, "history": []}, ["0 iterations", "Nothing was measured"]),
        (
            {"settings": {}, "history": [{"kl": "2.5", "x": None, "y": [1]}, {"kl": float("nan"), "y": 10**400}]},
            ["KL divergence", "left out: y (2)"],
        ),
        ({"settings": {}, "history": [{"kl": float("inf"), "iteration": "z"}, {"kl": True}]}, ["left out: kl (1)"]),
    ],
)
def test_a_checkpoint_may_hold_anything(meta, words, tmp_path):
    save_checkpoint(tmp_path / "run" / "checkpoint", {"w": np.zeros(2)}, meta)
    write_page([find(str(tmp_path / "run"))], tmp_path / "report.html")
    text = (tmp_path / "report.html").read_text(encoding="utf-8")
    for word in words:
        assert word in text


@pytest.mark.parametrize("meta", [None, [1, 2], "text", 3.5])
def test_a_checkpoint_may_be_anything(meta):
    settings, log, notes = log_file.read_meta(meta)
    assert (settings, list(log)) == ({}, ["iteration"])
    assert notes == ["The checkpoint tells no settings.", "The checkpoint tells no measurements."]


def test_settings_may_be_anything_that_json_holds(tmp_path):
    odd = {
        "<script>": "<img src=x>",
        "items": None,
        "rows": [{"a": [1, {"b": None}]}, [[]], []],
        "nested": {"values": {}, "deep": {"number": "3", "large": 10**40, "true": True}},
        "long": "y" * 3000,
        "": "",
    }
    text = page_of(tmp_path, config=json.loads(json.dumps(odd)), kind="<odd>", card="<script>alert(1)</script>")
    assert "<script>" not in text
    assert "<img src=x>" not in text
    for shown in ("&lt;script&gt;", "&lt;img src=x&gt;", "&lt;odd&gt;", "y" * 3000):
        assert shown in text


def test_names_of_folders_and_files_may_hold_any_bytes(tmp_path):
    folder = tmp_path / "odd <b>$\\frac{$ \udcff"
    folder.mkdir()
    (folder / "pic\udcfe&.png").write_bytes(b"\x89PNG")
    write_page([find(str(folder))], tmp_path / "report.html")
    text = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert "odd &lt;b&gt;$\\frac{$ ?" in text
    assert "pic?&amp;.png" in text


def _with_latents(*rows):
    return lambda episode: episode.update(latent=[rows[i % len(rows)] for i in range(len(episode["latent"]))])


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (_with_latents([1.0], [1.0, 2.0]), "Latents are empty or of unlike lengths"),
        (_with_latents([]), "Latents are empty or of unlike lengths"),
        (_with_latents([1e300, -1e300]), "goal +2.5"),
        (lambda episode: episode.update(final_error=1e300), "goal +2.5"),
        (lambda episode: episode["quantities"].update(x=[1e300] * len(episode["time_s"])), "goal +2.5"),
        (lambda episode: episode.update(switch={"at_s": "1", "target": None}), "goal +2.5, then goal +2.5"),
        (lambda episode: episode.update(switch={}), "goal +2.5, then goal +2.5"),
    ],
)
def test_results_may_be_odd(change, says, written, tmp_path):
    content = written.results["reuse"].to_json()
    content |= {"robot": r"$\frac{$ <b>[/red]", "inference": "$x^{$", "episodes": content["episodes"][:1]}
    change(content["episodes"][0])
    (tmp_path / "odd.json").write_text(json.dumps(content))
    write_page([find(str(tmp_path))], tmp_path / "report.html")
    text = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert says in text
    assert "&lt;b&gt;[/red]" in text
    assert "<b>" not in text
