"""What an artifact says is held against what can be: a plain message, before anything is built."""

import copy
import json
import shutil
import struct
from contextlib import suppress
from functools import reduce

import jax
import numpy as np
import pytest
import safetensors.numpy

from rebody.agents import parts
from rebody.bodies.walking.trained import TrainedPolicy
from rebody.errors import RebodyError
from rebody.store import artifact as store
from rebody.store import load_artifact, shipped_artifacts, tree_hash

LOAD = {
    "inference": parts.load_inference,
    "tracker": parts.load_tracker,
    "flat": parts.load_flat,
    "scratch": parts.load_scratch,
    "high-level": parts.load_high_level,
    "step-predictor": parts.load_step_predictor,
    "classifier": parts.load_slots,
}
OF_KIND = {
    "inference": "goal-velocity-stand",
    "tracker": "tracker-cheetah-jump",
    "flat": "flat-goal-velocity-cheetah",
    "scratch": "scratch-cheetah",
    "high-level": "high-level-goal-velocity-stand-cheetah",
    "step-predictor": "step-predictor-cheetah",
    "classifier": "classifier-goal-velocity-stand",
}
NAN, INF = float("nan"), float("inf")
MUTATIONS = 60


@pytest.fixture
def rewritten(tmp_path):
    """A function from a kind and what is to be in its files to the folder of an artifact whose hashes fit."""

    def rewrite(kind, config=None, weights=None):
        folder = tmp_path / f"odd-{kind}"
        shutil.copytree(store.SHIPPED / OF_KIND[kind], folder)
        content = {name: (folder / name).read_bytes() for name in store.HASHED}
        content[store.CONFIG] = content[store.CONFIG] if config is None else config
        content[store.WEIGHTS] = content[store.WEIGHTS] if weights is None else weights
        for name, data in (content | {store.MANIFEST: store._manifest(kind, content)}).items():
            (folder / name).write_bytes(data)
        return str(folder)

    return rewrite


def changed(config, key, value):
    """A copy with another value where a dotted key leads, numbers for entries of lists; `...` for none."""
    config = copy.deepcopy(config)
    *way, last = (int(name) if name.isdecimal() else name for name in key.split("."))
    inner = reduce(lambda settings, name: settings[name], way, config)
    if value is ...:
        del inner[last]
    else:
        inner[last] = value
    return json.dumps(config).encode()


def refused(kind, folder, *says):
    with pytest.raises(RebodyError) as error:
        LOAD[kind](folder)
    for word in (f"odd-{kind}", *says):
        assert word in str(error.value)
    assert len(str(error.value)) < 1000


@pytest.mark.parametrize(("name", "kind"), [each for each in shipped_artifacts() if each[1] in LOAD])
def test_every_shipped_artifact_holds_what_its_file_holds(name, kind):
    loaded, arrays = LOAD[kind](name), load_artifact(name, kind).arrays
    which = {"tracker": "tracker", "flat": "policy", "high-level": "policy", "step-predictor": "predictor"}
    assert tree_hash(getattr(loaded, which.get(kind, "parts"))) == tree_hash(arrays)


@pytest.mark.parametrize("name", [name for name, kind in shipped_artifacts() if kind not in LOAD])
def test_a_shipped_walking_policy_holds_what_its_file_holds(name):
    arrays = load_artifact(name, "walking").arrays
    layers = TrainedPolicy(name).layers
    assert len(arrays) == 2 * len(layers)
    for i, (weight, bias) in enumerate(layers):
        np.testing.assert_array_equal(weight, arrays[f"weights.{i}"])
        np.testing.assert_array_equal(bias, arrays[f"biases.{i}"])


def families(key):
    """What a set of families cannot be, where it stands under a key."""
    first, quantity = f"{key}.families.0", f"{key}.families.0.quantity"
    return [
        (key, []),
        (key, None),
        (key, ...),
        (f"{key}.families", []),
        (f"{key}.families", {}),
        (f"{key}.families", ["goal"]),
        (f"{key}.colour", "red"),
        (f"{first}.name", "velocity"),
        (f"{first}.name", "\x1b[31m"),
        (f"{first}.name", "g" * 10**6),
        (f"{first}.name", ...),
        (f"{first}.targets", []),
        (f"{first}.targets", {"low": [0.0], "high": [1.0]}),
        (f"{first}.targets", [{"low": [NAN], "high": [1.0]}]),
        (f"{first}.targets", [{"low": [-1.0], "high": [INF]}]),
        (f"{first}.targets", [{"low": [1.0], "high": [-1.0]}]),
        (f"{first}.targets", [{"low": [0.0], "high": [0.0]}]),
        (f"{first}.targets", [{"low": [1.0]}]),
        (f"{first}.targets", [{"low": [1.0, 1.0], "high": [2.0, 2.0]}]),
        (f"{first}.targets", [{"low": [1.0], "high": [2.0, 2.0]}]),
        (f"{first}.law", "absolute"),
        (f"{first}.law_source", "ab12"),
        (f"{first}.floor", 0.0),
        (f"{first}.floor", NAN),
        (f"{first}.tolerance", -1.0),
        (f"{first}.settle", "first"),
        (f"{first}.colour", "red"),
        (f"{first}.directions", [{"name": "up", "towards": [0.0, 1.0]}]),
        (f"{first}.directions", [{"name": "up", "towards": [NAN]}]),
        (f"{first}.smell", "sweet"),
        (f"{quantity}.components", []),
        (f"{quantity}.components", ["colour"]),
        (f"{quantity}.components", ["x", "x"]),
        (f"{quantity}.components", ["x", "y"]),
        (f"{quantity}.frame", "robot"),
        (f"{quantity}.unit", ...),
    ]


