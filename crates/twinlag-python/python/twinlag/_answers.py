"""Answers of the verbs."""

from __future__ import annotations

import copy
import datetime
import html
import json
import os
from typing import TYPE_CHECKING, Any

from twinlag import _core
from twinlag._files import replace
from twinlag._part import Effect, Part, Sensor, Sensors, part_of, quantity

if TYPE_CHECKING:
    from numpy import float64
    from numpy.typing import NDArray

    from twinlag._model import Model


class Answer:
    """What a verb says. The fields of the program's JSON are attributes: ``answer.status``, ``answer.warnings``.

    Not made by its constructor, but by the verbs.
    """

    __slots__ = ("_fields", "_inner", "_pickled_model", "_pickled_samples", "_series")
    _inner: _core.Answer | None
    _fields: dict[str, Any]
    _series: dict[str, Any]
    _pickled_model: str | None
    _pickled_samples: Any

    def __init__(
        self,
        inner: _core.Answer | None,
        fields: dict[str, Any],
        series: dict[str, Any],
        pickled_model: str | None = None,
        pickled_samples: Any = None,
    ) -> None:
        self._inner = inner
        self._fields = fields
        self._series = series
        self._pickled_model = pickled_model
        self._pickled_samples = pickled_samples
        for values in series.values():
            if hasattr(values, "setflags"):
                values.setflags(write=False)

    @classmethod
    def _of(cls, inner: _core.Answer) -> Any:
        return cls(inner, json.loads(inner.json()), dict(inner.series()))

    @property
    def _model_fields(self) -> dict[str, Any]:
        """The fields of the fit that the answer rests on."""
        return self._fields.get("final", self._fields)  # type: ignore[no-any-return]

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_"):
            raise AttributeError(name)
        for fields in (self._fields, self._model_fields):
            if name in fields:
                return part_of(fields[name])
        raise AttributeError(f"no field {name!r}; there are {', '.join(self._fields)}")

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *self._fields, *self._model_fields]

    def __reduce__(self) -> Any:
        return type(self), (None, self._fields, self._series, self._model_text())

    @property
    def status(self) -> str:
        """``ok``, ``at-bound``, ``not-identifiable`` or ``model-rejected``."""
        return self._model_fields["status"]  # type: ignore[no-any-return]

    @property
    def ok(self) -> bool:
        """Whether both time constants are determined and only noise is left over."""
        return self.status == "ok"

    @property
    def sensors(self) -> Sensors:
        """Both sensors, by the name of the channel, or as 0 and 1."""
        return Sensors(self._model_fields["sensors"])

    @property
    def difference(self) -> Part:
        """By how much the second sensor is slower: ``value``, ``interval_95_s``, ``grade``, ``because``."""
        return Part(self._model_fields["time_constant_difference_s"])

    def to_dict(self) -> dict[str, Any]:
        """The answer as the program's ``--json`` has it; a copy."""
        return copy.deepcopy(self._fields)

    def to_frame(self) -> Any:
        """A pandas data frame with a row for each number: value, ends of the 95 % interval, unit, grade, reason."""
        import pandas as pd

        return pd.DataFrame(self._rows(), columns=["of", "number", "value", "low", "high", "unit", "grade", "because"])

    def _rows(self) -> list[tuple[Any, ...]]:
        rows = []
        for channel, sensor in self.sensors.items():
            rows.append((channel, "time constant", sensor.time_constant_s, *_ends(sensor.interval), "s", sensor.status, sensor.because))
        difference = self.difference
        ends = _ends(difference["interval_95_s"])
        rows.append(("both", "difference", difference["value"], *ends, "s", difference["grade"], difference["because"]))
        return rows

    def report(self, path: str | os.PathLike[str], *, static: bool = False) -> None:
        """Write the answer as a page: one HTML file that needs no other.

        Parameters
        ----------
        path : path-like
            The file. One that exists is overwritten.
        static : bool
            Without a script, for print and mail.
        """
        now = datetime.datetime.now().astimezone()
        page = self._asked().page(now.strftime("%Y-%m-%d %H:%M %Z"), static, False)
        if page is None:
            raise ValueError("a characterisation has no page: a diagnosis has")
        replace(path, page)

    def _model_text(self) -> str | None:
        return self._pickled_model if self._inner is None else self._inner.model()

    def _asked(self) -> _core.Answer:
        if self._inner is None:
            raise ValueError("the answer was pickled, and has its numbers but not the record: ask again for a page or a picture")
        return self._inner

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {self._verdict()}: {self.sensors!r}>"

    def _verdict(self) -> str:
        return self.status

    def _headline(self) -> str:
        return f"{type(self).__name__}: {self._verdict()}"

    def __str__(self) -> str:
        lines = [self._headline()]
        lines.extend(self._lines())
        lines.extend(f"warning: {warning}" for warning in (*self._fields.get("remarks", ()), *self._model_fields["warnings"]))
        return "\n".join(lines)

    def _lines(self) -> list[str]:
        lines = [f"  {channel}: time constant {quantity(sensor)}" for channel, sensor in self.sensors.items()]
        lines.extend(f"    {sensor.because}" for sensor in self.sensors.values() if sensor.status != "go")
        return lines

    def _repr_html_(self) -> str:
        page = None if self._inner is None else self._inner.page("", True, True)
        headline = f"<p><b>{html.escape(self._headline())}</b></p>"
        return headline + (self._table_html() if page is None else _framed(page, self._headline()))

    def _table_html(self) -> str:
        head = "".join(f"<th>{name}</th>" for name in ("", "", "value", "95 % interval", "grade"))
        body = "".join(_html_row(row) for row in self._rows())
        return f"<table><tr>{head}</tr>{body}</table>"


