"""A training run that is killed again and again: python killed.py MOMENTS ARGUMENTS-OF-REBODY...

MOMENTS such as `2.31,3.07`: the first life ends 0.31 turns after its second turn, the next life resumes and
ends 0.07 turns after its third. A turn ends with a checkpoint. Prints how each life ended.
Each life is a fork, made before JAX starts any thread: what is imported is imported once.
"""

import os
import signal
import sys
import threading
import time
from functools import partial

from rebody.cli.main import run
from rebody.training.inference import train as inference
from rebody.training.run import Run
from rebody.training.tracker import train as tracker


class DoomedRun(Run):
    def __init__(self, moment, *arguments, **options):
        super().__init__(*arguments, **options, checkpoint_every_s=-1.0)
        self.last_turn, self.share = divmod(moment, 1.0)

    def loop(self, state, iterate, iterations, label):
        begun = []

        def iterate_and_die(state):
            begun.append(time.monotonic())
            if len(begun) == self.last_turn + 1:
                delay = self.share * (begun[-1] - begun[-2])
                threading.Timer(delay, os.kill, (os.getpid(), signal.SIGKILL)).start()
            return iterate(state)

        return super().loop(state, iterate_and_die, iterations, label)


def live(moment, arguments):
    tracker.Run = inference.Run = partial(DoomedRun, moment)
    os._exit(run([*arguments, "--resume"]))


for moment in map(float, sys.argv[1].split(",")):
    child = os.fork()
    if child == 0:
        live(moment, sys.argv[2:])
    print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), flush=True)
