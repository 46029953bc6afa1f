"""What the docs name and link to is there; the site's build makes what it should."""

import importlib
import pkgutil
import re
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest
from mkdocs.exceptions import PluginError

ROOT = Path(__file__).parents[2]
PAGES = sorted((ROOT / "docs").glob("*.md"))
FENCED = re.compile(r"^```.*?^```", re.DOTALL | re.MULTILINE)
LINK = re.compile(r"\[([^\]]*)\]\(([^)#:\s]+)(?:#[^)]*)?\)")
CODE = "../src/rebody/"


@pytest.fixture(scope="module")
def hook():
    """A function: name -> that hook of the build."""
    with pytest.MonkeyPatch.context() as patched:
        patched.syspath_prepend(ROOT / "scripts" / "docs")
        yield importlib.import_module
    for name in ("links", "mathml", "offline", "reference"):
        sys.modules.pop(name, None)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_links_hold_in_the_repository(page, hook):
    for text, path in LINK.findall(FENCED.sub("", page.read_text())):
        assert (page.parent / path).exists(), path
        if path.startswith(CODE):
            pkgutil.resolve_name(hook("links").symbol(text, path.removeprefix("../")))


def test_the_concepts_name_code():
    assert (ROOT / "docs" / "concepts.md").read_text().count(CODE) > 50


def test_links_lead_to_the_sites_pages(hook):
    def on_site(markdown, page="concepts.md"):
        config = SimpleNamespace(config_file_path=str(ROOT / "mkdocs.yml"))
        page = SimpleNamespace(file=SimpleNamespace(src_uri=page))
        return hook("links").on_page_markdown(markdown, page=page, config=config)

    assert on_site("[`GRU`](../src/rebody/nn/gru.py)") == "[`GRU`][rebody.nn.gru.GRU]"
    assert on_site("[`rebody.nn`](../src/rebody/nn)") == "[`rebody.nn`][rebody.nn]"
    assert on_site("[all](../benchmarks/README.md#x) [one](robots.md)") == "[all](benchmarks.md#x) [one](robots.md)"
    assert on_site("[one](docs/robots.md)", page="changelog.md") == "[one](robots.md)"
    assert "def walk(" in on_site("[it](../examples/believing.py)")


def test_every_command_has_its_help(hook):
    helps = dict(hook("reference").helps())
    assert {"rebody", "rebody demo", "rebody train", "rebody train step-predictor", "rebody list"} <= helps.keys()
    assert all(text.startswith(f"usage: {name}") for name, text in helps.items())
    (tracker,) = [name for name in helps if name.startswith("rebody train tracker ")]  # one stands for all robots
    assert "--push-every-s" in helps[tracker]
    assert "hopper" in helps["rebody train tracker"]


def test_equations(hook):
    mathml = hook("mathml").mathml
    assert "<mfrac>" in mathml(r"\frac{1}{2}", is_block=True)
    with pytest.raises(ValueError, match="'&' cannot be shown"):
        mathml(r"\begin{aligned} a &= b \end{aligned}", is_block=True)
    html = hook("mathml").on_page_content(r'<p>Where <span class="arithmatex">\(j &lt; k\)</span>.</p>', page=None)
    assert "<p>Where <math" in html
    assert "<mi>k</mi>" in html
    assert "arithmatex" not in html


@pytest.mark.parametrize(
    "fetches", ['<script src="https://a.org/x.js">', '<link rel="stylesheet" href="//a.org/x.css">']
)
def test_a_page_that_needs_the_network_is_refused(fetches, hook):
    on_post_page, page = hook("offline").on_post_page, SimpleNamespace(file=SimpleNamespace(src_uri="index.md"))
    own = '<script src="assets/x.js"></script><a href="https://a.org">there</a>'
    assert on_post_page(own, page=page) == own
    with pytest.raises(PluginError, match=r"index\.md fetches from the network"):
        on_post_page(own + fetches, page=page)


def test_the_first_lines_of_python_do_what_they_say(capsys):
    """They are the same in the README and on the page to start from."""
    block = re.search(r"```python\n(.*?)```", (ROOT / "README.md").read_text(), re.DOTALL)[1]
    assert block in (ROOT / "docs" / "index.md").read_text()
    scope = {}
    exec(block.replace("range(400)", "range(60)"), scope)
    family, target = scope["agent"].inferred
    assert family == scope["info"]["family"]
    assert target == pytest.approx(scope["info"]["target"], rel=0.1)