def _ends(interval: Any) -> tuple[float | None, float | None]:
    return (None, None) if interval is None else (interval[0], interval[1])


def _framed(page: str, title: str) -> str:
    """A page in a frame of its own, so that its style is not that of the notebook, and nothing in it runs."""
    style = "width: 100%; height: 46rem; border: 0"
    return f'<iframe sandbox srcdoc="{html.escape(page)}" title="{html.escape(title)}" style="{style}"></iframe>'


def _html_row(row: tuple[Any, ...]) -> str:
    of, number, value, low, high, unit, grade, because = row
    shown = "–" if value is None else f"{value:.5g} {unit}"
    within = "" if low is None else f"[{low:.5g}, {high:.5g}]"
    cells = (of, number, shown, within)
    cells_html = "".join(f"<td>{html.escape(str(cell))}</td>" for cell in cells)
    return f'<tr>{cells_html}<td title="{html.escape(because)}">{html.escape(grade)}</td></tr>'


class Characterisation(Answer):
    """Both time constants of a record, of `characterise`."""

    __slots__ = ()


class Diagnosis(Answer):
    """What two lags leave over, and which effects account for it, of `diagnose`."""

    __slots__ = ()

    @property
    def verdict(self) -> str:
        """``adequate``, ``explained``, ``partly-explained`` or ``unexplained``."""
        return self._fields["verdict"]  # type: ignore[no-any-return]

    @property
    def effects(self) -> list[Effect]:
        """The effects that were found."""
        return [Effect(effect) for effect in self._fields["effects"]]

    @property
    def error(self) -> Part:
        """The errors ``before`` and ``after`` the effects."""
        return Part(self._fields["error"])

    @property
    def model(self) -> Model:
        """The model, to be used on other records of the rig."""
        from twinlag._model import Model

        return Model(json.loads(self._model_text() or "null"))

    def plot(self, ax: Any = None) -> Any:
        """Draw both time constants with their intervals, before and after; returns the axes."""
        from twinlag import _plot

        return _plot.time_constants(self, ax)

    def _verdict(self) -> str:
        return self.verdict

    def _lines(self) -> list[str]:
        lines = super()._lines()
        for effect in self.effects:
            lines.append(f"  {effect['effect']} in {effect['channel'] or 'both'}: {effect['explanation']}")
            for name, number in effect.numbers.items():
                lines.append(f"    {name} {quantity(number, 'value', 'interval_95')}")
        return lines

    def _rows(self) -> list[tuple[Any, ...]]:
        rows = super()._rows()
        for effect in self.effects:
            of = effect["effect"] + (f" in {effect['channel']}" if effect["channel"] else "")
            for name, number in effect.numbers.items():
                ends = _ends(number["interval_95"])
                rows.append((of, name, number["value"], *ends, number["unit"], number["grade"], number["because"]))
        return rows


