"""The verbs: what can be asked of a record."""

from __future__ import annotations

import difflib
import json
import os
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypedDict

from twinlag import _core
from twinlag._answers import Characterisation, Compensation, Diagnosis, Track
from twinlag._columns import count, finite, flag
from twinlag._model import Model
from twinlag._progress import shown
from twinlag._record import Record

if TYPE_CHECKING:
    from typing_extensions import Unpack

Value = float | str | tuple[float, float]
"""What is known of a number: the number, the number with its standard deviation, or text with units."""


class Options(TypedDict, total=False):
    """What every verb may be given beside its own arguments."""

    known: Mapping[str, Value]
    """What is known beforehand, by sensor or parameter: ``{"T1": 0.5}``, ``{"T2": (2.0, 0.1)}`` with a standard deviation."""
    free: Iterable[str]
    """``"gain"`` and ``"offset"`` of sensor 2 relative to sensor 1, to be fitted."""
    second_order: Iterable[str]
    """Sensors with a second lag that is fitted, by name."""
    noise_std_k: Sequence[float]
    """Noise standard deviations of both sensors, K."""
    noise_ratio: float
    """Noise of sensor 2 over that of sensor 1."""
    noise_colour: str
    """``"white"`` or ``"autoregressive"``."""
    quiet_s: Iterable[tuple[float, float]]
    """Stretches ``(from, to)``, s, in which the gas is at rest."""
    estimator: str
    optimiser: str | Mapping[str, Any]
    hold: str
    intervals: str
    """``"auto"``, ``"profile"`` or ``"bootstrap"``."""
    replicates: int
    """Simulated records of the bootstrap."""
    seed: int
    """Of the bootstrap."""
    discard: int
    """Samples left out at the start, by the published family."""
    best_effort: bool
    """Give numbers that may not be used as well."""


def _options(channels: tuple[str, str], **given: Unpack[Options]) -> dict[str, Any]:
    """The options in the form of the library.

    Raises
    ------
    TypeError
        One of them is called otherwise.
    """
    for name in given:
        if name not in Options.__annotations__:
            near = difflib.get_close_matches(name, Options.__annotations__, n=1)
            meant = f"did you mean {near[0]!r}?" if near else f"there are {', '.join(Options.__annotations__)}"
            raise TypeError(f"no option {name!r}; {meant}")
    free, second_order = _names(given.get("free", ())), _names(given.get("second_order", ()))
    _expect(free, ("gain", "offset"), "free")
    sensors = _places(channels)
    _expect(second_order, tuple(sensors), "second_order")
    options: dict[str, Any] = {
        "free_gain": "gain" in free,
        "free_offset": "offset" in free,
        "second_order": [place in {sensors[name] for name in second_order} for place in (0, 1)],
        "known": [_known(name, value, channels) for name, value in _mapping(given.get("known")).items()],
        "quiet_segments_s": [_stretch(stretch) for stretch in given.get("quiet_s") or ()],
        "best_effort": flag(given.get("best_effort", False), "best_effort"),
    }
    noise_std_k = given.get("noise_std_k")
    if noise_std_k is not None:
        if not hasattr(noise_std_k, "__len__") or len(noise_std_k) != 2:
            raise ValueError(f"noise_std_k: expected the levels of both sensors, K, got {noise_std_k!r}")
        options["noise_std_k"] = [finite(level, "noise_std_k") for level in noise_std_k]
    chosen = {name: value for name, value in given.items() if value is not None}
    for name in ("noise_colour", "estimator", "optimiser", "hold", "intervals"):
        if name in chosen:
            options[name] = _name_of(chosen[name], name)
    if "discard" in chosen:
        options["discard"] = count(chosen["discard"], "discard")
    if "noise_ratio" in chosen:
        options["noise_ratio"] = finite(chosen["noise_ratio"], "noise_ratio")
    of_bootstrap = {name: count(chosen[name], name) for name in ("replicates", "seed") if name in chosen}
    if options.get("intervals") == "bootstrap":
        options["intervals"] = {"bootstrap": of_bootstrap}
    elif of_bootstrap:
        raise ValueError(f"{' and '.join(of_bootstrap)}: of a bootstrap alone; intervals='bootstrap' asks for one")
    return options


def _name_of(value: Any, option: str) -> Any:
    """A name, or for the optimiser a mapping with its settings, as in a settings file."""
    if isinstance(value, str) or (option == "optimiser" and isinstance(value, Mapping)):
        return value
    raise TypeError(f"{option}: expected a name, got {value!r}")


def _stretch(stretch: Any) -> list[float]:
    """A stretch of time, s."""
    if not hasattr(stretch, "__len__") or len(stretch) != 2:
        raise ValueError(f"quiet_s: expected stretches (from, to), s, as [(0, 2.5)], got {stretch!r}")
    return [finite(end, "quiet_s") for end in stretch]


def _places(channels: tuple[str, str]) -> dict[str, int]:
    """Whether a name is that of the first sensor, 0, or of the second, 1; the record's own names go before `T1` and `T2`."""
    return dict(zip(("T1", "T2", *channels), (0, 1, 0, 1)))


