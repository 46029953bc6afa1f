"""A stranger's policy is looked at before it is loaded."""

import copy
import pickle

import numpy as np
import pytest
from tests.walking import write_linear

from rebody.bodies.walking.onnx_file import OnnxPolicy
from rebody.errors import RebodyError

onnx = pytest.importorskip("onnx")
WEIGHTS = np.arange(6.0).reshape(3, 2)


def altered(path, change):
    """The file after a change of its model, without a check of our own in the way."""
    model = onnx.load(str(path))
    change(model)
    path.write_bytes(model.SerializeToString())
    return OnnxPolicy(path)


@pytest.fixture
def path(tmp_path):
    return write_linear(tmp_path / "policy.onnx", WEIGHTS, metadata={"joint_names": "a,b"})


@pytest.mark.parametrize("batch", [1, "batch"])
def test_it_acts_robot_by_robot_or_all_at_once(tmp_path, batch):
    policy = OnnxPolicy(write_linear(tmp_path / "policy.onnx", WEIGHTS, batch=batch))
    assert (policy.observations, policy.actions, policy.memories) == (3, 2, {})
    seen = np.random.default_rng(0).normal(size=(5, 3)).astype(np.float32)
    actions, memory = policy(seen, policy.initial(5))
    np.testing.assert_allclose(actions, seen @ WEIGHTS, rtol=1e-5)
    assert memory == {}


def test_each_robot_has_its_own_memory(tmp_path):
    policy = OnnxPolicy(write_linear(tmp_path / "policy.onnx", WEIGHTS, memory=1))
    memory = policy.initial(2)
    memory["h"][1] = 10.0
    for steps in range(3):
        actions, memory = policy(np.zeros((2, 3), np.float32), memory)
        np.testing.assert_allclose(actions, [[steps] * 2, [10 + steps] * 2])


def test_it_says_what_is_in_the_file(path):
    assert OnnxPolicy(path).metadata == {"joint_names": "a,b"}


def test_it_is_copied_without_its_session(path):
    policy = OnnxPolicy(path)
    policy(np.zeros((1, 3), np.float32), {})
    for other in (copy.deepcopy(policy), pickle.loads(pickle.dumps(policy))):
        np.testing.assert_allclose(other(np.ones((1, 3), np.float32), {})[0], [[6.0, 9.0]])


def own_operator(model):
    model.graph.node[0].domain = "evil"
    model.graph.node[0].op_type = "Run"
    model.opset_import.append(onnx.helper.make_opsetid("evil", 1))


def hidden_operator(model):
    inner = onnx.helper.make_graph([onnx.helper.make_node("Run", [], ["x"], domain="evil")], "inner", [], [])
    model.graph.node[0].attribute.append(onnx.helper.make_attribute("body", inner))


def own_function(model):
    model.functions.append(onnx.helper.make_function("own", "f", [], ["y"], [], [onnx.helper.make_opsetid("", 17)]))


def elsewhere(where):
    def change(model):
        tensor = model.graph.initializer[0]
        tensor.ClearField("float_data")
        tensor.data_location = onnx.TensorProto.EXTERNAL
        tensor.external_data.add(key="location", value=where)

    return change


def huge(model):
    model.graph.initializer[0].dims[:] = [100_000, 100_000]


def another_output(model):
    model.graph.output.append(onnx.helper.make_tensor_value_info("product", 1, [1, 2]))


def deep(model):
    graph = onnx.helper.make_graph([], "g", [], [])
    for _ in range(20):
        node = onnx.helper.make_node("Identity", ["x"], ["y"])
        node.attribute.append(onnx.helper.make_attribute("body", graph))
        graph = onnx.helper.make_graph([node], "g", [], [])
    model.graph.node.extend(graph.node)


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (own_operator, "operator 'Run' of domain 'evil' is not a standard one"),
        (hidden_operator, "operator 'Run' of domain 'evil' is not a standard one"),
        (own_function, "it defines operators of its own"),
        (elsewhere("../../etc/passwd"), "'../../etc/passwd', which is not in its own folder"),
        (elsewhere("/etc/passwd"), "'/etc/passwd', which is not in its own folder"),
        (elsewhere(""), "which is not in its own folder"),
        (huge, "its tensors are too large"),
        (another_output, "it must have one output of actions, not 2"),
        (deep, "too deep within each other"),
    ],
)
def test_what_is_refused(path, change, says):
    policy = altered(path, change)
    with pytest.raises(RebodyError, match=f"is refused: .*{says}"):
        _ = policy.actions


def test_what_is_no_policy_at_all(tmp_path):
    for name, content in (("text.onnx", b"not a policy"), ("empty.onnx", b"")):
        (tmp_path / name).write_bytes(content)
        with pytest.raises(RebodyError, match="is refused"):
            _ = OnnxPolicy(tmp_path / name).observations
    with pytest.raises(RebodyError, match=r"cannot read the walking policy .*No such file"):
        _ = OnnxPolicy(tmp_path / "none.onnx").observations
    with pytest.raises(RebodyError, match="a folder; a regular file is needed"):
        _ = OnnxPolicy(tmp_path).observations


def test_observations_of_another_shape_are_refused(tmp_path):
    policy = OnnxPolicy(write_linear(tmp_path / "policy.onnx", WEIGHTS, batch=7))
    with pytest.raises(RebodyError, match="its batch is 7; it must be 1 or any"):
        _ = policy.observations