class _WithSeries(Answer):
    __slots__ = ()

    @property
    def time_s(self) -> NDArray[float64]:
        """Instants, s; empty where there is no answer."""
        return self._series["time_s"]  # type: ignore[no-any-return]

    @property
    def grade(self) -> str:
        """Whether it may be used: ``go``, ``conditional`` or ``no-go``."""
        return self._fields["grade"]  # type: ignore[no-any-return]

    @property
    def because(self) -> str:
        """Why it has that grade."""
        return self._fields["because"]  # type: ignore[no-any-return]

    @property
    def status(self) -> str:
        """``ok``, or ``not-identifiable`` where there is no answer."""
        return self._fields["status"]  # type: ignore[no-any-return]

    def to_frame(self, index: Any = None) -> Any:
        """A pandas data frame of the series.

        Parameters
        ----------
        index : Index, optional
            The index of the frame that the record is of: the series then has its rows, so that
            ``pd.concat([frame, answer.to_frame(frame.index)], axis=1)`` puts it beside the readings. Rows without an answer are NaN, and
            so are rows in which a temperature is missing beside rows that are absent. Without an index it is the instants in s, one for
            each sample, missing ones among them.

        Raises
        ------
        ValueError
            An index of another length than the record, or a track of windows, which have instants of their own.
        """
        frame = self._frame()
        if index is None:
            return frame.set_index("time_s")
        samples = self._samples_of_rows()
        if len(index) != len(samples):
            raise ValueError(f"index: expected one of the record's {len(samples)} rows, got {len(index)}")
        placed = frame.drop(columns="time_s").reindex(samples)
        placed.index = index
        return placed

    def _frame(self) -> Any:
        import pandas as pd

        return pd.DataFrame(self._series)

    def _samples_of_rows(self) -> Any:
        """For each row of the record the index of its sample in the series, −1 where it has none."""
        import numpy as np

        if self._inner is None and self._pickled_samples is not None:
            return self._pickled_samples
        return np.array([-1 if sample is None else sample for sample in self._asked().samples_of_rows()], dtype=np.int64)

    def __reduce__(self) -> Any:
        try:
            samples = self._samples_of_rows()
        except ValueError:  # windows have no rows
            samples = None
        return type(self), (None, self._fields, self._series, self._model_text(), samples)

    def _verdict(self) -> str:
        return f"{self.status}, {self.grade}"


class Compensation(_WithSeries):
    """The gas temperature of a record, of `compensate`."""

    __slots__ = ()

    @property
    def gas_c(self) -> NDArray[float64]:
        """The gas temperature, °C; empty where it may not be used."""
        return self._series["gas_C"]  # type: ignore[no-any-return]

    @property
    def gas_std_k(self) -> NDArray[float64]:
        """Its standard deviation, K."""
        return self._series["gas_std_K"]  # type: ignore[no-any-return]

    def _frame(self) -> Any:
        return super()._frame().assign(grade=self.grade)

    @property
    def model(self) -> Model | None:
        """The model that it rests on, with what the gas is like; ``None`` where there is no gas temperature."""
        from twinlag._model import Model

        text = self._model_text()
        return None if text is None else Model(json.loads(text))

    def to_xarray(self) -> Any:
        """An xarray dataset of the gas temperature and its standard deviation over ``time_s``."""
        import xarray as xr

        variables = {
            "gas_temperature": ("time_s", self.gas_c, {"units": "degC"}),
            "gas_temperature_std": ("time_s", self.gas_std_k, {"units": "K"}),
        }
        return xr.Dataset(variables, coords={"time_s": ("time_s", self.time_s, {"units": "s"})})

    def plot(self, ax: Any = None) -> Any:
        """Draw the gas temperature with its 95 % band; returns the axes."""
        from twinlag import _plot

        return _plot.gas(self, ax)


class Track(_WithSeries):
    """Both time constants along a record, of `track`: series ``tau1_s``, ``tau1_low_s``, ``tau1_high_s`` and those of sensor 2."""

    __slots__ = ()

    def series(self, name: str) -> Any:
        """A series by name, such as ``tau1_s``; NaN where a time constant is not given."""
        return self._series[name]

    def plot(self, ax: Any = None) -> Any:
        """Draw both time constants with their 95 % bands; returns the axes."""
        from twinlag import _plot

        return _plot.track(self, ax)


__all__ = ["Answer", "Characterisation", "Compensation", "Diagnosis", "Sensor", "Track"]
