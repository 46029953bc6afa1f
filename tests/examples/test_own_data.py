"""What docs/own-data.md says can be typed as it stands."""

import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

from rebody.cli.main import run

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "own-data.md").read_text()
BLOCKS = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)
COMMANDS = re.findall(r"^    \.venv/bin/rebody (.*)$", PAGE, re.MULTILINE)


@pytest.mark.parametrize(
    ("block", "said"),
    list(zip(BLOCKS[:2], (r"^goal \([56]\.\d+,\) ", r"^\(16,\) (goal|velocity)$"), strict=True)),
    ids=["live", "environment"],
)
def test_python(block, said, capsys):
    """Twenty decisions say what is asked; after the one of the second block either family is a fair guess."""
    exec(block, {})
    assert re.search(said, capsys.readouterr().out)


def test_processes(tmp_path):
    """A program: those that are spawned read it."""
    _, _, program = BLOCKS
    (tmp_path / "program.py").write_text(program)
    command = [sys.executable, str(tmp_path / "program.py")]
    done = subprocess.run(command, capture_output=True, text=True, check=True, timeout=120)
    assert re.match(r"^\(2, 18\) \['(goal|velocity)' '(goal|velocity)'\]$", done.stdout)


@pytest.mark.parametrize("command", COMMANDS)
def test_commands(command, tmp_path, monkeypatch):
    (tmp_path / "examples").symlink_to(ROOT / "examples")
    monkeypatch.chdir(tmp_path)
    assert run(shlex.split(command)) == 0
    assert (tmp_path / "belief" / "belief.png").is_file()
