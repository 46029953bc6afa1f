"""The page: it holds what was given, and asks nobody for anything."""

import base64
import os
import re
from html.parser import HTMLParser

import numpy as np
import pytest

from rebody.errors import RebodyError
from rebody.evaluation.diagnosis import IDLE, LADDER
from rebody.report.page import find, write_page
from rebody.report.page.page import readable
from rebody.store import save_artifact, save_checkpoint

ADDRESSES = ("src", "href", "xlink:href", "poster", "action")


class Page(HTMLParser):
    """Words, ids and addresses; the words of each table, row by row."""

    def __init__(self, text):
        super().__init__()
        self.words, self.ids, self.addresses, self.tags, self.tables = [], [], [], [], []
        self._cell = None
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        self.tags.append(tag)
        self.ids += [value for name, value in attrs if name == "id"]
        self.addresses += [(tag, value) for name, value in attrs if name in ADDRESSES]
        if tag == "table":
            self.tables.append([])
        if tag == "tr":
            self.tables[-1].append([])
        if tag in ("td", "th"):
            self._cell = ""

    def handle_endtag(self, tag):
        if tag in ("td", "th"):
            self.tables[-1][-1].append(self._cell)
            self._cell = None

    def handle_data(self, data):
        self.words.append(data.strip())
        if self._cell is not None:
            self._cell += data

    @property
    def text(self):
        return " ".join(word for word in self.words if word)


@pytest.fixture(scope="module")
def page(written):
    return Page(written.text)


def test_the_contents_lead_to_what_is_there(page):
    assert len(page.ids) == len(set(page.ids))
    inside = {address[1:] for _, address in page.addresses if address.startswith("#")}
    assert inside <= set(page.ids)
    assert {"compared", "diagnosis", "run-1-card", "run-1-curves", "run-2-results-4", "run-2-videos"} <= inside


def test_nothing_comes_from_elsewhere(page, written):
    asked_for = [address for tag, address in page.addresses if tag != "a"]  # what is clicked may lead elsewhere
    assert len(asked_for) > 3
    assert all(address.startswith(("#", "data:")) for address in asked_for)
    assert "script" not in page.tags
    assert not re.search(r"@import|url\((?!#)", written.text)


AGENTS = sorted([*LADDER, IDLE])


def test_pictures_and_films_are_inside(page, written):
    for name, kind in (("episode.png", "image/png"), ("episode.mp4", "video/mp4")):
        content = base64.b64encode((written.demo / name).read_bytes()).decode()
        assert f"data:{kind};base64,{content}" in [address for _, address in page.addresses]


def test_tables_have_the_numbers_with_their_intervals(page, written):
    by_agent = {agent: results.summary["families"]["goal"] for agent, results in written.results.items()}
    side_by_side = page.tables[0]
    assert [cell.partition(":")[0] for cell in side_by_side[0][1:]] == [f"cheetah, {agent}" for agent in AGENTS]
    row = next(row for row in side_by_side if row[0] == "goal: median error [m]")
    for agent, cell in zip(AGENTS, row[1:], strict=True):
        value, low, high = (by_agent[agent]["median_error"][end] for end in ("value", "low", "high"))
        assert cell == f"{value:.3f} [{low:.3f}, {high:.3f}]"


def test_every_episode_has_its_row(page, written):
    episodes = [table for table in page.tables if table[0][0] == "hidden task"]
    assert [len(table) for table in episodes] == [1 + 2] * len(AGENTS)
    reuse = episodes[AGENTS.index("reuse")]
    assert [row[0] for row in reuse[1:]] == ["goal +2.5", "goal -1, from 1 s goal +1.5"]
    assert [row[3] for row in reuse[1:]] == [f"{e.final_error:.3f} m" for e in written.results["reuse"].episodes]


def test_the_ladder_is_there_since_all_its_agents_are(page):
    assert all(what in page.text for what in LADDER.values())
    assert "return that it costs" in page.text


def test_the_card_is_rendered_and_harmless(page, written):
    assert "<h3>Tracker: tiny</h3>" in written.text
    assert "<code>goals</code> &amp; &lt;b&gt;speeds&lt;/b&gt;" in written.text
    assert ["goal median", "0.125 m"] in [row for table in page.tables for row in table]


