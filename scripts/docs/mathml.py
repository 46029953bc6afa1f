"""Equations as MathML, which browsers draw by themselves; in a page `$$...$$`, which repositories show, too."""

import html
import re

from latex2mathml.converter import convert
from mkdocs.exceptions import PluginError

FORMULA = re.compile(r'<(span|div) class="arithmatex">\\[(\[](.*?)\\[)\]]</\1>', re.DOTALL)
NOT_UNDERSTOOD = re.compile(r"<m\w+>(\\\w+|&)</")
"""What the converter does not know it hands on as it stands."""


def on_page_content(page_html, page, **_):
    """Hook of MkDocs: what arithmatex marked as LaTeX is written out."""
    try:
        return FORMULA.sub(lambda formula: mathml(html.unescape(formula[2]), formula[1] == "div"), page_html)
    except ValueError as error:
        raise PluginError(f"{page.file.src_uri}: {error}") from error


def mathml(latex: str, is_block: bool) -> str:
    """A formula as MathML; ValueError where it holds what cannot be converted."""
    converted = convert(latex, display="block" if is_block else "inline")
    if unknown := NOT_UNDERSTOOD.search(converted):
        raise ValueError(f"'{unknown[1]}' cannot be shown in {latex.strip()}")
    return converted
