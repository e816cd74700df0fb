# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
"""Arguments that are arrays. What doesn't fit raises a ValueError that names the argument."""

from typing import Any

import numpy as np


def refuse_masked(name: str, array: Any) -> None:
    """Masked values have no number: what an array holds in their place is anything."""
    parts = array if isinstance(array, (list, tuple)) else ()
    if not isinstance(array, np.ma.MaskedArray) and not any(isinstance(part, np.ma.MaskedArray) for part in parts):
        return
    try:
        mask = np.ma.getmaskarray(np.ma.array(array))
    except ValueError:  # Rows of several lengths, which nothing takes.
        return
    if mask.any():
        place = [int(index) for index in np.argwhere(mask)[0]]
        raise ValueError(f"{name} holds {int(mask.sum())} masked value{'s' if mask.sum() > 1 else ''}, the first at "
                         f"{place}: give each a number, as filled() does, or leave out what has none")


def floats(name: str, array: Any, shape: str = "numbers") -> np.ndarray:
    """The array as float64, of any shape. shape: what it is to have, for the message."""
    refuse_masked(name, array)
    try:
        numbers = np.asarray(array)
        if np.iscomplexobj(numbers):
            raise TypeError("complex numbers")
        return numbers.astype(np.float64)
    except (TypeError, ValueError) as wrong:
        raise ValueError(f"{name} takes {shape}, not {_shown(array)}") from wrong


def whole_numbers(name: str, array: Any, shape: str) -> np.ndarray:
    """The array, of any shape and of some type of integers."""
    refuse_masked(name, array)
    try:
        numbers = np.asarray(array)
    except ValueError as wrong:
        raise ValueError(f"{name} must have shape {shape}: rows of one length") from wrong
    if numbers.size == 0:
        numbers = numbers.astype(np.int64)
    if not np.issubdtype(numbers.dtype, np.integer):
        raise ValueError(f"{name} takes whole numbers, not {numbers.dtype}")
    return numbers


def triple(name: str, value: Any, or_one: bool = False) -> np.ndarray:
    """Three numbers, or one for all."""
    taken = "three numbers, or one for all" if or_one else "three numbers"
    numbers = floats(name, value, taken)
    if numbers.shape == () and or_one:
        numbers = np.repeat(numbers, 3)
    if numbers.shape != (3,):
        raise ValueError(f"{name} takes {taken}, not {_shown(value)}")
    return numbers


def pair(name: str, value: Any, what: str) -> Any:
    """Two of something."""
    try:
        low, high = value
    except (TypeError, ValueError) as wrong:
        raise ValueError(f"{name} takes {what}, not {_shown(value)}") from wrong
    return low, high


def number_pair(name: str, value: Any, what: str) -> Any:
    low, high = pair(name, value, what)
    numbers = floats(name, [low, high], what)
    if numbers.shape != (2,):
        raise ValueError(f"{name} takes {what}, not {_shown(value)}")
    return float(numbers[0]), float(numbers[1])


def _shown(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 200 else text[:200] + "..."
