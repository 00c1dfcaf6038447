"""What people have as columns, as arrays that the compiled part takes."""

from __future__ import annotations

import math
import operator
from typing import TYPE_CHECKING, Any

from twinlag._errors import RecordError

if TYPE_CHECKING:
    from numpy import float64
    from numpy.typing import NDArray

Column = tuple[str, str, Any]
"""Name, unit, and an array of doubles, of nanoseconds since 1970-01-01, or a list of texts."""


LATEST_STAMP_S = 1e11
"""Seconds since 1970 up to which a stamp may be one: to the year 5138. Larger ones count something shorter."""


def finite(value: Any, name: str) -> float:
    """A finite number, whether of Python or of NumPy.

    >>> finite(2, "window_s")
    2.0
    """
    number = None if isinstance(value, str) else _number(value)
    if number is None:
        raise TypeError(f"{name}: expected a number, got {value!r}")
    if not math.isfinite(number):
        raise ValueError(f"{name}: expected a finite number, got {value!r}")
    return number


def count(value: Any, name: str) -> int:
    """A whole number from 0, whether of Python or of NumPy.

    >>> count(2, "seed")
    2
    """
    try:
        whole = None if _is_bool(value) else operator.index(value)
    except TypeError:
        whole = None
    if whole is None:
        raise TypeError(f"{name}: expected a whole number, got {value!r}")
    if whole < 0:
        raise ValueError(f"{name}: expected a whole number from 0, got {value!r}")
    return whole


def flag(value: Any, name: str) -> bool:
    """True or false, whether of Python or of NumPy.

    >>> flag(True, "best_effort")
    True
    """
    if not _is_bool(value):
        raise TypeError(f"{name}: expected True or False, got {value!r}")
    return bool(value)


def _number(value: Any) -> float | None:
    """The value as a double; ``None`` where it is no number, as true and false are none."""
    try:
        return None if _is_bool(value) else float(value)
    except (TypeError, ValueError, OverflowError):
        return None


def _is_bool(value: Any) -> bool:
    return type(value).__name__ in {"bool", "bool_"}


def _is_missing(value: Any) -> bool:
    """Whether an object stands for a missing value: of Python, NumPy or pandas."""
    return value is None or type(value).__name__ in {"NAType", "NaTType"} or (isinstance(value, float) and math.isnan(value))


def _one_dimensional(values: Any, name: str) -> Any:
    """The values as an array, checked for its shape."""
    import numpy as np

    array = np.ma.filled(values.astype(float), np.nan) if isinstance(values, np.ma.MaskedArray) else np.asarray(values)
    if array.ndim != 1:
        raise RecordError(f"{name}: expected one value for each row, got an array of shape {array.shape}")
    return array


def numbers(values: Any, name: str) -> NDArray[float64]:
    """Doubles; a value that is missing is NaN.

    >>> numbers([20, None, 21], "t1")
    array([20., nan, 21.])
    """
    import numpy as np

    array = _one_dimensional(values, name)
    if array.dtype.kind in "SU":
        bad = next((row for row, cell in enumerate(array) if _number(cell) is None), None)
        such = "" if bad is None else f", such as {str(array[bad])!r} in row {bad + 1}"
        raise RecordError(f"{name}: expected numbers, got text{such}")
    if array.dtype.kind in "cmMbV":
        raise RecordError(f"{name}: expected numbers, got values of type {array.dtype}")
    if array.dtype == object:
        return _of_objects(array, name)
    try:
        return np.ascontiguousarray(array, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise RecordError(f"{name}: expected numbers, got values of type {array.dtype}") from error


def _of_objects(array: Any, name: str) -> NDArray[float64]:
    """Doubles of objects, of which some may be missing in one way or another."""
    import numpy as np

    out = np.empty(len(array))
    for row, value in enumerate(array):
        number = math.nan if _is_missing(value) else _number(value)
        if number is None:
            raise RecordError(f"{name}: expected a number, got {value!r} in row {row + 1}")
        out[row] = number
    return out


def _without_zone(values: Any) -> Any:
    """Stamps with a zone as stamps of UTC, as arrays keep them."""
    accessor = getattr(values, "dt", values)
    convert = getattr(accessor, "tz_convert", None)
    if convert is None or getattr(accessor, "tz", None) is None:
        return values
    utc = convert("UTC")
    return getattr(utc, "dt", utc).tz_localize(None)


def times(values: Any, unit: str) -> Column:
    """The column of instants: seconds, or whatever `unit` says, `datetime64`, `timedelta64`, or `datetime` objects."""
    import datetime

    import numpy as np

    array = _one_dimensional(_without_zone(values), "time")
    if array.dtype == object and len(array) and isinstance(array[0], datetime.datetime):
        utc = datetime.timezone.utc
        zoned = [bool(getattr(stamp, "tzinfo", None)) for stamp in array if not _is_missing(stamp)]
        if any(zoned) and not all(zoned):
            raise RecordError("time: expected instants that all have a zone, or none, got both: say which zone those without one are of")

        def naive(stamp: Any) -> Any:
            return stamp.astimezone(utc).replace(tzinfo=None) if getattr(stamp, "tzinfo", None) else stamp

        array = np.array([naive(stamp) for stamp in array], dtype="datetime64[ns]")
    if array.dtype.kind == "M":
        return "time", "", np.ascontiguousarray(array.astype("datetime64[ns]").view(np.int64))
    if array.dtype.kind == "m":
        return "time", "s", numbers(array / np.timedelta64(1, "s"), "time")
    if array.dtype.kind in "US":
        return "time", "", [str(cell) for cell in array]
    if array.dtype == object and any(isinstance(cell, str) for cell in array):
        others = [cell for cell in array if not isinstance(cell, str) and not _is_missing(cell)]
        if others:
            raise RecordError(f"time: expected instants as text, got {others[0]!r} among them")
        return "time", "", [cell if isinstance(cell, str) else "" for cell in array]
    instants = numbers(array, "time")
    if unit == "s" and len(instants) and abs(instants[0]) > LATEST_STAMP_S:
        raise RecordError(f"time: {instants[0]:.6g} s is no instant that anybody has seen: say what it counts, as time_unit='ms'")
    return "time", unit, instants
