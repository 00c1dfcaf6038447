"""Records: two temperatures over time."""

from __future__ import annotations

import json
import os
from typing import TYPE_CHECKING, Any

from twinlag import _core
from twinlag._columns import Column, finite, numbers, times
from twinlag._errors import RecordError

if TYPE_CHECKING:
    from numpy import float64
    from numpy.typing import NDArray


class Record:
    """Two temperatures over time, checked; missing readings are NaN.

    Parameters
    ----------
    time : array_like, shape (n,)
        Instants, strictly increasing: numbers in `time_unit`, ``datetime64``, ``timedelta64``, ``datetime`` objects or texts such
        as ``"2026-01-31 12:00:00.042"``; ``None`` where `period_s` is given.
    t1, t2 : array_like, shape (n,)
        Readings of both sensors in `unit`. NaN, ``None`` and masked values are missing.
    unit : str
        Unit of the readings and the reference: ``"°C"``, ``"K"`` or ``"°F"``.
    names : tuple of str
        Names of the sensors.
    reference : array_like, shape (n,), optional
        A trusted temperature, which no estimate uses and answers are compared with.
    flow : array_like, shape (n,), optional
        A flow velocity or density in any unit; time constants may go with it.
    position : array_like, shape (n,), optional
        The position of sensors that move, m, such as a depth; time constants may go with their speed.
    period_s : float, optional
        Time from sample to sample, s, in place of `time`.
    time_unit : str
        Unit of `time` where that has numbers: ``"s"``, ``"ms"``, ``"us"``, ``"min"``.
    sampling : {"auto", "uniform", "as-stamped"}
        How stamps are to be understood.
    source : str
        What it is called in messages.

    Raises
    ------
    RecordError
        Arrays of different lengths, times that do not increase, temperatures that cannot be, a channel that is constant or missing.

    Examples
    --------
    >>> import numpy as np, twinlag as tl
    >>> time_s = 0.1 * np.arange(200)
    >>> gas = 20 + 5 * np.sin(time_s)
    >>> tl.Record(time_s, gas, np.roll(gas, 3), names=("bare", "sheathed"))
    <Record 'arrays': bare and sheathed, 200 samples, one every 0.1 s>
    """

    __slots__ = ("_inner",)
    _inner: _core.Record

    def __init__(
        self,
        time: Any,
        t1: Any,
        t2: Any,
        *,
        unit: str = "°C",
        names: tuple[str, str] = ("T1", "T2"),
        reference: Any = None,
        flow: Any = None,
        position: Any = None,
        period_s: float | None = None,
        time_unit: str = "s",
        sampling: str = "auto",
        source: str = "arrays",
    ) -> None:
        first, second = _two_names(names)
        if first == second:
            raise RecordError(f"names: expected two names, got {first!r} twice")
        columns: list[Column] = [(first, unit, numbers(t1, first)), (second, unit, numbers(t2, second))]
        selection: dict[str, Any] = {"t1": 1, "t2": 2, "sampling": sampling}
        others = [("reference", reference, unit), ("flow", flow, ""), ("position", position, "m")]
        for name, values, its_unit in others:
            if values is not None:
                columns.append((name, its_unit, numbers(values, name)))
                selection[name] = len(columns)
        if time is not None:
            columns.append(times(time, time_unit))
            selection["time"] = len(columns)
        if period_s is not None:
            selection["period_s"] = finite(period_s, "period_s")
        elif time is None:
            raise RecordError("expected the instants, time, or the time from one sample to the next, period_s")
        self._inner = _core.Record.from_columns(source, columns, json.dumps(selection))

    @classmethod
    def _of(cls, core: _core.Record) -> Record:
        record = cls.__new__(cls)
        record._inner = core
        return record

    @classmethod
    def from_frame(
        cls,
        frame: Any,
        *,
        time: str | int | None = None,
        t1: str | int | None = None,
        t2: str | int | None = None,
        reference: str | int | None = None,
        flow: str | int | None = None,
        position: str | int | None = None,
        period_s: float | None = None,
        time_unit: str | None = None,
        source: str = "frame",
    ) -> Record:
        """A record of a data frame: pandas, polars, or an xarray dataset of one dimension.

        Columns are chosen by name, or by number from 1; those that are left out are guessed from names and units, as of a file, and
        `notes` says how. An index with a name, of instants, or of decimals that rise, is a column. A unit may stand in a name,
        ``T1 [K]``, in a level of its own below the names, ``("T1", "K")``, or in the attribute ``units`` of a variable of xarray.

        Parameters
        ----------
        frame : DataFrame or Dataset
            The columns, ``(n,)`` each.
        time, t1, t2, reference, flow, position : str or int, optional
            Columns by name, or by number from 1. The last three are never guessed.
        period_s : float, optional
            Time from row to row, s, in place of a column.
        time_unit : str, optional
            Unit of a time column of numbers; it goes before the one in its name.
        source : str
            What it is called in messages.

        Raises
        ------
        RecordError
            It cannot be used: what was expected, what came, what to do.

        Examples
        --------
        >>> import pandas as pd, numpy as np, twinlag as tl
        >>> time = pd.date_range("2026-01-31", periods=100, freq="500ms", name="time")
        >>> frame = pd.DataFrame({"bare_K": 300 + np.sin(np.arange(100)), "thick_K": 300.0 + np.cos(np.arange(100))}, index=time)
        >>> tl.Record.from_frame(frame)
        <Record 'frame': bare and thick, 100 samples, one every 0.5 s>
        """
        columns = _columns_of(frame)
        chosen = {"time": time, "t1": t1, "t2": t2, "reference": reference, "flow": flow, "position": position}
        selection: dict[str, Any] = {name: column for name, column in chosen.items() if column is not None}
        selection.update({name: value for name, value in {"period_s": period_s, "time_unit": time_unit}.items() if value is not None})
        return cls._of(_core.Record.from_columns(source, columns, json.dumps(selection)))

    @property
    def source(self) -> str:
        """What it is called in messages: the file, if it was read from one."""
        return self._inner.source

    @property
    def channels(self) -> tuple[str, str]:
        """Names of the two sensors."""
        return self._inner.channels

    @property
    def notes(self) -> list[str]:
        """How it was read: what was guessed, converted, left out."""
        return self._inner.notes

    @property
    def missing(self) -> int:
        """Number of rows in which a temperature is missing."""
        return self._inner.missing

    @property
    def sample_period_s(self) -> float:
        """Time between samples, s: of uneven ones the median."""
        return self._inner.sample_period_s

    @property
    def time_s(self) -> NDArray[float64]:
        """Instants, s from the first; a copy."""
        return self._inner.time_s

    @property
    def t1_c(self) -> NDArray[float64]:
        """Readings of the first sensor, °C; a copy."""
        return self._inner.t1_c

    @property
    def t2_c(self) -> NDArray[float64]:
        """Readings of the second sensor, °C; a copy."""
        return self._inner.t2_c

    @property
    def reference_c(self) -> NDArray[float64] | None:
        """The reference, °C; a copy."""
        return self._inner.reference_c

    @property
    def flow(self) -> NDArray[float64] | None:
        """The flow velocity or density, in the unit of its column; a copy."""
        return self._inner.flow

    @property
    def speed_m_s(self) -> NDArray[float64] | None:
        """The speed of sensors that move, m/s, of their position; a copy."""
        return self._inner.speed_m_s

    def __len__(self) -> int:
        return len(self._inner)

    def __repr__(self) -> str:
        first, second = self.channels
        period_s = f"{self.sample_period_s:.6g}"
        return f"<Record {self.source!r}: {first} and {second}, {len(self)} samples, one every {period_s} s>"

    def __reduce__(self) -> Any:
        if self.speed_m_s is not None:
            raise TypeError("a record with a position keeps the speed alone and cannot be pickled: pickle what it was made of")
        state: dict[str, Any] = {
            "names": self.channels,
            "reference": self.reference_c,
            "flow": self.flow,
            "sampling": "as-stamped" if self._inner.is_irregular else "uniform",
            "source": self.source,
        }
        return _unpickled, (self.time_s, self.t1_c, self.t2_c, state)

    def to_frame(self) -> Any:
        """A pandas data frame: readings in °C, with the instants in s as its index."""
        import pandas as pd

        first, second = self.channels
        columns = {first: self.t1_c, second: self.t2_c}
        if self.reference_c is not None:
            columns["reference"] = self.reference_c
        return pd.DataFrame(columns, index=pd.Index(self.time_s, name="time_s"))


