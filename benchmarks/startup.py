"""What a command costs before it does anything: seconds and memory beside `python -c "import numpy"`.

    .venv/bin/python benchmarks/startup.py [--repetitions 15]

One after the other, in turns, so that other work on the machine meets all alike; medians. `rebody --help` and
`rebody list` are to take at most 5 times as long as the import: exit code 1 where one takes longer.
"""

import argparse
import os
import subprocess
import sys
import time
from pathlib import Path
from statistics import median

from rich.console import Console
from rich.table import Table

REBODY = str(Path(sys.executable).with_name("rebody"))
COMMANDS = {
    'python -c "import numpy"': [sys.executable, "-c", "import numpy"],
    "rebody --help": [REBODY, "--help"],
    "rebody list": [REBODY, "list"],
    'python -c "import rebody"': [sys.executable, "-c", "import rebody"],
    'python -c "import rebody, gymnasium"': [sys.executable, "-c", "import rebody, gymnasium"],
}
BOUND = 5.0
BOUNDED = ("rebody --help", "rebody list")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--repetitions", type=int, default=15)
    repetitions = parser.parse_args().repetitions
    measured = {name: [] for name in COMMANDS}
    for _ in range(1 + repetitions):
        for name, command in COMMANDS.items():
            measured[name].append(seconds_and_megabytes(command))
    # in the first turn files come from the disk
    seconds = {name: median(taken for taken, _ in each[1:]) for name, each in measured.items()}
    megabytes = {name: median(used for _, used in each[1:]) for name, each in measured.items()}
    reference = next(iter(seconds.values()))
    ratio = {name: taken / reference for name, taken in seconds.items()}
    show(seconds, ratio, megabytes, repetitions)
    sys.exit(any(ratio[name] > BOUND for name in BOUNDED))


def seconds_and_megabytes(command: list[str]) -> tuple[float, float]:
    """Wall time and largest memory of one process."""
    begun = time.perf_counter()
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL)
    _, status, usage = os.wait4(process.pid, 0)
    taken = time.perf_counter() - begun
    if os.waitstatus_to_exitcode(status):
        raise SystemExit(f"{' '.join(command)} failed.")
    return taken, usage.ru_maxrss / 1024


def show(seconds: dict[str, float], ratio: dict[str, float], megabytes: dict[str, float], repetitions: int) -> None:
    table = Table(title=f"medians of {repetitions}", caption=f"at most {BOUND:g} times: {', '.join(BOUNDED)}")
    table.add_column("command")
    for column in ("seconds", "times numpy", "MB"):
        table.add_column(column, justify="right")
    for name in COMMANDS:
        table.add_row(name, f"{seconds[name]:.3f}", f"{ratio[name]:.1f}", f"{megabytes[name]:.0f}")
    Console().print(table)


if __name__ == "__main__":
    main()
