"""How fast the mixture gets to its bound: ours, scikit-learn's `BayesianGaussianMixture`, and `bnpy`.

    .venv/bin/python benchmarks/mixture.py [--sizes 2000 20000 200000] [--dimensions 2 4 8] [--covariance full diag]
        [--limit 60] [--bnpy runs/bnpy/bin/python]

All get the same points (seven Gaussian clusters of unlike sizes, the smallest 1 %), centred, the same priors, and one
thread. A method has arrived when its responsibilities are worth as much as our fit's by our ELBO, less `--tolerance` of
it; the clock counts its fitting alone, and at the limit it stands still. What settles on less begins again with
another seed, on the same clock; `>` marks a bound not reached, which counts as the limit. K: components with a point
or more.

bnpy (0.1.7, of 2022) asks for a compiler, and an environment of its own with old wheels, since its `setup.py` pins what
no longer installs. The C files in its archive are too old for Python 3.11, so they are made anew (half a minute):

    python3.11 -m venv runs/bnpy
    runs/bnpy/bin/pip install --only-binary :all: numpy==1.23.5 scipy==1.10.1 scikit-learn==1.2.2 pandas==2.0.3 \
        matplotlib==3.7.5 'cython<3' 'setuptools<60' wheel joblib memory_profiler munkres numexpr psutil six
    runs/bnpy/bin/pip download --no-deps --no-build-isolation --dest runs bnpy==0.1.7
    tar -xzf runs/bnpy-0.1.7.tar.gz -C runs
    find runs/bnpy-0.1.7 -name '*.c' -delete
    runs/bnpy/bin/pip install --no-deps --no-build-isolation runs/bnpy-0.1.7

At most 60 s for each of 18 fits: 20 minutes for one kind of covariance.
"""

import argparse
import subprocess
import tempfile
import time
import warnings
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from sklearn.exceptions import ConvergenceWarning
from sklearn.mixture import BayesianGaussianMixture
from threadpoolctl import threadpool_limits

from rebody.inference.mixture import DirichletProcessMixture
from rebody.inference.mixture.gaussians import KAPPA0
from rebody.inference.mixture.model import Model, Responsibilities

SHARES = (0.30, 0.22, 0.18, 0.14, 0.10, 0.05, 0.01)
APART = 4.0
"""Between centres; a cluster's standard deviations are 0.3 to 1."""
CONCENTRATION, PRIOR_SCALE = 5.0, 0.1
TRUNCATION = 20
PATIENCE = 1e-7
"""scikit-learn has settled when ten laps together gain less than this share of the ELBO."""


@dataclass(frozen=True)
class Result:
    """What one method came to."""

    seconds: float
    reached: bool
    bound: float  # our ELBO [nats]
    components: int


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--sizes", type=int, nargs="+", default=[2_000, 20_000, 200_000])
    parser.add_argument("--dimensions", type=int, nargs="+", default=[2, 4, 8])
    parser.add_argument("--covariance", nargs="+", choices=("full", "diag"), default=["full"])
    parser.add_argument("--limit", type=float, default=60.0, help="seconds for each method and set of points")
    parser.add_argument("--tolerance", type=float, default=1e-6, help="share of the ELBO that a bound may lack")
    parser.add_argument("--bnpy", type=Path, help="Python of bnpy's environment; without it bnpy is left out")
    options = parser.parse_args()
    if options.bnpy is None:
        print("bnpy is left out: --bnpy PYTHON adds it (this file says how to install it).\n")

    with threadpool_limits(1):
        ours(points(500, 2, "full"), "full")  # what is done once only
        for covariance in options.covariance:
            compare(covariance, options)


def points(n: int, dimensions: int, covariance: str) -> np.ndarray:
    """Clusters of the shares above, apart from one another, each with its own covariance; centred, in no order."""
    rng = np.random.default_rng(dimensions)
    counts = np.round(n * np.array(SHARES)).astype(int)
    counts[0] += n - counts.sum()
    clusters = []
    for count, centre in zip(counts, centres(rng, len(SHARES), dimensions), strict=True):
        turn = np.eye(dimensions)
        if covariance == "full":
            turn = np.linalg.qr(rng.normal(size=(dimensions, dimensions)))[0]
        widths = rng.uniform(0.3, 1.0, dimensions)
        clusters.append(centre + (rng.normal(size=(count, dimensions)) * widths) @ turn.T)
    x = rng.permutation(np.concatenate(clusters))
    return x - x.mean(0)


def centres(rng: np.random.Generator, k: int, dimensions: int) -> np.ndarray:
    """At least `APART` from one another."""
    found: list[np.ndarray] = []
    while len(found) < k:
        proposed = rng.normal(0.0, 4.0, dimensions)
        if all(np.linalg.norm(proposed - other) > APART for other in found):
            found.append(proposed)
    return np.array(found)