def test_settings_can_be_read(page):
    for words in ("learning_rate 0.0003", "hidden 8, 8", "pitch none", "pushed yes", "speed -3, 3", "horizon 5"):
        assert words in page.text


def test_curves_have_titles_axes_and_letters(page):
    for words in ("final error: goal", "error [m]", "95th percentile", "critics", "iteration", "novelty"):
        assert words in page.text
    assert "actor_loss" not in page.text


def test_what_is_not_shown_is_named(page):
    assert "Holds no results, so not shown: tasks.json" in page.text


def test_colours_are_those_of_the_page(written):
    assert "var(--motion)" in written.text
    assert "#2b6f9e" not in written.text[written.text.index("</style>") :]


def test_command_and_versions(page):
    assert "rebody 0.1.0" in page.text
    assert "pytest" in page.text  # what runs now


def test_a_run_that_is_not_finished(tmp_path):
    meta = {"settings": {"units": 8}, "wall_s": 1.0, "history": [{"kl": 3.0}, {"kl": 2.0, "evaluation/return": -7.0}]}
    save_checkpoint(tmp_path / "run" / "checkpoint", {"w": np.zeros(2)}, meta)
    found = find(str(tmp_path / "run"))
    assert found.training is not None
    np.testing.assert_array_equal(found.training.log["evaluation/return"], [np.nan, -7.0])
    write_page([found], tmp_path / "report.html")
    page = Page((tmp_path / "report.html").read_text())
    for words in ("not finished, 2 iterations", "units 8", "KL divergence", "return of an episode"):
        assert words in page.text
    assert "Side by side" not in page.text


def test_an_artifact_that_measured_nothing(tmp_path):
    save_artifact(tmp_path / "a", kind="other", config={}, weights={"w": np.ones(1)}, card="# Nothing", log="")
    write_page([find(str(tmp_path / "a"))], tmp_path / "report.html")
    assert "other, 0 iterations" in (tmp_path / "report.html").read_text()


def test_long_names_fit(written, tmp_path):
    names = [f"{'very ' * 20}long, the ${i}$th <one>.json" for i in range(3)]
    for name in names:
        (tmp_path / name).write_bytes((written.demo / "reuse.json").read_bytes())
    write_page([find(str(tmp_path))], tmp_path / "report.html")
    text = Page((tmp_path / "report.html").read_text()).text
    assert all(name in text for name in names)


@pytest.mark.parametrize("make", [lambda path: path.mkdir(), lambda path: path.write_text("{}"), lambda path: None])
def test_what_is_no_run_is_refused(make, tmp_path):
    make(tmp_path / "thing")
    with pytest.raises(RebodyError, match="rebody evaluate --json"):
        find(str(tmp_path / "thing"))


@pytest.mark.parametrize("name", ["figure.png", "film.mp4", "results.json"])
def test_links_that_leave_the_folder_are_refused(name, written, tmp_path):
    (tmp_path / "secret").write_text("not for this page")
    folder = tmp_path / "folder"
    folder.mkdir()
    (folder / "reuse.json").write_bytes((written.demo / "reuse.json").read_bytes())
    (folder / name).symlink_to(tmp_path / "secret")
    with pytest.raises(RebodyError, match=f"{name} is a link that leaves {folder}"):
        find(str(folder))


def test_pipes_are_refused_and_in_a_folder_not_looked_at(written, tmp_path):
    os.mkfifo(tmp_path / "results.json")
    with pytest.raises(RebodyError, match="is a pipe"):
        find(str(tmp_path / "results.json"))
    (tmp_path / "reuse.json").write_bytes((written.demo / "reuse.json").read_bytes())
    assert list(find(str(tmp_path)).results) == [tmp_path / "reuse.json"]


def test_a_damaged_artifact_is_refused(artifact, tmp_path):
    for name in ("weights.safetensors", "card.md"):
        (tmp_path / name).write_bytes((artifact / name).read_bytes())
    with pytest.raises(RebodyError, match=r"manifest\.json is missing"):
        find(str(tmp_path))


@pytest.mark.parametrize(
    ("value", "text"),
    [(None, "none"), (True, "yes"), (0.00030, "0.0003"), (3, "3"), ([1.0, [2, 3]], "1, [2, 3]"), ("x", "x")],
)
def test_settings_are_written_as_one_would(value, text):
    assert readable(value) == text
