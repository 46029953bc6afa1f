"""Pages made at build time, so that they cannot go stale: commands, the Python API, and what lies beside docs/."""

import io
import os
import re
from collections.abc import Iterator
from contextlib import redirect_stdout, suppress
from pathlib import Path
from unittest.mock import patch

from mkdocs.structure.files import File

from rebody.cli.main import parse

BESIDE = {
    "CHANGELOG.md": "changelog.md",
    "CONTRIBUTING.md": "contributing.md",
    "README.md": "index.md",
    "benchmarks/README.md": "benchmarks.md",
}
"""Pages of the repository outside docs/, and where they are on the site."""
MIXTURE = "src/rebody/inference/mixture"
NAMES = ("agents", "inference", "control", "bodies", "tasks", "envs", "training", "evaluation", "store")
PACKAGES = {f"src/rebody/{name}": f"api/{name}.md" for name in NAMES} | {MIXTURE: "api/mixture.md"}
"""Public packages, and the page of each."""
SUBCOMMAND = re.compile(r"• ([\w-]+)")
"""How a help lists them."""
COLUMNS = "84"


def on_files(files, config):
    """Hook of MkDocs: add the pages that docs/ does not have."""
    root = Path(config.config_file_path).parent
    for path, uri in BESIDE.items():
        if uri not in files.src_uris:
            files.append(File.generated(config, uri, content=(root / path).read_text()))
    for package, uri in PACKAGES.items():
        files.append(File.generated(config, uri, content=_api(root, package)))
    return files


def on_page_markdown(markdown, page, **_):
    """Hook of MkDocs: the page of commands gets the help of each."""
    if page.file.src_uri != "commands.md":
        return markdown
    return markdown + "".join(f"\n## {name}\n\n```text\n{text}```\n" for name, text in helps())


def helps(command: tuple[str, ...] = ()) -> Iterator[tuple[str, str]]:
    """A command and its `--help`, then its subcommands and theirs."""
    with redirect_stdout(io.StringIO()) as printed, suppress(SystemExit), patch.dict(os.environ, COLUMNS=COLUMNS):
        parse([*command, "--help"])
    text = printed.getvalue()
    yield " ".join(("rebody", *command)), text
    for name in SUBCOMMAND.findall(text):
        yield from helps((*command, name))


def _api(root: Path, package: str) -> str:
    modules = sorted((root / package).rglob("*.py"))
    if package != MIXTURE:
        modules = [path for path in modules if not path.is_relative_to(root / MIXTURE)]
    return f"# {_dotted(root, root / package)}\n" + "".join(_entry(root, path) for path in modules)


def _entry(root: Path, path: Path) -> str:
    if path.name != "__init__.py":
        return f"\n::: {_dotted(root, path)}\n"
    # what a package offers is shown where it is defined
    return f"\n::: {_dotted(root, path.parent)}\n    options:\n      members: false\n"


def _dotted(root: Path, path: Path) -> str:
    return ".".join(path.relative_to(root / "src").with_suffix("").parts)