def compare(covariance: str, options: argparse.Namespace) -> None:
    """A table for one kind of covariance, and how our time grows."""
    methods = ["ours", "scikit-learn", *(["bnpy"] if options.bnpy else [])]
    others = methods[1:]
    titles = [f"{name} [s]" for name in methods] + [f"{name} / ours" for name in others]
    titles += [f"K {name}" for name in methods] + [f"ELBO {name}" for name in methods]
    print(f"covariance {covariance}, {len(SHARES)} clusters\n\n| N | D | " + " | ".join(titles) + " |", flush=True)
    print("|" + "---|" * (len(titles) + 2))
    seconds: dict[int, list[float]] = {}
    for d in options.dimensions:
        for n in options.sizes:
            x = points(n, d, covariance)
            results, model = {}, None
            results["ours"], model = ours(x, covariance)
            target = results["ours"].bound - options.tolerance * abs(results["ours"].bound)
            results["scikit-learn"] = scikit_learn(x, covariance, model, target, options.limit)
            if options.bnpy:
                results["bnpy"] = bnpy(x, covariance, model, target, options.limit, options.bnpy)
            print_row(n, d, results, options.limit)
            seconds.setdefault(d, []).append(results["ours"].seconds)
    print()
    if len(options.sizes) > 1:
        for d, times in seconds.items():
            print(f"D = {d}: our time grows as N^{np.polyfit(np.log(options.sizes), np.log(times), 1)[0]:.2f}")
        print()


def print_row(n: int, d: int, results: dict[str, Result], limit: float) -> None:
    cells = [f"{r.seconds:.2f}" if r.reached else f"> {limit:g}" for r in results.values()]
    base = results["ours"].seconds
    for name, result in results.items():
        if name != "ours":
            cells.append(f"{result.seconds / base:.1f}" if result.reached else f"> {limit / base:.0f}")
    cells += [str(r.components) for r in results.values()] + [f"{r.bound:.2f}" for r in results.values()]
    print(f"| {n} | {d} | " + " | ".join(cells) + " |", flush=True)


def judge(model: Model, x: np.ndarray, r: np.ndarray) -> tuple[float, int]:
    """Our ELBO of responsibilities [nats], and components that have a point or more."""
    entropy = -np.sum(r * np.log(np.where(r > 0, r, 1.0)), axis=0)
    return model.bound(model.summarise(x, Responsibilities(r, entropy))), int(np.sum(r.sum(0) >= 1.0))


def ours(x: np.ndarray, covariance: str) -> tuple[Result, Model]:
    begun = time.perf_counter()
    mixture = DirichletProcessMixture(covariance, CONCENTRATION, PRIOR_SCALE).fit(x)
    seconds = time.perf_counter() - begun
    model, _ = mixture.fitted
    bound, components = judge(model, x, mixture.predict_proba(x))
    return Result(seconds, True, bound, components), model


def scikit_learn(x: np.ndarray, covariance: str, model: Model, target: float, limit: float) -> Result:
    """Ten laps at a time, until the bound is reached; judging them does not count."""
    d = x.shape[1]
    prior = PRIOR_SCALE * (np.eye(d) if covariance == "full" else np.full(d, float(d)))  # B0, or beta0
    best, components, seconds = -np.inf, 0, 0.0
    for seed in range(1_000_000):
        mixture = BayesianGaussianMixture(
            n_components=TRUNCATION,
            covariance_type=covariance,
            weight_concentration_prior_type="dirichlet_process",
            weight_concentration_prior=CONCENTRATION,
            mean_precision_prior=KAPPA0,
            mean_prior=np.zeros(d),
            degrees_of_freedom_prior=d + 2,
            covariance_prior=prior,
            reg_covar=0.0,
            tol=0.0,
            max_iter=10,
            warm_start=True,
            random_state=seed,
        )
        last = -np.inf
        while seconds < limit:
            begun = time.perf_counter()
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", ConvergenceWarning)
                mixture.fit(x)
            seconds += time.perf_counter() - begun
            bound, k = judge(model, x, mixture.predict_proba(x))
            if bound > best:
                best, components = bound, k
            if best >= target:
                return Result(seconds, seconds <= limit, best, components)
            if bound - last <= PATIENCE * abs(bound):
                break
            last = bound
        if seconds >= limit:
            break
    return Result(limit, False, best, components)


def bnpy(x: np.ndarray, covariance: str, model: Model, target: float, limit: float, python: Path) -> Result:
    """Until its own bound, which is the same as ours, gets there: see bnpy_fit.py."""
    with tempfile.TemporaryDirectory() as folder:
        given, taken = Path(folder) / "given.npz", Path(folder) / "taken.npz"
        settings = {"concentration": CONCENTRATION, "prior_scale": PRIOR_SCALE, "batches": 5}
        np.savez(given, X=x, covariance_type=covariance, target=target, limit=limit, **settings)
        script = Path(__file__).with_name("bnpy_fit.py")
        run = subprocess.run([python, "-W", "ignore", script, given, taken], capture_output=True, text=True)
        if run.returncode:
            raise SystemExit(f"bnpy failed:\n{run.stderr}")
        with np.load(taken) as fit:
            bound, components = judge(model, x, fit["r"])
            reached = fit["bound"] >= target and fit["seconds"] <= limit
            return Result(float(fit["seconds"]) if reached else limit, bool(reached), bound, components)


if __name__ == "__main__":
    main()
