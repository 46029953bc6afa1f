"""Malformed inputs: good task files, logs, artifacts and command lines with something changed."""

import json
import os
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

NUMBERS = (
    "nan", "inf", "-inf", "1e300", "-1e39", "3.4e38", "9223372036854775808", "-99999999", "1e-400", "0", "-1", "2.5",
)  # fmt: skip
WORDS = (
    "", "far", "goal", "None", "true", "[]", "{}", "\u0661", "\U0001f916", "\udcff", "a" * 3000, "../..", "$\\frac{$",
)  # fmt: skip


@dataclass
class Case:
    """One command line, and whether it is sure to be wrong."""

    kind: str
    arguments: list[str]
    is_wrong: bool


def draw(rng: np.random.Generator, folder: Path, inputs: int) -> Iterator[Case]:
    """So many cases, whose files lie in the folder for as long as they are needed."""
    make_odd_files(folder)
    kinds: tuple[Callable[[np.random.Generator, Path], Case], ...] = (task_file, log, artifact, command_line)
    for _ in range(inputs):
        yield kinds[rng.integers(len(kinds))](rng, folder)


def pick(rng: np.random.Generator, options):
    """One of them."""
    return options[int(rng.integers(len(options)))]


# task files

BAD_VALUES = (
    float("nan"), float("inf"), -float("inf"), 1e300, -1e39, 10**400, "far", "", None, True, [], {}, [1.0, 2.0], [[1]],
    {"target": 1},
)  # fmt: skip


def task_file(rng: np.random.Generator, folder: Path) -> Case:
    """A list of tasks with one thing changed."""
    path = folder / "tasks.json"
    content, is_wrong = pick(rng, (spoilt_entry, spoilt_shape, spoilt_bytes))(rng)
    path.write_bytes(content)
    words = ["evaluate", "--robot", "point-mass", "--inference", "position", "--seconds", "5", "--tasks", str(path)]
    return Case("task file", words, is_wrong)


def good_tasks(rng: np.random.Generator) -> list[dict]:
    tasks = [{"family": "goal", "target": round(float(t), 2)} for t in rng.uniform(-9, 9, rng.integers(1, 5))]
    if rng.random() < 0.5:
        tasks[0]["switch"] = {"at_s": 2.0, "family": "goal", "target": -3.0}
    return tasks


def spoilt_entry(rng: np.random.Generator) -> tuple[bytes, bool]:
    """A value that cannot be, or a name that is not there."""
    tasks = good_tasks(rng)
    entry = pick(rng, tasks)
    entry = entry["switch"] if "switch" in entry and rng.random() < 0.5 else entry
    if rng.random() < 0.7:
        name = pick(rng, [key for key in ("target", "at_s") if key in entry])
        entry[name] = pick(rng, BAD_VALUES)
    elif rng.random() < 0.5:
        entry["family"] = pick(rng, (*WORDS[:6], 3, None, [], "Goal", "goal ", "velocity"))
        if entry["family"] == "goal":
            entry["family"] = "gaol"
    else:
        entry.pop("target")
    return json.dumps(tasks).encode(errors="surrogatepass"), True


def spoilt_shape(rng: np.random.Generator) -> tuple[bytes, bool]:
    """Something else than a list of tasks."""
    tasks = good_tasks(rng)
    shapes = (
        {}, [], tasks[0], [tasks], [*tasks, None], [*tasks, 3], 3, None, "tasks", tasks * 200_000,
        [tasks[0] | {"colour": 1}], [tasks[0] | {"switch": 3}],
    )  # fmt: skip
    return json.dumps(pick(rng, shapes)).encode(), True


def spoilt_bytes(rng: np.random.Generator) -> tuple[bytes, bool]:
    """A file that is cut, flipped, nested, or in another encoding."""
    data = json.dumps(good_tasks(rng)).encode()
    match rng.integers(6):
        case 0:
            return data[: rng.integers(1, len(data) - 1)], True
        case 1:
            flipped = bytearray(data)
            flipped[rng.integers(len(data))] ^= 1 << int(rng.integers(8))
            return bytes(flipped), False
        case 2:
            return b"[" * 100_000 + b"]" * 100_000, True
        case 3:
            return b"\xef\xbb\xbf" + data, False  # a byte order mark is fine
        case 4:
            return pick(rng, (data.decode().encode("utf-16"), b"", b"\0" * 50, b"\xff\xfe", rng.bytes(200))), True
        case _:
            return data + pick(rng, (b"}", b"[]", b"\0", b"//")), True


