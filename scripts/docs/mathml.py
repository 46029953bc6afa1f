"""Equations as MathML, which browsers draw by themselves: `$$...$$` in a page, as the repository's own view reads it."""

import html
import re

from latex2mathml.converter import convert

FORMULA = re.compile(r'<(span|div) class="arithmatex">\\[(\[](.*?)\\[)\]]</\1>', re.DOTALL)


def on_page_content(page_html, **_):
    """Hook of MkDocs: what arithmatex marked as LaTeX is written out."""
    return FORMULA.sub(_mathml, page_html)


def _mathml(formula):
    display = "block" if formula[1] == "div" else "inline"
    return convert(html.unescape(formula[2]), display=display)
