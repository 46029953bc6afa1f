"""The page in a real browser: no error, no request, and it fits its window."""

import shutil

import pytest
from playwright.sync_api import sync_playwright

CHROMIUM = shutil.which("chromium")
pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="Chromium is not installed")


@pytest.fixture(scope="module")
def browser():
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])  # root may not have one
        yield browser
        browser.close()


@pytest.mark.parametrize(("width", "scheme"), [(1366, "light"), (390, "dark")])
def test_it_opens_without_a_network(browser, written, width, scheme):
    told, asked = [], []
    with browser.new_page(viewport={"width": width, "height": 800}, color_scheme=scheme) as page:
        page.on("console", lambda message: told.append(message.text))
        page.on("pageerror", lambda error: told.append(str(error)))
        page.on("request", lambda request: asked.append(request.url))
        page.goto(written.path.as_uri())
        page.wait_for_function("document.querySelector('video').readyState >= 2")
        assert told == []
        assert [url for url in asked if not url.startswith("data:")] == [written.path.as_uri()]
        assert page.evaluate("document.documentElement.scrollWidth") <= width
        assert page.evaluate("document.querySelector('img').naturalWidth") > 300
        ink = page.evaluate("getComputedStyle(document.querySelector('figure svg text')).fill")
        assert ink == {"light": "rgb(34, 34, 34)", "dark": "rgb(228, 230, 234)"}[scheme]