def _two_names(names: Any) -> tuple[str, str]:
    """The names of both sensors."""
    if isinstance(names, str) or len(names) != 2 or not all(isinstance(name, str) for name in names):
        raise TypeError(f"names: expected the names of both sensors, got {names!r}")
    return tuple(names)


def _unpickled(time_s: Any, t1: Any, t2: Any, state: dict[str, Any]) -> Record:
    return Record(time_s, t1, t2, **state)


def read(
    path: str | os.PathLike[str],
    *,
    time: str | int | None = None,
    t1: str | int | None = None,
    t2: str | int | None = None,
    reference: str | int | None = None,
    flow: str | int | None = None,
    position: str | int | None = None,
    period_s: float | None = None,
    time_unit: str | None = None,
    sampling: str = "auto",
    group: str | None = None,
    join: bool = False,
) -> Record:
    """Read a file of a logger.

    Text in any dialect, Sea-Bird ``.cnv``, LabVIEW ``.lvm``, Arduino logs, xlsx, MDF, TDMS, Parquet, HDF5, netCDF, NumPy, MATLAB: the
    format is known by the first bytes.

    Parameters
    ----------
    path : path-like
        The file.
    time, t1, t2, reference, flow, position : str or int, optional
        Columns by name, or by number from 1. What is left out is guessed, other than the last three, and ``Record.notes`` says how.
    period_s : float, optional
        Time from row to row, s, in place of a column.
    time_unit : str, optional
        Unit of a time column of numbers; it goes before the one in the header.
    sampling : {"auto", "uniform", "as-stamped"}
        How stamps are to be understood.
    group : str, optional
        The sheet, channel group or group of datasets.
    join : bool
        Put the channels of all groups on the stamps of one.

    Raises
    ------
    OSError
        The file cannot be opened.
    RecordError
        It cannot be used: what was expected, what came, in which line, what to do.
    """
    chosen = {
        "time": time,
        "t1": t1,
        "t2": t2,
        "reference": reference,
        "flow": flow,
        "position": position,
        "period_s": period_s,
        "time_unit": time_unit,
    }
    selection = {name: value for name, value in chosen.items() if value is not None}
    core = _core.Record.read(os.fspath(path), json.dumps({**selection, "sampling": sampling}), group, join)
    return Record._of(core)


