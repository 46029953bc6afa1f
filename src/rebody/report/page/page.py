"""The page put together."""

import base64
import mimetypes
from collections.abc import Sequence
from datetime import datetime
from functools import partial
from pathlib import Path
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined
from markdown_it import MarkdownIt
from markupsafe import Markup

from rebody.evaluation.diagnosis import diagnoses_among, diagnosis_tables
from rebody.evaluation.results import Results
from rebody.evaluation.tables import summary_table
from rebody.report.diagnosis import plot_diagnosis
from rebody.report.page.curves import learning_curves
from rebody.report.page.drawing import COLOURS, inline
from rebody.report.page.evaluations import KIND, errors_of, figures_of, legend, settings_of
from rebody.report.page.find import Found
from rebody.report.page.tables import episodes_table, from_terminal
from rebody.store.files import DATA, read_file, written_whole
from rebody.training.card import command_line, versions

CARD_HEADINGS_FROM = 3
"""The level on the page that a card's largest heading gets."""


def write_page(found: Sequence[Found], path: Path) -> None:
    """Write one HTML file that holds everything, whole or not at all."""
    page = _environment().get_template("page.html.jinja").render(
        found=found,
        compared=_compared(found),
        command=command_line(),
        versions=versions(),
        made=datetime.now().astimezone().strftime("%Y-%m-%d %H:%M %Z"),
    )  # fmt: skip
    with written_whole(path) as unfinished:
        unfinished.write_text(page, encoding="utf-8", errors="replace")  # names of files may hold any bytes


def _environment() -> Environment:
    environment = Environment(
        loader=PackageLoader("rebody.report.page"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= {"readable": readable, "card": card_to_html, "data_uri": data_uri}
    environment.globals |= {
        "curves": learning_curves,
        "settings_of": settings_of,
        "summary": lambda results: from_terminal(summary_table([results]), ["", "value"]),
        "summaries": lambda compared: from_terminal(summary_table(list(compared.values())), ["", *compared]),
        "figures_of": figures_of,
        "kind": KIND,
        "legend": legend,
        "colours": COLOURS,
        "errors_of": errors_of,
        "episodes_of": episodes_table,
        "diagnoses": lambda compared: diagnoses_among(compared.values()),
        "diagnosis_tables": lambda diagnosis: [from_terminal(table) for table in diagnosis_tables(diagnosis)],
        "diagnosis_figure": lambda diagnosis: inline(partial(plot_diagnosis, diagnosis)),
    }
    return environment


def _compared(found: Sequence[Found]) -> dict[str, Results]:
    """All results of the page, under names that tell them apart."""
    return {
        f"{results.robot}, {results.agent}: {path}": results for each in found for path, results in each.results.items()
    }


def readable(value: Any) -> str:
    """A setting as one would write it."""
    if value is None:
        return "none"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:g}"
    if isinstance(value, list | tuple):
        return ", ".join(f"[{readable(each)}]" if isinstance(each, list | tuple) else readable(each) for each in value)
    return str(value)


def card_to_html(card: str) -> Markup:
    """Markdown as HTML, without pictures and HTML of its own: a page asks nobody for anything."""
    markdown = MarkdownIt("commonmark", {"html": False}).enable("table").disable("image")
    tokens = markdown.parse(card)
    for token in tokens:
        if token.type in ("heading_open", "heading_close"):
            token.tag = f"h{min(6, int(token.tag[1]) + CARD_HEADINGS_FROM - 1)}"
    return Markup(markdown.renderer.render(tokens, markdown.options, {}))


def data_uri(path: Path) -> str:
    """A file's content in place of its address."""
    kind, _ = mimetypes.guess_type(path.name)
    return f"data:{kind};base64,{base64.b64encode(read_file(path, DATA)).decode()}"
