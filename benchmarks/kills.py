"""Training runs of every kind, killed at random moments: do they end as if nothing had been?

A tiny run of each trainer is let alone once, and once more it is killed (SIGKILL) again and again: in the middle of a
turn, at a call that touches a file of its folder (a checkpoint, the events, the lock), and while its artifact is saved.
After each kill it goes on with --resume. In the end weights, the whole state and the log must be those of the calm run.
"""

import argparse
import os
import signal
import sys
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

os.environ.setdefault("JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS", "0")  # every life compiles the same

import numpy as np
import safetensors.numpy

import rebody.cli.train  # noqa: F401  every pipeline, before the first life: a life is a fork, and JAX has no thread yet
from rebody.cli.main import run
from rebody.store import load_artifact, tree_hash
from rebody.store.checkpoint import FILE, FOLDER
from rebody.training.run import Run

TURNS = 40
ROBOTS = f"--robots 4 --iterations {TURNS}"
ON_CHEETAH = f"--robot cheetah {ROBOTS}"
SAC = "--sac.hidden 8 8 --sac.batch-size 8"
SHORT = "--held-out 8 --held-out-s 3"
TRAINERS = {
    "inference": f"""position --episodes 8 --decisions 24 --groups 2 --wander-iterations 2 --joint-iterations 10
        --policy-iterations {TURNS - 12} --inference-updates 2 --policy-updates 2 --inference.units 8
        --inference.window 4 --inference.batch-size 4 --inference.decoded 2 {SAC} --sac.projections 2 --prior mixture
        --mixture.from-iteration 1 --mixture.points 60
        --held-out 8 --held-out-at-end 8 --held-out-s 6""",
    "tracker": f"cheetah {ROBOTS} --steps 4 --updates 2 --replay 60 {SAC} {SHORT}",
    "flat": f"""{ON_CHEETAH} --inference position --steps 4 --updates 2 --replay 60 --decisions 5 {SAC}
        --sac.projections 0 {SHORT}""",
    "scratch": f"""{ON_CHEETAH} --decisions 6 --groups 2 --inference-updates 2 --policy-updates 2 --inference.units 8
        --inference.window 4 --inference.batch-size 4 --inference.decoded 2 {SAC} --sac.projections 0 {SHORT}""",
    "high-level": f"{ON_CHEETAH} --steps 4 --updates 2 --replay 60 --decisions 5 {SAC} --sac.projections 0 {SHORT}",
    "step-predictor": f"{ON_CHEETAH} --steps 20 --updates 2 --replay 60 {SAC} {SHORT}",
    "classifier": f"--episodes 8 --held-out 8 --hidden 8 --batch-size 8 --updates 2 --iterations {TURNS}",
}
TOUCHING = ("open", "os.mkdir", "os.rename", "os.remove", "os.rmdir")
"""Audit events of calls that may change a folder."""
MOST_TOUCHES, OF_ARTIFACT = 40, 22
"""A life that ends at a touch of its folder ends at one of so many first ones, or of those after its last turn."""
FIRST_TURN_S = 2.0  # it compiles


@dataclass(frozen=True)
class Death:
    """When a life ends."""

    kind: str
    moment: float
    """Turns that are done, and the share of the next one; or which call that touches the folder."""