def _names(names: Iterable[str] | None) -> tuple[str, ...]:
    return (names,) if isinstance(names, str) else tuple(names or ())


def _expect(names: tuple[str, ...], allowed: tuple[str, ...], argument: str) -> None:
    for name in names:
        if name not in allowed:
            raise ValueError(f"{argument}: expected {' or '.join(dict.fromkeys(allowed))}, got {name!r}")


def _mapping(known: Any) -> Mapping[str, Value]:
    if known is None:
        return {}
    if not isinstance(known, Mapping) or not all(isinstance(name, str) for name in known):
        raise TypeError(f"known: expected a mapping of names of sensors or parameters, got {known!r}")
    return known


def _known(name: str, value: Value, channels: tuple[str, str]) -> str:
    """A known value as text: `T1.time_constant_s=0.5+-0.05`."""
    for channel, number in zip(channels, ("T1", "T2")):
        if name == channel or name.startswith(channel + "."):
            name = number + name[len(channel) :]
            break
    if isinstance(value, str):
        return f"{name}={value}"
    if isinstance(value, (tuple, list)):
        if len(value) != 2:
            raise ValueError(f"known: expected a number for {name!r}, or it and its standard deviation, got {value!r}")
        mean, deviation = (finite(part, f"known {name!r}") for part in value)
        return f"{name}={mean!r}+-{deviation!r}"
    return f"{name}={finite(value, f'known {name!r}')!r}"


def _records(record: Record | Iterable[Record]) -> list[Record]:
    records = [record] if isinstance(record, Record) else list(record) if isinstance(record, Iterable) else []
    if not records or not all(isinstance(record, Record) for record in records):
        raise TypeError("expected a twinlag.Record, or several of one rig; make one by twinlag.read or twinlag.Record")
    if len({id(record) for record in records}) < len(records):
        raise ValueError("expected several records, got one of them twice: it would count as independent of itself")
    return records


def _one(record: Record) -> Record:
    if not isinstance(record, Record):
        raise TypeError("expected a twinlag.Record; make one by twinlag.read or twinlag.Record")
    return record


def _asked(options: dict[str, Any], **others: Any) -> str:
    return json.dumps({"options": options, **{name: value for name, value in others.items() if value is not None}})


def _fields(model: Model | None) -> dict[str, Any] | None:
    if model is not None and not isinstance(model, Model):
        raise TypeError(f"model: expected a twinlag.Model, got {model!r}; load_model reads one from a file")
    return None if model is None else model._fields


def characterise(
    record: Record | Iterable[Record],
    *,
    model: Model | None = None,
    progress: Any = None,
    **options: Unpack[Options],
) -> Characterisation:
    """Estimate both time constants blind, without knowing the gas temperature.

    Parameters
    ----------
    record : Record or iterable of Record
        A record, or several of one rig.
    model : Model, optional
        A model of another record of the rig, whose effects are held fixed.
    known : mapping, optional
        What is known beforehand, by sensor or parameter: ``{"T1": 0.5}``, ``{"T2": (2.0, 0.1)}`` with a standard deviation,
        ``{"T1": "500ms+-20%"}``, ``{"T2.gain": 0.99}``.
    free : iterable of str
        ``"gain"`` and ``"offset"`` of sensor 2 relative to sensor 1, to be fitted.
    second_order : iterable of str
        Sensors with a second lag that is fitted, by name.
    noise_std_k : pair of float, optional
        Noise standard deviations, K; found from the data if left out. `noise_ratio` where only ``s2/s1`` is known.
    quiet_s : iterable of pairs, optional
        Stretches ``(from, to)``, s, in which the gas is at rest: noise levels are taken from there.
    estimator, optimiser, hold, intervals, noise_colour : str, optional
        As of the program. Of ``intervals="bootstrap"`` also `replicates`, 199, and `seed`, 1.
    discard : int, optional
        Samples left out at the start, by the published family.
    best_effort : bool
        Give numbers that may not be used as well.
    progress : bool or callable, optional
        ``callable(task, done, total)``, called now and then; ``True`` for a progress bar where `tqdm` is installed.

    Returns
    -------
    Characterisation
        What data cannot answer is an answer, with its `status`, and no exception.

    Raises
    ------
    RecordError
        The record does not fit the question.
    ValueError
        Options that contradict each other.

    Examples
    --------
    >>> import twinlag as tl
    >>> answer = tl.characterise(tl.simulate(tl.EXAMPLE_RIG))
    >>> answer.ok, answer.sensors["fine"].interval[0] < 0.0238 < answer.sensors["fine"].interval[1]
    (True, True)
    """
    records = _records(record)
    if model is not None and len(records) > 1:
        raise ValueError("model: expected one record beside it; diagnose finds the effects of several records together")
    asked = _asked(_options(records[0].channels, **options), model=_fields(model))
    with shown(progress) as report:
        core = _core.characterise([record._inner for record in records], asked, report)
    return Characterisation._of(core)  # type: ignore[no-any-return]