MODULE = [
    ("contract", []),
    ("contract", None),
    ("contract", ...),
    ("contract.version", 1),
    ("contract.version", 3),
    ("contract.version", None),
    ("contract.fields", []),
    ("contract.fields", ["vx", "x"]),
    ("contract.fields", ["x", "vx", "colour"]),
    ("contract.fields", ["x", "vx", "vx"]),
    ("contract.fields", "x"),
    ("contract.window", 0),
    ("contract.window", 31),
    ("contract.window", 10**400),
    *families("contract.families"),
    ("contract.decision_dt", 0.0),
    ("contract.colour", "red"),
    ("inference.fields", ["x", "vx", "colour"]),
    ("inference.scales", [1.0]),
    ("inference.scales", [1.0, 1.0, NAN]),
    ("inference.scales", [1.0, 1.0, 0.0]),
    ("inference.scales", [1e-300] * 3),
    ("inference.units", 10**9),
    ("inference.latent", 0),
    ("inference.latent", 4.5),
    ("inference.kinds", 9),
    ("inference.kinds", 5),
    ("inference.reward_scale", NAN),
    ("inference.reward_scale", 1e-300),
    ("inference.window", "32"),
    ("inference.colour", "red"),
]
MALFORMED = {
    "inference": [
        *MODULE,
        ("high_level.fields", ["x", "colour", "vx"]),
        ("high_level.fields", []),
        ("high_level.scales", [1.0]),
        ("high_level.hidden", [10**400]),
        ("high_level.hidden", [1] * 10_000),
        ("high_level.hidden", None),
        ("high_level.projections", -1),
        ("toy", None),
        ("toy.kind", "spring"),
        ("toy.kind", ["full"]),
        ("toy.kind", ...),
        ("toy.mass", 0.0),
        ("toy.mass", NAN),
        ("toy.colour", 1.0),
        ("mixture.maximum", 4097),
        ("mixture.maximum", -1),
        ("mixture.covariance_type", "round"),
        ("training.seed", NAN),
        ("colour", "red"),
    ],
    "tracker": [
        *families("families"),
        ("robot", 3),
        ("robot", "r" * 10**6),
        ("robot", "\x1b[31m"),
        ("\ud800", 1),
        ("observations", 0),
        ("observations", 10**12),
        ("actions", "6"),
        ("hidden", [0, 8]),
        ("hidden", {"a": 1}),
        ("control_dt", -0.05),
        ("colour" * 10_000, "red"),
    ],
    "flat": [
        ("places", [[]]),
        ("places", [["x", 10.0]]),
        ("places", {"x": 10.0}),
        ("places.0.scales", [0.0]),
        ("places.0.scales", [1e-300]),
        ("places.0.scales", [1.0, 1.0]),
        ("places.0.scales", ...),
        ("places.0.quantity", "x"),
        ("places.0.quantity.components", ["colour"]),
        ("places.0.quantity.components", []),
        ("places.0.quantity.components", ["x", "x"]),
        ("places.0.colour", "red"),
        ("reach", INF),
        ("inference_hash", 7),
        ("inference_hash", ...),
        ("projections", 10**400),
    ],
    "scratch": [*MODULE, ("robot", ...), ("observations", None), ("actions", 5000)],
    "high-level": [
        ("view", []),
        ("view.fields", ["colour", "vx", "x"]),
        ("view.scales", []),
        ("view.places", [["colour", 1.0]]),
        ("view.places.0.scales", [0.0]),
        ("view.places.0.quantity.components", ["colour"]),
        ("slots", {}),
        ("slots", []),
        ("slots", ["goal"]),
        ("slots.0.scales", [NAN]),
        ("slots.0.scales", [0.0]),
        ("slots.0.scales", []),
        ("slots.0.quantity.components", ["gaol"]),
        ("tracker_hash", "0" * 65),
    ],
    "step-predictor": [*families("families"), ("observations", 1e300), ("tracker_hash", None)],
    "classifier": [
        ("families", ["goal", "goal", "stand"]),
        ("families", [0, 1, 2]),
        ("families", "goal"),
        ("families", ["goal", "\x1b[31m", "stand"]),
        ("families", []),
        ("latent", -1),
        ("components", 10**7),
        ("hidden", [4097]),
    ],
}


