"""Whatever output, home and machine a command meets: it works, or says in one line what to do."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from rebody import names
from rebody.cli.main import run

REBODY = Path(sys.executable).with_name("rebody")


def rebody(*arguments: str, **options) -> subprocess.CompletedProcess:
    environment = os.environ | options.pop("env", {})
    return subprocess.run([REBODY, *arguments], env=environment, stderr=subprocess.PIPE, timeout=60, **options)


@pytest.mark.parametrize("argument", ["--help", "list"])
def test_output_that_nobody_reads_ends_quietly(argument):
    read, write = os.pipe()
    os.close(read)
    try:
        done = rebody(argument, stdout=write)
    finally:
        os.close(write)
    assert (done.returncode, done.stderr) == (1, b"")


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="this system has no /dev/full")
@pytest.mark.parametrize("argument", ["--help", "list"])
def test_a_full_disk_is_one_message(argument):
    with open("/dev/full", "w") as full:
        done = rebody(argument, stdout=full)
    assert (done.returncode, done.stderr) == (2, b"error: No space left on device\n")


def test_a_closed_output():
    done = subprocess.run(f"'{REBODY}' --help >&- 2>&-", shell=True, timeout=60)
    assert done.returncode == 0


@pytest.mark.parametrize(
    "environment", [{"PYTHONIOENCODING": "ascii"}, {"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"}]
)
def test_a_terminal_that_knows_ascii_alone(environment):
    done = rebody("--help", stdout=subprocess.PIPE, env=environment)
    assert (done.returncode, done.stderr) == (0, b"")
    assert done.stdout.isascii()
    assert b"stress" in done.stdout
    done = rebody("grüße-→", stdout=subprocess.PIPE, env=environment)
    assert done.returncode == 2
    assert b"Unrecognized options: gr" in done.stderr


def test_a_list_in_a_pipe_has_whole_lines(capsys):
    assert run(["list"]) == 0
    lines = [" ".join(line.split()) for line in capsys.readouterr().out.splitlines()]
    assert "artifact high-level-goal-velocity-noise-0-cheetah High-level policy: cheetah" in lines
    assert {f"agent {name} {line}" for name, line in names.AGENTS.items()} <= set(lines)


def test_a_list_on_a_narrow_terminal_cuts_nothing(capsys, monkeypatch):
    monkeypatch.setenv("FORCE_COLOR", "1")
    monkeypatch.setenv("COLUMNS", "44")
    assert run(["list"]) == 0
    printed = capsys.readouterr().out
    assert max(map(len, printed.splitlines())) <= 44
    assert "…" not in printed
    column = "".join(line[14:28].strip() for line in printed.splitlines())
    assert "high-level-goal-velocity-noise-0-cheetah" in column


def test_a_user_without_a_home(monkeypatch, capsys):
    def home() -> Path:
        raise RuntimeError("Could not determine home directory.")

    monkeypatch.setattr(Path, "home", home)
    for name in ("XDG_CACHE_HOME", "JAX_COMPILATION_CACHE_DIR"):
        monkeypatch.delenv(name, raising=False)
    assert run(["list"]) == 0
    assert "JAX_COMPILATION_CACHE_DIR" not in os.environ


@pytest.mark.parametrize(
    ("environment", "arguments", "says"),
    [
        ({"MUJOCO_GL": "typo"}, ["robot", "check", "cheetah"], b"error: MUJOCO_GL=typo does not work here"),
        (
            {"JAX_PLATFORMS": "typo"},
            ["stress", "--episodes", "1"],
            b"error: JAX_PLATFORMS=typo: JAX has no such device",
        ),
    ],
)
def test_a_setting_that_does_not_fit_the_machine_is_one_message(environment, arguments, says):
    done = rebody(*arguments, stdout=subprocess.DEVNULL, env=environment)
    assert done.returncode == 2
    assert done.stderr.startswith(says)
    assert done.stderr.count(b"\n") == 1
