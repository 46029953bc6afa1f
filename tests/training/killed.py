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
from functools import partial

from rebody.cli.main import run
from rebody.training.flat import train as flat
from rebody.training.inference import train as inference
from rebody.training.run import Run
from rebody.training.scratch import train as scratch
from rebody.training.step_predictor import train as step_predictor
from rebody.training.tracker import train as tracker

FIRST_TURN_S = 1.0  # it compiles


class DoomedRun(Run):
    def __init__(self, moment, *arguments, **options):
        super().__init__(*arguments, **options, checkpoint_every_s=-1.0)
        self.last_turn, self.share = divmod(moment, 1.0)

    def loop(self, state, iterate, iterations, label):
        begun = []

        def iterate_and_die(state):
            begun.append(time.monotonic())
            turn = len(begun) - 1
            if turn == self.last_turn:
                expected = begun[-1] - begun[-2] if turn > 1 else FIRST_TURN_S
                threading.Timer(self.share * expected, die).start()
            if turn > self.last_turn:
                die()  # the turn was shorter than expected
            return iterate(state)

        return super().loop(state, iterate_and_die, iterations, label)


def die():
    os.kill(os.getpid(), signal.SIGKILL)


def live(moment, arguments):
    tracker.Run = inference.Run = flat.Run = scratch.Run = step_predictor.Run = partial(DoomedRun, moment)
    os._exit(run([*arguments, "--resume"]))


for moment in map(float, sys.argv[1].split(",")):
    child = os.fork()
    if child == 0:
        live(moment, sys.argv[2:])
    print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), flush=True)