def main() -> None:
    """Kill, resume, compare, print a table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--kills", type=int, default=50)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--out", type=Path, default=Path("runs/kills"), help="a folder that is not there yet")
    arguments = parser.parse_args()
    arguments.out = arguments.out.resolve()  # files are told by where they are
    arguments.out.mkdir(parents=True)
    rng = np.random.default_rng(arguments.seed)
    begun, lives = time.monotonic(), {}
    for i, name in enumerate(TRAINERS):
        kills = arguments.kills * (i + 1) // len(TRAINERS) - arguments.kills * i // len(TRAINERS)
        lives[name] = killed_again_and_again(name, arguments.out, kills, rng)
        print(f"{name}: {time.monotonic() - begun:.0f} s", file=sys.stderr, flush=True)
    print("\n| trainer | kills in a turn | at a file | while the artifact was saved | ends as the calm run |")
    print("|---|---|---|---|---|")
    resumed = 0
    for name, deaths in lives.items():
        counts = [sum(death.kind == kind for death in deaths) for kind in ("turn", "file", "artifact")]
        is_same = end(arguments.out / name / "killed") == end(arguments.out / name / "calm")
        resumed += is_same * len(deaths)
        print(f"| {name} | {' | '.join(map(str, counts))} | {'yes' if is_same else 'NO'} |")
    total = sum(map(len, lives.values()))
    print(f"\n{resumed} of {total} resumed to the same hashes ({(time.monotonic() - begun) / 60:.1f} minutes)")
    sys.exit(resumed != total)


def killed_again_and_again(name: str, out: Path, kills: int, rng: np.random.Generator) -> list[Death]:
    """A calm run, and one that dies so many times and is then let alone; returns how it died."""
    log = out / f"{name}.log"
    expect(live(name, out / name / "calm", log), 0, log)
    deaths = [draw("artifact" if i >= kills - 2 else "turn" if i % 2 else "file", rng) for i in range(kills)]
    for death in deaths:
        expect(live(name, out / name / "killed", log, death), -signal.SIGKILL, log)
    expect(live(name, out / name / "killed", log), 0, log)
    return deaths


def draw(kind: str, rng: np.random.Generator) -> Death:
    """A random one of a kind."""
    if kind == "turn":
        return Death(kind, rng.uniform(0.0, 2.0))
    return Death(kind, float(rng.integers(1, 1 + (OF_ARTIFACT if kind == "artifact" else MOST_TOUCHES))))


def expect(code: int, wanted: int, log: Path) -> None:
    """Stop where a life ended otherwise than it should."""
    if code != wanted:
        sys.exit(f"a life ended with {code} instead of {wanted}: see the end of {log}")


def live(name: str, out: Path, log: Path, death: Death | None = None) -> int:
    """One life of a run, in a fork; how it ended."""
    child = os.fork()
    if child == 0:
        with log.open("a") as file:
            os.dup2(file.fileno(), 1)
            os.dup2(file.fileno(), 2)
        if death is not None:
            doom(death, out)
        os._exit(run(["train", name, *TRAINERS[name].split(), "--out", str(out), "--resume"]))
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])


def doom(death: Death, out: Path) -> None:
    """Let this process die then; runs save a checkpoint after each turn."""
    init, loop = Run.__init__, Run.loop
    Run.__init__ = lambda *arguments, **more: init(*arguments, **more, checkpoint_every_s=-1.0)
    if death.kind == "turn":
        Run.loop = lambda self, state, iterate, *rest: loop(self, state, dying(iterate, death.moment), *rest)
        return
    is_counted = death.kind == "file"
    touches = 0

    def count(event: str, arguments: tuple) -> None:
        nonlocal touches
        if is_counted and event in TOUCHING and str(arguments[0]).startswith(str(out)):
            touches += 1
            if touches == death.moment:
                die()

    def loop_and_count(*arguments):
        nonlocal is_counted
        state = loop(*arguments)
        is_counted = True
        return state

    Run.loop = loop_and_count
    sys.addaudithook(count)


def dying(iterate: Callable, moment: float) -> Callable:
    """`iterate`, but that it kills the process in the middle of a turn."""
    last_turn, share = divmod(moment, 1.0)
    begun = []

    def iterate_and_die(state):
        begun.append(time.monotonic())
        turn = len(begun) - 1
        if turn == last_turn:
            threading.Timer(share * (FIRST_TURN_S if turn == 0 else begun[-1] - begun[-2]), die).start()
        if turn > last_turn:
            die()  # the turn was shorter than expected
        return iterate(state)

    return iterate_and_die


def die() -> None:
    """As a power cut would have it."""
    os.kill(os.getpid(), signal.SIGKILL)


def end(out: Path) -> tuple[str, str, str]:
    """Hashes of the artifact and of the whole state, and what was measured."""
    loaded = load_artifact(out)
    state = safetensors.numpy.load_file(out / FOLDER / FILE)
    return tree_hash(loaded.arrays), tree_hash(state), loaded.log


if __name__ == "__main__":
    main()
