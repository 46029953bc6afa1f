"""A stranger's ONNX file: looked at before it is loaded, and run."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from rebody.errors import RebodyError
from rebody.store.files import check_file

LARGEST = 256 * 1024**2
"""Bytes of a file, and of all that it says its tensors hold."""
MOST = 100_000
"""Numbers in an input, an output or a memory."""
STANDARD = ("", "ai.onnx", "ai.onnx.ml")
"""Domains of operators that every runtime knows."""
NEEDED = "walking policies need the extra 'onnx': pip install 'rebody[onnx]'."


@dataclass(frozen=True)
class OnnxPolicy:
    """One input of observations, one output of actions, and memories that it hands on; RebodyError if it is not so."""

    path: Path

    def __getstate__(self) -> dict[str, Any]:
        return {"path": self.path}  # a session cannot be copied

    @cached_property
    def metadata(self) -> dict[str, str]:
        """What the file says of itself."""
        return dict(self._session.get_modelmeta().custom_metadata_map)

    @cached_property
    def observations(self) -> int:
        """Numbers in an observation."""
        return self._width(self._inputs[self._observed])

    @cached_property
    def actions(self) -> int:
        """Numbers in an action."""
        return self._width(self._outputs[self._acted])

    @cached_property
    def memories(self) -> dict[str, tuple[int, ...]]:
        """Shape of each memory of one robot, by its name without `_in`."""
        return {name.removesuffix("_in"): self._shape(name) for name in self._inputs if name.endswith("_in")}

    def initial(self, robots: int) -> dict[str, Float[np.ndarray, "robot ..."]]:
        """Nothing remembered."""
        return {name: np.zeros((robots, *shape), np.float32) for name, shape in self.memories.items()}

    def __call__(
        self, observation: Float[np.ndarray, "robot number"], memory: Mapping[str, Float[np.ndarray, "robot ..."]]
    ) -> tuple[Float[np.ndarray, "robot action"], dict[str, Float[np.ndarray, "robot ..."]]]:
        """Actions and memory after this control step, robot by robot where the file has a batch of one."""
        outputs = [self._acted, *(f"{name}_out" for name in memory)]
        rows = range(len(observation)) if self._is_single or memory else [slice(None)]
        answers = []
        for row in rows:
            own = slice(row, row + 1) if isinstance(row, int) else row
            said = {self._observed: observation[own]} | {f"{name}_in": value[row] for name, value in memory.items()}
            answers.append(self._session.run(outputs, said))
        actions = np.concatenate([answer[0] for answer in answers])
        return actions, {name: np.stack([answer[i + 1] for answer in answers]) for i, name in enumerate(memory)}

    @cached_property
    def _session(self) -> Any:
        check_model(self.path)
        import onnxruntime

        options = onnxruntime.SessionOptions()
        options.intra_op_num_threads = options.inter_op_num_threads = 1
        options.log_severity_level = 3
        try:
            return onnxruntime.InferenceSession(str(self.path), options, providers=["CPUExecutionProvider"])
        except Exception as error:  # of the runtime's own kinds
            raise _refused(self.path, f"the runtime cannot load it: {_first_line(error)}") from error

    @cached_property
    def _inputs(self) -> dict[str, list[Any]]:
        return {each.name: each.shape for each in self._session.get_inputs()}

    @cached_property
    def _outputs(self) -> dict[str, list[Any]]:
        return {each.name: each.shape for each in self._session.get_outputs()}

    @cached_property
    def _observed(self) -> str:
        return self._only([name for name in self._inputs if not name.endswith("_in")], "input of observations")

    @cached_property
    def _acted(self) -> str:
        missing = [name for name in self.memories if f"{name}_out" not in self._outputs]
        if missing:
            raise _refused(self.path, f"memory '{missing[0]}_in' has no '{missing[0]}_out'")
        return self._only([name for name in self._outputs if not name.endswith("_out")], "output of actions")

    @property
    def _is_single(self) -> bool:
        return self._inputs[self._observed][0] == 1

    def _only(self, names: list[str], what: str) -> str:
        if len(names) != 1:
            raise _refused(self.path, f"it must have one {what}, not {len(names)} ({', '.join(names)})")
        return names[0]

    def _width(self, shape: list[Any]) -> int:
        if len(shape) != 2 or not isinstance(shape[1], int) or not 0 < shape[1] <= MOST:
            raise _refused(self.path, f"observations and actions must be [batch, numbers], not {shape}")
        if isinstance(shape[0], int) and shape[0] != 1:
            raise _refused(self.path, f"its batch is {shape[0]}; it must be 1 or any")
        return shape[1]

    def _shape(self, name: str) -> tuple[int, ...]:
        shape = [1 if not isinstance(size, int) else size for size in self._inputs[name]]
        if not 0 < int(np.prod(shape)) <= MOST:
            raise _refused(self.path, f"memory '{name}' is of shape {self._inputs[name]}")
        return tuple(shape)


def check_model(path: Path) -> None:
    """RebodyError for a file that is none, is too large, runs operators of its own, or reads files elsewhere."""
    try:
        import onnx
        import onnxruntime  # noqa: F401 (asked for before anything is read)
    except ImportError:
        raise RebodyError(f"'{path}': {NEEDED}") from None
    try:
        check_file(path, LARGEST)
        model = onnx.load(str(path), load_external_data=False)
    except OSError as error:
        raise RebodyError(f"cannot read the walking policy '{path}': {error.strerror or error}.") from error
    except Exception as error:  # of protobuf's own kinds
        raise _refused(path, f"it is no ONNX file ({_first_line(error)})") from error
    for node in _nodes(model.graph, path):
        if node.domain not in STANDARD:
            raise _refused(
                path, f"its operator {node.op_type!r:.60} of domain {node.domain!r:.60} is not a standard one"
            )
    if model.functions:
        raise _refused(path, "it defines operators of its own")
    _check_tensors(model.graph, path, onnx.TensorProto.EXTERNAL)


def _nodes(graph: Any, path: Path, depth: int = 0) -> Iterator[Any]:
    """Of a graph and the graphs within it."""
    if depth > 8:
        raise _refused(path, "its graphs lie too deep within each other")
    for node in graph.node:
        yield node
        for attribute in node.attribute:
            for inner in (attribute.g, *attribute.graphs):
                yield from _nodes(inner, path, depth + 1)


def _check_tensors(graph: Any, path: Path, external: int) -> None:
    """What it holds, and in which files."""
    held = 0.0
    for tensor in _tensors(graph, path):
        held += float(np.prod([max(1, size) for size in tensor.dims], dtype=float)) * 4
        if held > LARGEST:
            raise _refused(path, f"its tensors are too large (more than {LARGEST >> 20} MB)")
        if tensor.data_location == external:
            where = {entry.key: entry.value for entry in tensor.external_data}.get("location", "")
            if not where or (path.parent / where).resolve().parent != path.parent.resolve():
                raise _refused(path, f"its numbers are in {where!r:.60}, which is not in its own folder")


def _tensors(graph: Any, path: Path) -> Iterator[Any]:
    yield from graph.initializer
    for node in _nodes(graph, path):
        for attribute in node.attribute:
            yield from (attribute.t, *attribute.tensors, *attribute.g.initializer)


def _refused(path: Path, why: str) -> RebodyError:
    return RebodyError(f"the walking policy '{path}' is refused: {why}.")


def _first_line(error: Exception) -> str:
    return (str(error).splitlines() or [type(error).__name__])[0][:200]
