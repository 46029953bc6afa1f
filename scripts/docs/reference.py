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
    "benchmarks/README.md": "benchmarks.md",
}
"""Pages of the repository outside docs/, and where they are on the site."""
EXAMPLES = ("examples/ant/ant.toml", "examples/logs/cheetah.csv", "examples/logs/record.py")
"""Files that the site has as they are."""
API = {
    f"api/{path.removesuffix('.py').replace('/', '.')}.md": f"src/rebody/{path}"
    for path in (
        *("evaluation", "training", "agents", "envs", "standard", "inference", "inference/mixture", "control"),
        *("bodies", "tasks", "store", "nn", "types.py", "errors.py"),
    )
}
"""Pages of the Python API, and the package or module that each shows."""
SUBCOMMAND = re.compile(r"• ([\w-]+)")
"""How a help lists them."""
ALIKE = (("train", "inference"), ("train", "tracker"))
"""Commands whose subcommands differ in their defaults alone: one of them is shown."""
COLUMNS = "84"


def on_files(files, config):
    """Hook of MkDocs: add the pages that docs/ does not have."""
    root = Path(config.config_file_path).parent
    for path, uri in BESIDE.items():
        files.append(File.generated(config, uri, content=(root / path).read_text()))
    for path in EXAMPLES:
        files.append(File(path, str(root), config.site_dir, config.use_directory_urls))
    for uri, path in API.items():
        files.append(File.generated(config, uri, content=_api(root, root / path)))
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
    names = SUBCOMMAND.findall(text)
    for name in names[:1] if command in ALIKE else names:
        yield from helps((*command, name))


def _api(root: Path, shown: Path) -> str:
    """Its modules one after the other, without those of packages that have a page of their own."""
    elsewhere = [root / path for path in API.values() if (root / path).is_relative_to(shown) and root / path != shown]
    modules = sorted(shown.rglob("*.py")) or [shown]
    kept = [path for path in modules if not any(path.is_relative_to(other) for other in elsewhere)]
    return "".join(_entry(root, path, level=1 if path == kept[0] else 2) for path in kept)


def _entry(root: Path, path: Path, level: int) -> str:
    is_package = path.name == "__init__.py"
    name = ".".join((path.parent if is_package else path).relative_to(root / "src").with_suffix("").parts)
    options = f"::: {name}\n    options:\n      heading_level: {level}\n"
    # what a package offers is shown where it is defined
    return options + ("      members: false\n\n" if is_package else "\n")