@pytest.mark.parametrize(
    ("kind", "key", "value"), [(kind, key, value) for kind, rows in MALFORMED.items() for key, value in rows]
)
def test_a_malformed_config_is_refused_by_its_key(kind, key, value, rewritten):
    config = load_artifact(OF_KIND[kind], kind).config
    named = key.split(".")[0][:50] if key.isprintable() else "no text"
    refused(kind, rewritten(kind, changed(config, key, value)), named)


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"[]",
        b"\xff\xfe{}",
        b'{"contract": ' + b"[" * 100_000 + b"]" * 100_000 + b"}",
        b'{"training": ' + b'{"a":' * 900 + b"1" + b"}" * 900 + b"}",
        b'{"robot": ' + b"9" * 5000 + b"}",
        b'{"robot": "cheetah"',
    ],
    ids=["empty", "list", "utf-16", "deep", "nested", "long", "cut"],
)
def test_a_config_that_is_no_json_object_is_refused(content, rewritten):
    refused("tracker", rewritten("tracker", content))


def described(dtype, shape, data):
    """A safetensors file with one array."""
    header = json.dumps({"w": {"dtype": dtype, "shape": shape, "data_offsets": [0, len(data)]}}).encode()
    return struct.pack("<Q", len(header)) + header + data


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (described("BF16", [2], b"\0" * 4), "BF16"),
        (described("F8_E4M3", [2], b"\0" * 2), "F8_E4M3"),
        (described("C64", [1], b"\0" * 8), "does not fit"),
        (described("F32", [2**60], b"\0" * 4), "is damaged"),
        (described("F32", [1], b"\0\0\xc0\x7f"), "not finite, in w"),
        (b"", "is damaged"),
    ],
)
def test_odd_weights_are_refused(content, says, rewritten):
    refused("tracker", rewritten("tracker", weights=content), says)


@pytest.mark.parametrize("value", [NAN, INF, -INF])
@pytest.mark.parametrize("kind", OF_KIND)
def test_weights_that_are_not_finite_are_refused(kind, value, rewritten):
    arrays = load_artifact(OF_KIND[kind], kind).arrays
    name = sorted(name for name, array in arrays.items() if array.dtype.kind == "f")[-1]
    arrays[name] = np.full_like(arrays[name], value)
    refused(kind, rewritten(kind, weights=safetensors.numpy.save(arrays)), "not finite", name)


@pytest.mark.parametrize("value", [99, -1, 3])
def test_indices_of_no_family_are_refused(value, rewritten):
    arrays = load_artifact(OF_KIND["classifier"], "classifier").arrays
    arrays["of_cluster"][-1] = value
    weights = safetensors.numpy.save(arrays)
    refused("classifier", rewritten("classifier", weights=weights), "of_cluster", str(value))


@pytest.mark.parametrize("kind", OF_KIND)
def test_weights_of_other_shapes_or_types_are_named(kind, rewritten):
    arrays = load_artifact(OF_KIND[kind], kind).arrays
    first, second, *_ = sorted(arrays)
    arrays |= {first: arrays[first].astype(np.float64), second: arrays[second][..., None]}
    refused(kind, rewritten(kind, weights=safetensors.numpy.save(arrays)), f"{first} is float64", f"{second} is ")


@pytest.mark.parametrize("kind", OF_KIND)
def test_nothing_is_allocated_before_all_shapes_fit(kind, monkeypatch):
    templates = []
    monkeypatch.setattr(parts, "arrays_into_tree", lambda template, *_: templates.append(template) or template)
    with suppress(TypeError):  # a classifier's indices are looked at once they are there
        LOAD[kind](OF_KIND[kind])
    assert {type(leaf) for leaf in jax.tree.leaves(templates)} == {jax.ShapeDtypeStruct}


VALUES = (
    None, True, -1, 0, 3, 10**400, 1e300, NAN, INF, "", "x", "goal", "\0" * 9999, [], {}, [[]], [None], [1.0, -1.0],
    {"goal": [NAN, 1]}, ["x"] * 9999, [1] * 999,
)  # fmt: skip


def mutate(rng, settings):
    """Changes one thing, anywhere but in what is only told of the training."""
    names = list(range(len(settings))) if isinstance(settings, list) else [n for n in settings if n != "training"]
    if not names:
        return
    name = names[rng.integers(len(names))]
    if isinstance(settings[name], list | dict) and rng.random() < 0.7:
        return mutate(rng, settings[name])
    match rng.integers(4):
        case 0:
            del settings[name]
        case 1 if isinstance(settings, dict):
            settings[f"{name}_"] = settings[name]
        case _:
            settings[name] = VALUES[rng.integers(len(VALUES))]


@pytest.mark.parametrize("kind", OF_KIND)
def test_any_config_loads_or_is_refused(kind, rewritten, tmp_path):
    rng, sound = np.random.default_rng(0), load_artifact(OF_KIND[kind], kind).config
    for _ in range(MUTATIONS):
        config = copy.deepcopy(sound)
        mutate(rng, config)
        with suppress(RebodyError):
            LOAD[kind](rewritten(kind, json.dumps(config).encode()))
        shutil.rmtree(tmp_path / f"odd-{kind}")