# logs


def log(rng: np.random.Generator, folder: Path) -> Case:
    """A run of six seconds towards a goal, with something changed."""
    path, flags = folder / "run.csv", []
    rows, is_wrong = spoilt_rows(rng, good_rows())
    if rng.random() < 0.3:
        flags, is_wrong = ["--skip-bad-rows"], False
    data = "\n".join(rows).encode(errors="surrogatepass")
    if rng.random() < 0.1:
        data, is_wrong = pick(rng, (data[:10], b"", b"\xff" * 99, rng.bytes(300), data.decode().encode("utf-16"))), True
    path.write_bytes(data)
    return Case("log", ["infer", str(path), "--inference", "position", *flags], is_wrong)


def good_rows() -> list[str]:
    time_s = 0.05 * np.arange(120)
    x = np.minimum(time_s, 4.0) * (1 + 0.01 * np.sin(9 * time_s))
    return [
        "time_s,position_m,reward",
        *(f"{t:.3f},{a:.4f},{-abs(a - 4.2):.4f}" for t, a in zip(time_s, x, strict=True)),
    ]


def spoilt_rows(rng: np.random.Generator, rows: list[str]) -> tuple[list[str], bool]:
    """Cells, rows, names or time stamps that are not as they should be."""
    at = int(rng.integers(1, len(rows)))
    cells = rows[at].split(",")
    match rng.integers(9):
        case 0:
            cells[rng.integers(3)] = pick(
                rng, ("nan", "inf", "1_0", "0x10", "", "far", "1e300", "-1e39", "--1", "1,5", "1e400")
            )
            rows[at] = ",".join(cells)
            return rows, True
        case 1:
            rows[at] = ",".join(cells[: rng.integers(1, 3)])
            return rows, True
        case 2:
            rows[at] = rows[at - 1] if at > 1 else rows[at + 1]
            return rows, True
        case 3:
            return rows[: at if at < 4 else 3], True
        case 4:
            names = pick(
                rng, ("time_s,position_m", "t,x,r", "time_s,reward,reward", "", "time_s;position_m;reward", WORDS[-1])
            )
            return [names, *rows[1:]], True
        case 5:
            return [row.replace(",", pick(rng, (";", "\t", " "))) for row in rows], True
        case 6:
            return [rows[0], *(f"{50 * i},{row.split(',', 1)[1]}" for i, row in enumerate(rows[1:]))], True
        case 7:
            del rows[at : at + 20]
            return rows, 1 < at < len(rows) - 1
        case _:  # rewards of another form are read, and doubted
            factor = pick(rng, (100.0, -1.0, 0.0))
            scaled = [f"{row.rsplit(',', 1)[0]},{factor * float(row.rsplit(',', 1)[1])}" for row in rows[1:]]
            return [rows[0], *scaled], False


# artifacts

ARTIFACTS = (
    (["--robot", "point-mass", "--inference"], "inference", "goal-velocity-stand"),
    (["--robot", "cheetah", "--inference", "position", "--tracker"], "tracker", "tracker-cheetah"),
    (["--robot", "cheetah", "--inference", "position", "--agent", "flat", "--flat"], "flat", "flat-position-cheetah"),
    (["--robot", "cheetah", "--agent", "scratch", "--scratch"], "scratch", "scratch-cheetah"),
    (
        ["--robot", "cheetah", "--inference", "goal-velocity", "--classifier"],
        "classifier",
        "classifier-goal-velocity",
    ),
    (
        ["--robot", "cheetah", "--inference", "goal-velocity", "--agent", "retrain", "--high-level"],
        "high-level",
        "high-level-goal-velocity-cheetah",
    ),
    (
        ["--robot", "cheetah", "--inference", "position", "--thesis", "--stride", "predicted", "--step-predictor"],
        "step-predictor",
        "step-predictor-cheetah",
    ),
)
"""What loads each kind, and an artifact of it."""


