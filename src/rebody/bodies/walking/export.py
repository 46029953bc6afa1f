"""A walking policy that was learned here, as an ONNX file with mjlab's metadata: what runtimes on robots read."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from rebody.bodies.walking.onnx_file import NEEDED
from rebody.bodies.walking.trained import TrainedPolicy
from rebody.errors import RebodyError

OPSET, IR_VERSION = 17, 9
"""Old enough for runtimes of the last years."""


def export_onnx(policy: TrainedPolicy, path: Path) -> None:
    """Write it: input `obs` [batch, numbers], output `actions` [batch, joints] in [-1, 1].

    RebodyError where the artifact cannot be read, or the extra 'onnx' is not installed.
    """
    layers = policy.layers
    try:
        import onnx
    except ImportError:
        raise RebodyError(f"'{path}': {NEEDED}") from None
    say, helper, kind = onnx.helper.make_tensor_value_info, onnx.helper, onnx.TensorProto.FLOAT
    tensors = [onnx.numpy_helper.from_array(array, name) for name, array in _arrays(policy)]
    graph = helper.make_graph(
        list(_nodes(helper, len(layers))),
        "walking policy",
        [say("obs", kind, ["batch", policy.observations])],
        [say("actions", kind, ["batch", policy.actions])],
        tensors,
    )
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", OPSET)], producer_name="rebody")
    model.ir_version = IR_VERSION
    helper.set_model_props(model, policy.metadata)
    onnx.checker.check_model(model)
    onnx.save(model, str(path))


def _arrays(policy: TrainedPolicy) -> Iterator[tuple[str, Any]]:
    """Weights and biases; of the last layer those of the most likely action alone."""
    last, actions = len(policy.layers) - 1, policy.actions
    for i, (weight, bias) in enumerate(policy.layers):
        yield f"weight.{i}", weight[:, :actions].copy() if i == last else weight
        yield f"bias.{i}", bias[:actions].copy() if i == last else bias


def _nodes(helper: Any, layers: int) -> Iterator[Any]:
    """Linear layers with SiLU between them, then tanh."""
    x = "obs"
    for i in range(layers):
        yield helper.make_node("Gemm", [x, f"weight.{i}", f"bias.{i}"], [f"linear.{i}"])
        if i == layers - 1:
            yield helper.make_node("Tanh", [f"linear.{i}"], ["actions"])
            return
        yield helper.make_node("Sigmoid", [f"linear.{i}"], [f"gate.{i}"])
        x = f"hidden.{i}"
        yield helper.make_node("Mul", [f"linear.{i}", f"gate.{i}"], [x])