def diagnose(
    record: Record | Iterable[Record],
    *,
    without: Iterable[str] = (),
    progress: Any = None,
    **options: Unpack[Options],
) -> Diagnosis:
    """Find what two first-order lags leave over, and which physical effects account for it.

    Parameters
    ----------
    record : Record or iterable of Record
        A record, or several of one rig: then effects have to hold on records that had no part in finding them.
    without : iterable of str
        Effects that are not to be considered, such as ``"second-order"``.
    known, noise_std_k, noise_ratio, quiet_s, best_effort, progress
        As of `characterise`.

    Examples
    --------
    >>> import twinlag as tl
    >>> answer = tl.diagnose(tl.simulate(tl.EXAMPLE_RIG))
    >>> answer.verdict
    'adequate'
    """
    records = _records(record)
    asked = _asked(_options(records[0].channels, **options), without=list(_names(without)))
    with shown(progress) as report:
        core = _core.diagnose([record._inner for record in records], asked, report)
    return Diagnosis._of(core)  # type: ignore[no-any-return]


def compensate(
    record: Record,
    *,
    model: Model | None = None,
    form: str | int = "smoother",
    trust: str | None = None,
    without: Iterable[str] = (),
    progress: Any = None,
    **options: Unpack[Options],
) -> Compensation:
    """Reconstruct the gas temperature with its standard deviation.

    Parameters
    ----------
    record : Record
        The record.
    model : Model, optional
        A model of another record of the rig; found by a diagnosis if left out.
    form : {"smoother", "filter"} or int
        Which readings the answer for an instant rests on: all, those up to it, or those up to so many samples later.
    trust : str, optional
        The sensor that is taken to be right where gain, offset or delay differ; the first one if left out.
    without, known, noise_std_k, noise_ratio, quiet_s, best_effort, progress
        As of `diagnose`.

    Returns
    -------
    Compensation
        ``gas_c``, °C, and ``gas_std_k``, K, at each instant of ``time_s``, s from the first row. Rows in long gaps have no gas
        temperature and no instant there; where none can be given, all three are empty, and ``because`` says why.

    Examples
    --------
    >>> import twinlag as tl
    >>> record = tl.simulate(tl.EXAMPLE_RIG)
    >>> gas = tl.compensate(record)
    >>> len(gas.gas_c) == len(record), gas.grade
    (True, 'go')
    """
    record = _one(record)
    sensors = _places(record.channels)
    trusted = record.channels[0] if trust is None else trust
    _expect((trusted,), tuple(sensors), "trust")
    if isinstance(form, str):
        _expect((form,), ("smoother", "filter"), "form")
    its_form: Any = form if isinstance(form, str) else {"fixed-lag": count(form, "form")}
    if model is not None and _names(without):
        raise ValueError("without: of a diagnosis; with a model there is none, and the effects are those of the model")
    others = {"model": _fields(model), "form": its_form, "trusted": sensors[trusted], "without": list(_names(without))}
    asked = _asked(_options(record.channels, **options), **others)
    with shown(progress) as report:
        core = _core.compensate(record._inner, asked, report)
    return Compensation._of(core)  # type: ignore[no-any-return]


def track(
    record: Record,
    *,
    model: Model | None = None,
    window_s: float | None = None,
    progress: Any = None,
    **options: Unpack[Options],
) -> Track:
    """Estimate both time constants along a record, in flow that changes.

    Parameters
    ----------
    record : Record
        The record.
    model : Model, optional
        A model of another record of the rig, whose effects are held fixed.
    window_s : float, optional
        Length of a sliding window, s, in which each fit is by itself; the whole record at once if left out.
    known, noise_std_k, noise_ratio, quiet_s, best_effort, progress
        As of `characterise`.
    """
    record = _one(record)
    its_window_s = None if window_s is None else finite(window_s, "window_s")
    asked = _asked(_options(record.channels, **options), model=_fields(model), window_s=its_window_s)
    with shown(progress) as report:
        core = _core.track(record._inner, asked, report)
    return Track._of(core)  # type: ignore[no-any-return]


def simulate(rig: str | os.PathLike[str] | Mapping[str, Any]) -> Record:
    """Simulate a record of a rig; the true gas temperature is its reference.

    Parameters
    ----------
    rig : path-like, str or mapping
        A TOML file as of ``twinlag simulate``, its text, or the same as a mapping.

    Examples
    --------
    >>> import twinlag as tl
    >>> tl.simulate(tl.EXAMPLE_RIG)
    <Record 'rig': fine and coarse, 2500 samples, one every 0.002 s>
    """
    if isinstance(rig, Mapping):
        return Record._of(_core.simulate(json.dumps(dict(rig)), True, "rig"))
    if isinstance(rig, str) and "\n" in rig:
        return Record._of(_core.simulate(rig, False, "rig"))
    path = Path(rig)
    return Record._of(_core.simulate(path.read_text(encoding="utf-8"), False, str(path)))