def artifact(rng: np.random.Generator, folder: Path) -> Case:
    """A shipped artifact with one thing changed, and hashes that fit."""
    from rebody.store import artifact as store

    words, kind, name = pick(rng, ARTIFACTS)
    content = {each: (store.SHIPPED / name / each).read_bytes() for each in store.HASHED}
    is_wrong = spoil_artifact(rng, content)
    manifest = store._manifest(kind, content)
    if rng.random() < 0.1:
        manifest, is_wrong = spoilt_json(rng, json.loads(manifest)), False
    (folder / "odd").mkdir(exist_ok=True)
    for each, data in (content | {store.MANIFEST: manifest}).items():
        (folder / "odd" / each).write_bytes(data)
    return Case("artifact", ["evaluate", "--tasks", "good.json", "--seconds", "5", *words, "./odd"], is_wrong)


def spoil_artifact(rng: np.random.Generator, content: dict[str, bytes]) -> bool:
    """Changes settings or weights in place; whether that is sure to be wrong."""
    import safetensors.numpy

    if rng.random() < 0.6:
        settings = json.loads(content["config.json"])
        training = {"training": settings.pop("training")} if rng.random() < 0.8 else {}
        content["config.json"] = spoilt_json(rng, settings, training)
        return False
    arrays = safetensors.numpy.load(content["weights.safetensors"])
    name = pick(rng, sorted(arrays))
    match rng.integers(4):
        case 0:
            arrays[name] = np.full_like(arrays[name], np.nan if arrays[name].dtype.kind == "f" else 99)
            is_wrong = arrays[name].dtype.kind != "b"
        case 1:
            arrays[name], is_wrong = arrays[name][..., None], True
        case 2:
            arrays.pop(name)
            is_wrong = True
        case _:
            data = bytearray(content["weights.safetensors"])
            data[rng.integers(200)] ^= 1 << int(rng.integers(8))
            content["weights.safetensors"] = bytes(data)
            return False
    content["weights.safetensors"] = safetensors.numpy.save(arrays)
    return is_wrong


def spoilt_json(rng: np.random.Generator, settings: dict, more: dict | None = None) -> bytes:
    """An object with another value, a key more or a key less somewhere."""
    inner, name = settings, pick(rng, list(settings))
    while isinstance(inner[name], dict | list) and inner[name] and rng.random() < 0.7:
        inner = inner[name]
        name = pick(rng, list(inner) if isinstance(inner, dict) else range(len(inner)))
    match rng.integers(4):
        case 0:
            del inner[name]
        case 1 if isinstance(inner, dict):
            inner[f"{name}_"] = inner[name]
        case _:
            inner[name] = pick(rng, BAD_VALUES)
    return json.dumps(settings | (more or {})).encode()


# command lines

