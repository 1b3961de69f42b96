"""Whether two values are the same to the last bit: arrays in type, shape and bytes, floats in their NaNs too."""

from __future__ import annotations

import struct
from dataclasses import fields, is_dataclass

import numpy as np


def assert_same(actual: object, expected: object, where: str = "value") -> None:
    """Compare field by field; the message names the first that differs."""
    assert type(actual) is type(expected), f"{where}: {actual!r} is not {expected!r}"
    if isinstance(actual, np.ndarray) and isinstance(expected, np.ndarray):
        assert (actual.dtype, actual.shape) == (expected.dtype, expected.shape), where
        assert actual.tobytes() == expected.tobytes(), where
    elif isinstance(actual, tuple) and isinstance(expected, tuple):
        assert len(actual) == len(expected), where
        for index, pair in enumerate(zip(actual, expected, strict=True)):
            assert_same(*pair, where=f"{where}[{index}]")
    elif is_dataclass(actual):
        for field in fields(actual):
            assert_same(getattr(actual, field.name), getattr(expected, field.name), f"{where}.{field.name}")
    elif isinstance(actual, np.float32) and isinstance(expected, np.float32):
        assert actual.tobytes() == expected.tobytes(), where
    elif isinstance(actual, float) and isinstance(expected, float):
        assert struct.pack("<d", actual) == struct.pack("<d", expected), where
    else:
        assert actual == expected, where
