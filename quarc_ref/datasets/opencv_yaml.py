"""Reads matrices, numbers and lists of names from YAML files that OpenCV's FileStorage writes."""

import re

import cv2
import numpy as np

from quarc_ref.datasets.calibration import Float64Array

Node = Float64Array | float | str | list[str]

_MAX_BYTES = 1 << 22
_MAX_NUMBERS = 1 << 10  # maximum size of a matrix; a calibration needs at most 16
_MAX_NODES = 1 << 14
# An item of a list such as 00 or 08, without quotes; OpenCV reads it as an octal number.
_UNQUOTED_NAME = re.compile(
    r"(^[ \t]*-[ \t]+|[\[,][ \t]*)(0\d+)(?=[ \t\r]*(?:[,\]]|$))", re.MULTILINE
)
_STORAGE_FLAGS = cv2.FILE_STORAGE_READ | cv2.FILE_STORAGE_MEMORY | cv2.FILE_STORAGE_FORMAT_YAML


def parse_yaml(data: bytes) -> dict[str, Node]:
    """Parse a YAML file of OpenCV into values by name; matrices become flat float64 arrays.

    Args:
        data: The whole file.

    Raises:
        ValueError: The file is not a YAML file of OpenCV, or is too large.
    """
    if len(data) > _MAX_BYTES:
        message = f"the file has more than {_MAX_BYTES:,} bytes"
        raise ValueError(message)
    text = data.decode("utf-8")  # a UnicodeDecodeError is a ValueError
    if "\0" in text or not text.startswith("%YAML"):
        message = "the file does not begin with %YAML"
        raise ValueError(message)
    text = _UNQUOTED_NAME.sub(r'\1"\2"', text)
    try:
        storage = cv2.FileStorage(text, _STORAGE_FLAGS)
        root = storage.root()
        names = root.keys()[:_MAX_NODES] if root.isMap() else []
        return {name: _convert_node(root.getNode(name)) for name in names}
    except (cv2.error, SystemError, UnicodeDecodeError) as error:
        reason = str(error).strip().splitlines()[-1] if str(error).strip() else "malformed"
        message = f"OpenCV cannot read the file as YAML ({reason})"
        raise ValueError(message) from error


def _convert_node(node: cv2.FileNode) -> Node:
    if node.isMap():
        # The matrix is read number by number, because `rows` and `cols` in the file may be wrong.
        return _read_numbers(node.getNode("data"))
    if node.isSeq():
        return [_read_name(node.at(index)) for index in range(min(node.size(), _MAX_NUMBERS))]
    return node.string() if node.isString() else float(node.real())


def _read_name(node: cv2.FileNode) -> str:
    return node.string() if node.isString() else f"{node.real():g}"


def _read_numbers(node: cv2.FileNode) -> Float64Array:
    count = min(node.size(), _MAX_NUMBERS) if node.isSeq() else 0
    items = [node.at(index) for index in range(count)]
    return np.array([item.real() if item.isInt() or item.isReal() else np.nan for item in items])
