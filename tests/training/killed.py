"""A training run that is killed again and again: python killed.py MOMENTS ARGUMENTS-OF-REBODY...

MOMENTS such as `0.31,1.07`: the first life ends in its first turn, the next one resumes and ends early in its
second. A turn includes the checkpoint at its end. Prints how each life ended.
Each life is a fork, made before JAX starts any thread: what is imported is imported once.
"""

import os
import signal
import sys
import threading
import time
from functools import partialmethod

import rebody.cli.train  # noqa: F401  every pipeline, before the first life
from rebody.cli.main import run
from rebody.training.run import Run

FIRST_TURN_S = 1.0  # it compiles


def doom(moment):
    """Let every run save a checkpoint after each turn, and die at that moment."""
    last_turn, share = divmod(moment, 1.0)
    loop = Run.loop

    def loop_and_die(self, state, iterate, iterations, label):
        begun = []

        def iterate_and_die(state):
            begun.append(time.monotonic())
            turn = len(begun) - 1
            if turn == last_turn:
                expected = begun[-1] - begun[-2] if turn > 1 else FIRST_TURN_S
                threading.Timer(share * expected, die).start()
            if turn > last_turn:
                die()  # the turn was shorter than expected
            return iterate(state)

        return loop(self, state, iterate_and_die, iterations, label)

    Run.__init__ = partialmethod(Run.__init__, checkpoint_every_s=-1.0)
    Run.loop = loop_and_die


def die():
    os.kill(os.getpid(), signal.SIGKILL)


def live(moment, arguments):
    doom(moment)
    os._exit(run([*arguments, "--resume"]))


for moment in map(float, sys.argv[1].split(",")):
    child = os.fork()
    if child == 0:
        live(moment, sys.argv[2:])
    print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), flush=True)
