"""A linear policy as an ONNX file, written without the package `onnx`.

The messages are those of onnx.proto3: each field is its number and wire type, then a
varint, or a length and bytes.
"""

from pathlib import Path

import numpy as np

FLOAT = 1  # TensorProto.FLOAT
IR_VERSION, OPSET = 8, 17


def _varint(value: int) -> bytes:
    out = b""
    while value > 127:
        out += bytes([value & 127 | 128])
        value >>= 7
    return out + bytes([value])


def _number(field: int, value: int) -> bytes:
    return _varint(field << 3) + _varint(value)


def _bytes(field: int, value: bytes | str) -> bytes:
    raw = value.encode() if isinstance(value, str) else value
    return _varint(field << 3 | 2) + _varint(len(raw)) + raw


def _array(name: str, first: int | None, width: int) -> bytes:
    """Return a ValueInfoProto of shape (first, width); None is a free axis."""
    axis = _bytes(2, "n") if first is None else _number(1, first)
    shape = _bytes(1, axis) + _bytes(1, _number(1, width))
    tensor = _number(1, FLOAT) + _bytes(2, shape)
    return _bytes(1, name) + _bytes(2, _bytes(1, tensor))


def write_linear_policy(file: Path, weights: np.ndarray, first: int | None) -> None:
    """Write action = ego @ weights, for `first` egos at a time, or any number."""
    rows, columns = weights.shape
    matrix = _number(1, rows) + _number(1, columns) + _number(2, FLOAT)
    matrix += _bytes(8, "weights") + _bytes(9, weights.astype("<f4").tobytes())
    node = _bytes(1, "ego") + _bytes(1, "weights") + _bytes(2, "action")
    node += _bytes(4, "MatMul")
    graph = _bytes(1, node) + _bytes(2, "policy") + _bytes(5, matrix)
    graph += _bytes(11, _array("ego", first, rows))
    graph += _bytes(12, _array("action", first, columns))
    opset = _bytes(1, "") + _number(2, OPSET)
    file.write_bytes(_number(1, IR_VERSION) + _bytes(7, graph) + _bytes(8, opset))