TASK, FILE = ["run", "--task", "goal=3"], ["evaluate", "--tasks", "good.json"]
ON_TOY = ["--robot", "point-mass", "--inference", "position"]
BASES: tuple[tuple[list[str], dict[str, Sequence[str]]], ...] = (
    (
        [*TASK, *ON_TOY],
        {"--seconds": NUMBERS, "--horizon": NUMBERS, "--stride": NUMBERS, "--task": WORDS, "--robot": WORDS},
    ),
    (
        [*FILE, *ON_TOY],
        {"--seeds": (*NUMBERS, "100000000"), "--seconds": NUMBERS, "--inference": WORDS, "--agent": WORDS},
    ),
    (
        ["train", "inference", "position", "--out", "new"],
        {
            "--seed": ("-1", "4294967296", "9223372036854775808", "1e3", "nan"),
            "--episodes": NUMBERS,
            "--decisions": NUMBERS,
            "--sac.decay-updates": NUMBERS,
            "--sac.hidden": NUMBERS,
            "--inference.window": ("0", "-3", "201", "nan"),
            "--joint-iterations": ("-1", "nan", "99999999"),
            "--turn-probability": ("nan", "2", "-1"),
        },
    ),
    (
        ["train", "tracker", "cheetah", "--out", "new"],
        {
            "--robots": (*NUMBERS, "100000000"),
            "--replay": ("-1", "0", "nan", "99999999999"),
            "--push-every-s": ("nan", "0", "-1", "inf"),
            "--iterations": ("-1", "nan", "99999999"),
            "--segment-s": ("nan", "-1"),
            "--reward.alive": ("nan", "-1"),
        },
    ),
    (
        ["train", "classifier", "--out", "new"],
        {"--episodes": ("0", "-1", "nan", "99999999"), "--updates": ("0", "-1"), "--seed": ("-1",)},
    ),
    (
        ["stress", "--robot", "cheetah"],
        {
            "--episodes": NUMBERS,
            "--seed": ("-1", "nan", "4294967296"),
            "--tracker": [word for word in WORDS if word != "None"],
        },
    ),
    (["view"], {"--port": ("-1", "65536", "nan", "1e9"), "--task": WORDS[:-2], "--agent": WORDS}),
    (["figure", "6.3"], {}),
    (["report", "position", "--out", "page.html"], {}),
    (["infer", "good.csv", "--inference", "position"], {"--time-unit": WORDS, "--delimiter": WORDS}),
    (["robot", "check", "cheetah"], {}),
)
"""Command lines that work, and values of their options that are wrong."""
ODD = (
    "folder",
    "fifo",
    "/dev/zero",
    "/dev/null",
    "loop",
    "missing/file",
    "good.json/file",
    "huge",
    "outside",
    "",
    ".",
    "/",
)
TAKEN = ("fifo", "/dev/zero", "/dev/null", "loop", "good.json/file", "same.json", "good.json")
INPUTS = (
    ["evaluate", "--tasks"],
    ["infer"],
    ["robot", "check"],
    ["run", "--task", "goal=3", "--robot"],
    ["report"],
    ["train", "inference"],
    ["train", "tracker"],
)
OUTPUTS = (
    [*FILE, *ON_TOY, "--json"],
    [*TASK, *ON_TOY, "--figure"],
    ["train", "tracker", "cheetah", "--out"],
    ["train", "inference", "position", "--out"],
)


def make_odd_files(folder: Path) -> None:
    """Everything that a path may turn out to be."""
    (folder / "good.json").write_text('[{"family": "goal", "target": 3.0}]')
    (folder / "good.csv").write_text("\n".join(good_rows()))
    (folder / "folder").mkdir()
    os.mkfifo(folder / "fifo")
    (folder / "loop").symlink_to("loop")
    (folder / "outside").symlink_to("/dev/zero")
    (folder / "same.json").symlink_to("good.json")
    with (folder / "huge").open("wb") as file:
        file.truncate(8 << 30)  # sparse


def command_line(rng: np.random.Generator, folder: Path) -> Case:
    """A command with one wrong value, an odd path, or words that are not known."""
    match rng.integers(5):
        case 0 | 1:
            base, wrong = pick(rng, [base for base in BASES if base[1]])
            option = pick(rng, list(wrong))
            value = pick(rng, wrong[option])
            return Case("command line", replaced(base, option, value), True)
        case 2:
            return Case("command line", [*pick(rng, INPUTS), pick(rng, (*ODD, *WORDS))], True)
        case 3:
            words = [
                *pick(rng, OUTPUTS),
                pick(rng, ("fifo", "/dev/zero", "/dev/null", "loop", "good.json/file", "same.json", "good.json")),
            ]
            return Case("command line", words, True)
        case _:
            base, _ = pick(rng, BASES)
            at = int(rng.integers(1, len(base) + 1))
            odd = pick(rng, ("--" + pick(rng, WORDS), "--nowhere", "-x", "--", *WORDS[:4]))
            return Case("command line", [*base[:at], odd, *base[at:]], odd == "--nowhere")


def replaced(base: list[str], option: str, value: str) -> list[str]:
    """The command line with another value of an option."""
    if option in base:
        at = base.index(option) + 1
        return [*base[:at], value, *base[at + 1 :]]
    return [*base, f"{option}={value}"] if value.startswith("-") else [*base, option, value]