def _columns_of(frame: Any) -> list[Column]:
    """The columns of a frame that can be read: numbers, instants, texts."""
    if hasattr(frame, "data_vars"):
        return _columns_of_dataset(frame)
    if not hasattr(frame, "columns") or not hasattr(frame, "__getitem__") or hasattr(frame, "collect"):
        got = type(frame).__name__
        raise TypeError(f"expected a data frame of pandas or polars, or a dataset of xarray, got {got}; Record takes arrays")
    columns: list[Column] = []
    index = getattr(frame, "index", None)
    if index is not None and not callable(index):
        kind = getattr(getattr(index, "dtype", None), "kind", None)
        is_rising = kind == "f" and bool(getattr(index, "is_monotonic_increasing", False))
        is_of_time = kind in {"m", "M"} or getattr(index, "tz", None) is not None or is_rising
        if index.name is not None or is_of_time:
            columns.append(_column(index.name if index.name is not None else "time", "", index))
    # Two columns may have one name: in pandas a place gives one of them.
    at_place = getattr(frame, "iloc", None)
    for place, name in enumerate(frame.columns):
        values = frame[name] if at_place is None else at_place[:, place]
        columns.append(_column(_name(name), "", values))
    return columns


def _name(name: Any) -> str:
    """A name of one level, or of several: a unit is the last word of both."""
    return " ".join(str(part) for part in name if str(part)) if isinstance(name, tuple) else str(name)


def _columns_of_dataset(dataset: Any) -> list[Column]:
    variables = {**dataset.coords, **dataset.data_vars}
    units = {name: str(variable.attrs.get("units", "")) for name, variable in variables.items()}
    flat = {name: variable for name, variable in variables.items() if variable.ndim == 1}
    return [_column(name, units[name], variable.values) for name, variable in flat.items()]


def _column(name: Any, unit: str, values: Any) -> Column:
    """A column as it is: of instants, of numbers, or else of texts."""
    import numpy as np

    kind = getattr(getattr(values, "dtype", None), "kind", None)
    try:
        if kind in {"m", "M"} or getattr(getattr(values, "dt", values), "tz", None) is not None:
            _, time_unit, array = times(values, "")
            return str(name), time_unit or unit, array
        if kind in {"i", "u", "f"}:
            return str(name), unit, numbers(values, str(name))
        array = np.asarray(values)
        if array.dtype.kind == "M":
            _, time_unit, array = times(array, "")
            return str(name), time_unit, array
        return str(name), unit, numbers(array, str(name))
    except RecordError:
        # What is no number stays text: dates and times of day are read, and the rest is no sensor.
        return str(name), unit, ["" if cell is None else str(cell) for cell in np.asarray(values)]
