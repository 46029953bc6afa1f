"""The table of commands says what the commands themselves say, and imports none that was not asked for."""

import subprocess
import sys

import pytest

from rebody.cli.commands import COMMANDS
from rebody.cli.main import run

HEAVY = "{'jax', 'mujoco', 'matplotlib', 'rebody.training'}"


@pytest.mark.parametrize("command", COMMANDS, ids=lambda command: command.name)
def test_a_command_does_what_its_line_says(command):
    loaded = command.load([])
    assert callable(loaded.run)
    assert loaded.__doc__ == command.line


def test_help_and_list_import_nothing_heavy():
    code = (
        "import sys; from rebody.cli.main import run; run(['list'])\n"
        "try: run(['--help'])\n"
        f"finally: assert not {HEAVY} & sys.modules.keys()"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")
    assert "tracker-cheetah" in done.stdout


def test_help_names_every_command(capsys):
    with pytest.raises(SystemExit, match="0"):
        run(["--help"])
    printed = " ".join(capsys.readouterr().out.replace("│", "").split())
    for command in COMMANDS:
        assert f"• {command.name} {command.line}" in printed


@pytest.mark.parametrize("arguments", [[], ["lst"], ["runn", "--task", "goal=1"]])
def test_a_command_that_there_is_not(arguments, capsys):
    with pytest.raises(SystemExit, match="2"):
        run(arguments)
    assert "demo, run, view" in capsys.readouterr().err


def test_an_option_before_its_command(capsys):
    with pytest.raises(SystemExit, match="2"):
        run(["--robots", "cheetah", "stress"])
    printed = capsys.readouterr().err
    assert "Perhaps you meant" in printed
    assert "in rebody stress --help" in printed
