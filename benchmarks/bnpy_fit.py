"""One fit with bnpy, run by the Python of its own environment: `mixture.py --bnpy` calls it.

    PYTHON benchmarks/bnpy_fit.py INPUT.npz OUTPUT.npz

INPUT: points `X` [N, D], `covariance_type`, the bound to reach `target` [nats], `limit` [s], `concentration`,
`prior_scale`, `batches`. OUTPUT: responsibilities `r` [N, K], `seconds`, and `bound`, bnpy's own ELBO [nats].
"""

import inspect
import os
import sys
import tempfile
import time
from contextlib import suppress

os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("MPLBACKEND", "Agg")
# bnpy still asks for this function, which Python 3.11 has dropped
inspect.getargspec = lambda function: inspect.getfullargspec(function)[:4]

import bnpy  # noqa: E402
import numpy as np  # noqa: E402


class Done(Exception):
    """The bound is reached, or the time is up."""


class Watch:
    """What bnpy calls after each batch and lap: keeps the best model, and ends the fit."""

    def __init__(self, target, limit, scale):
        self.target, self.limit, self.scale, self.begun = target, limit, scale, time.perf_counter()
        self.bound, self.model, self.seconds = -np.inf, None, 0.0

    def onBatchComplete(self, **state):
        if time.perf_counter() - self.begun > self.limit:
            raise Done

    def onLapComplete(self, hmodel=None, loss=None, lapFrac=0.0, **state):
        self.seconds = time.perf_counter() - self.begun
        # its loss is per number in the data; until every batch has been seen it is that of a part
        bound = -float(loss) * self.scale if lapFrac >= 1 else -np.inf
        if bound > self.bound:
            self.bound, self.model = bound, hmodel.copy()
        if self.bound >= self.target:
            raise Done


def main():
    given = np.load(sys.argv[1])
    data = bnpy.data.XData(given["X"])
    watch = Watch(float(given["target"]), float(given["limit"]), scale=given["X"].size)
    sys.modules["watch"] = watch  # bnpy takes the name of a module, not an object
    seed = 0
    with tempfile.TemporaryDirectory() as logs, suppress(Done):
        while True:  # a fit that settles on less begins again elsewhere, on the same clock
            fit(data, given, watch, seed, logs)
            seed += 1
    r = watch.model.calc_local_params(data)["resp"] if watch.model else np.ones((len(given["X"]), 1))
    np.savez(sys.argv[2], r=r, seconds=watch.seconds, bound=watch.bound)


def fit(data, given, watch, seed, logs):
    bnpy.run(
        data,
        "DPMixtureModel",
        {"full": "Gauss", "diag": "DiagGauss"}[str(given["covariance_type"])],
        "memoVB",
        gamma0=float(given["concentration"]),
        sF=float(given["prior_scale"]),
        ECovMat="eye",
        kappa=1e-4,
        nu=data.X.shape[1] + 2,
        K=1,
        initname="randexamples",
        nBatch=int(given["batches"]),
        nLap=1000,
        moves="birth,merge,delete,shuffle",
        algseed=seed,
        dataorderseed=seed,
        doWriteStdOut=False,
        output_path=logs,  # its births cannot do without a log
        printEvery=-1,
        saveEvery=-1,
        customFuncPath="/watch",
    )


if __name__ == "__main__":
    main()
