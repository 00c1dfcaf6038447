"""Parts of an answer: JSON objects whose fields are attributes as well."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any


class Part(Mapping[str, Any]):
    """An object of the answer's JSON, read as a mapping or by attributes.

    >>> part = Part({"verdict": "explained", "error": {"chi2_per_dof": {"before": 3.0, "after": 1.0}}})
    >>> part.error.chi2_per_dof.after, part["verdict"]
    (1.0, 'explained')
    """

    __slots__ = ("_fields",)
    _fields: dict[str, Any]

    def __init__(self, fields: dict[str, Any]) -> None:
        self._fields = fields

    def __getitem__(self, name: str) -> Any:
        return part_of(self._fields[name])

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_"):
            raise AttributeError(name)
        try:
            return self[name]
        except KeyError:
            raise AttributeError(f"no field {name!r}; there are {', '.join(self._fields)}") from None

    def __iter__(self) -> Iterator[str]:
        return iter(self._fields)

    def __len__(self) -> int:
        return len(self._fields)

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *self._fields]

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self._fields!r})"

    def __reduce__(self) -> Any:
        return type(self), (self._fields,)


def part_of(value: Any) -> Any:
    """A value of JSON, objects as parts."""
    if isinstance(value, dict):
        return Part(value)
    if isinstance(value, list):
        return [part_of(item) for item in value]
    return value


class Sensor(Part):
    """What is found of one sensor.

    A number that may not be used is ``None``: `because` says why. The fields are those of the JSON: ``channel``,
    ``time_constant_s``, ``standard_error_s``, ``interval_95_s``, ``noise_std_K``, ``grade``, ``because``.
    """

    __slots__ = ()

    @property
    def time_constant_s(self) -> float | None:
        """Time constant, s; ``None`` where it is not determined, or may not be used."""
        return self._fields["time_constant_s"]  # type: ignore[no-any-return]

    @property
    def interval(self) -> tuple[float, float] | None:
        """Its 95 % interval, s."""
        ends = self._fields["interval_95_s"]
        return None if ends is None else (ends[0], ends[1])

    @property
    def status(self) -> str:
        """Whether the time constant may be used: ``go``, ``conditional`` or ``no-go``."""
        return self._fields["grade"]  # type: ignore[no-any-return]


class Effect(Part):
    """An effect that a diagnosis has found: ``effect``, ``channel``, ``parameters``, ``evidence``, ``explanation``, ``advice``."""

    __slots__ = ()

    @property
    def numbers(self) -> dict[str, Part]:
        """Its parameters by name, each with ``value``, ``interval_95``, ``unit``, ``grade`` and ``because``."""
        return {number["name"]: Part(number) for number in self._fields["parameters"]}


class Sensors(Mapping[str, Sensor]):
    """Both sensors, by the name of the channel, or as 0 and 1."""

    __slots__ = ("_sensors",)
    _sensors: list[Sensor]

    def __init__(self, sensors: list[dict[str, Any]]) -> None:
        self._sensors = [Sensor(sensor) for sensor in sensors]

    def __getitem__(self, name: str | int) -> Sensor:
        if isinstance(name, int):
            return self._sensors[name]
        for sensor in self._sensors:
            if sensor["channel"] == name:
                return sensor
        raise KeyError(f"no sensor {name!r}; there are {', '.join(self)}")

    def __iter__(self) -> Iterator[str]:
        return (sensor["channel"] for sensor in self._sensors)

    def __len__(self) -> int:
        return len(self._sensors)

    def __repr__(self) -> str:
        return "{" + ", ".join(f"{sensor['channel']!r}: {quantity(sensor)}" for sensor in self._sensors) + "}"


def quantity(fields: Mapping[str, Any], value: str = "time_constant_s", interval: str = "interval_95_s") -> str:
    """A number with its interval and grade, in words.

    >>> quantity({"time_constant_s": 0.5, "interval_95_s": [0.49, 0.51], "grade": "go"})
    '0.5 s [0.49, 0.51] go'
    """
    number, ends, unit = fields[value], fields[interval], fields.get("unit", "s")
    grade = fields["grade"]
    if number is None:
        return f"not given, {grade}" if ends is None else f"[{ends[0]:.5g}, {ends[1]:.5g}] {unit} {grade}"
    of_unit = f" {unit}" if unit else ""
    within = "" if ends is None else f" [{ends[0]:.5g}, {ends[1]:.5g}]"
    return f"{number:.5g}{of_unit}{within} {grade}"
