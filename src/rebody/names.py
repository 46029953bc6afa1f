"""What can be asked for by name, with a line about each: all that `rebody list` prints.

Importing this loads no library, so that a list or a help costs nothing. Agents and figures are described here and
nowhere else; families, presets and commands where they are defined, which is read from the source.
"""

import ast
from pathlib import Path

POINT_MASS = "point-mass"
ROBOTS = Path(__file__).parent / "bodies" / "robots"
ARTIFACTS = Path(__file__).parent / "artifacts"
FAMILIES = tuple(Path(__file__).parent / "tasks" / f"{name}.py" for name in ("line", "plane"))
"""Files whose top level has the families that ship."""
PRESETS = Path(__file__).parent / "training" / "inference" / "presets.py"

AGENTS = {
    "reuse": "the frozen module and the frozen policy of the toy",
    "retrain": "the frozen module, and a high-level policy that was learned on the robot",
    "readout": "the target read linearly from the module's belief, handed to the tracker",
    "bayes": "the exact posterior in place of the module, its most probable target handed to the tracker",
    "oracle": "told the task",
    "flat": "the frozen module, and a policy without hierarchy that was learned on the robot",
    "scratch": "module and policy that were learned on the robot together, nothing reused",
    "idle": "knows nothing and stands still",
}
"""Every kind of agent, and what it is."""
FIGURES = {
    "6.1": "the toy in MuJoCo, and the forces on it",
    "6.2": "return during training on the toy",
    "6.3": "the trained module on the toy",
    "6.5": "a flat policy on the cheetah: trajectories",
    "6.6": "a flat policy on the cheetah: training",
    "6.7": "the cheetah's tracker: training",
    "6.8": "the naive transfer to the cheetah: a decision at every control step",
    "6.9": "striding on the cheetah",
    "6.10": "hidden positions on the hopper",
    "6.11": "hidden positions on the walker",
    "6.12": "trackers of robots that have to balance: training",
    "6.13": "return during training on goals and speeds",
    "6.14a": "the toy on goals and speeds",
    "6.14b": "latents of goals and speeds in two dimensions",
    "6.15": "goals and speeds on the cheetah, by what disturbed the toy in training",
    "6.16": "goals and speeds on the cheetah, zero-shot",
    "6.17": "goals and speeds on the walker, zero-shot",
    "6.18": "goals and speeds on the hopper, zero-shot",
    "6.19": "high levels learned on robots: training",
    "6.20": "high levels learned on the cheetah: goals and speeds",
    "6.21": "high levels learned on walker and hopper: goals and speeds",
    "6.22": "a high level learned on the cheetah: goals, speeds and stands",
}
"""Figures of the thesis' chapter 6 by number, with their titles."""


def shipped_robots() -> tuple[str, ...]:
    """Names of the robots that come with the package."""
    return tuple(sorted(path.stem for path in ROBOTS.glob("*.toml")))


def families() -> dict[str, str]:
    """Families of tasks that ship: what each asks for, the unit of its targets, and the tolerance."""
    nodes = [
        node.value for source in FAMILIES for node in ast.parse(source.read_text()).body if isinstance(node, ast.Assign)
    ]
    made = [node for node in nodes if isinstance(node, ast.Call) and ast.unparse(node.func) == "Family"]
    lines = {}
    for call in made:
        said = {keyword.arg: keyword.value for keyword in call.keywords}
        quantity = said["quantity"]
        assert isinstance(quantity, ast.Call)
        name, label, unit, tolerance = map(
            ast.literal_eval, (said["name"], said["label"], quantity.args[2], said["tolerance"])
        )
        lines[name] = f"{label}: {unit}, solved within {tolerance:g}"
    return lines


def presets() -> dict[str, str]:
    """Presets of `rebody train inference`, with the first line of each."""
    assigned = (node for node in ast.parse(PRESETS.read_text()).body if isinstance(node, ast.AnnAssign))
    table = next(node.value for node in assigned if ast.unparse(node.target) == "PRESETS")
    assert isinstance(table, ast.Dict)
    lines = first_lines(PRESETS)
    entries = zip(table.keys, table.values, strict=True)
    return {ast.literal_eval(name): lines[ast.unparse(made_by)] for name, made_by in entries if name}


def first_lines(source: Path) -> dict[str, str]:
    """First lines of the docstrings of a file's classes and functions, by name."""
    documented = (
        node for node in ast.parse(source.read_text()).body if isinstance(node, ast.ClassDef | ast.FunctionDef)
    )
    return {node.name: (ast.get_docstring(node) or "").partition("\n")[0] for node in documented}


def artifact_titles() -> dict[str, str]:
    """The first line of each shipped artifact's card, by the artifact's name; nothing else of it is read."""
    return {card.parent.name: _title(card) for card in sorted(ARTIFACTS.glob("*/card.md"))}


def _title(card: Path) -> str:
    with card.open(encoding="utf-8") as lines:
        return lines.readline().strip().lstrip("# ")
