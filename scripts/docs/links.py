"""Links that hold in the repository, made to hold on the site.

[changelog](../CHANGELOG.md)                                a page of the site
[`Encoder.step`](../src/rebody/inference/encoder.py)        the API reference of what is named
[`rebody.inference`](../src/rebody/inference)               that package's page
[believing.py](../examples/believing.py)                    alone on a line: the script itself
"""

import posixpath
import re
from pathlib import Path

from reference import BESIDE, EXAMPLES

PAGES = BESIDE | {path: path for path in EXAMPLES} | {"README.md": "index.md"}
"""Where on the site things outside docs/ are."""
LINK = re.compile(r"\[(?P<text>[^\]]*)\]\((?P<path>[^)#:\s]+)(?P<anchor>#[^)\s]*)?\)")
SCRIPT = re.compile(r"^\[[^\]]*\]\(\.\./(examples/\S+\.py)\)$", re.MULTILINE)


def on_page_markdown(markdown, page, config, **_):
    """Hook of MkDocs: rewrite a page's links; it lies where its source lies in the repository."""
    source = next((path for path, uri in BESIDE.items() if uri == page.file.src_uri), f"docs/{page.file.src_uri}")
    root = Path(config.config_file_path).parent
    markdown = SCRIPT.sub(lambda script: _shown(root, script[1]), markdown)
    return LINK.sub(lambda link: _on_site(link, posixpath.dirname(source)), markdown)


def symbol(text: str, path: str) -> str:
    """What a link to code names: a thing in the module of that path, or the module itself by its full name."""
    name = text.strip("`")
    return name if name.startswith("rebody.") else f"{path[len('src/') : -len('.py')].replace('/', '.')}.{name}"


def _on_site(link: re.Match, folder: str) -> str:
    text, anchor = link["text"], link["anchor"] or ""
    path = posixpath.normpath(posixpath.join(folder, link["path"]))
    if path.startswith("src/rebody/"):
        return f"[{text}][{symbol(text, path)}]"
    if path.startswith("docs/"):
        return f"[{text}]({path.removeprefix('docs/')}{anchor})"
    return f"[{text}]({PAGES[path]}{anchor})" if path in PAGES else link[0]  # what leads nowhere MkDocs complains of


def _shown(root: Path, path: str) -> str:
    return f'```python title="{path}"\n{(root / path).read_text()}```'
