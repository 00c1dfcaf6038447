"""Gas temperature and time constants, reading by reading."""

from __future__ import annotations

import math
import os
from typing import TYPE_CHECKING, Any, NamedTuple

from twinlag import _core
from twinlag._answers import Characterisation
from twinlag._errors import RecordError
from twinlag._files import replace
from twinlag._model import Model
from twinlag._record import Record
from twinlag._verbs import Options, _asked, _fields, _one, _options

if TYPE_CHECKING:
    from typing_extensions import Unpack

Band = tuple[float, float]


def _reading(value: float | None, name: str) -> float | None:
    if value is None or math.isnan(value):
        return None
    low, high = _core.TEMPERATURE_RANGE_C
    if not low <= value <= high:
        raise RecordError(f"{name}: {value!r} °C is not between absolute zero and {high:g} °C; leave such a reading out as None")
    return float(value)


class LiveAnswer(NamedTuple):
    """What is known at an instant, from the readings up to it.

    ``time_s``; ``gas_c`` with its standard deviation ``gas_std_k``; both time constants, ``tau_s``, with the ends of their 95 % bands,
    ``tau_95_s``, or ``None``; ``is_beyond``, whether they may have left the range that is tracked; ``widened_by``, what bands were
    multiplied by because readings are farther off than noise takes them; ``is_resumed``, whether there was a long pause before this row, or the clock was set.
    """

    time_s: float
    """The instant, s."""
    gas_c: float
    """The gas temperature, °C."""
    gas_std_k: float
    """Its standard deviation, K."""
    tau_s: tuple[float | None, float | None]
    """Both time constants, s; ``None`` while the readings of late do not determine them, or while they may be beyond what is tracked."""
    tau_95_s: tuple[Band | None, Band | None]
    """Ends of their 95 % bands, s."""
    is_beyond: bool
    """Whether the time constants may have left the range that is tracked."""
    widened_by: float
    """What the bands were multiplied by, since readings of late are farther off than noise takes them."""
    is_resumed: bool
    """Whether there was a long pause before this row, or the clock was set."""


class Live:
    """Track both sensors reading by reading, after a start.

    Parameters
    ----------
    start : Record
        The start, which has to determine both time constants.
    model : Model, optional
        A model of another record of the rig, whose effects stay fixed.
    change_per_root_s : float, optional
        By how much the time constants may change in a second, as a share; the standard deviation grows as the root of time.
    known, noise_std_k, noise_ratio, quiet_s, best_effort
        As of `twinlag.characterise`.

    Raises
    ------
    RecordError
        The start does not determine both time constants, or is not evenly spaced.

    Examples
    --------
    >>> import twinlag as tl
    >>> record = tl.simulate(tl.EXAMPLE_RIG)
    >>> live = tl.Live(record)
    >>> live.push(450.0, 450.0).gas_std_k > 0
    True
    """

    __slots__ = ("_inner",)
    _inner: _core.Live

    def __init__(
        self,
        start: Record,
        *,
        model: Model | None = None,
        change_per_root_s: float | None = None,
        **options: Unpack[Options],
    ) -> None:
        if change_per_root_s is not None and not change_per_root_s >= 0:
            raise ValueError(f"change_per_root_s: expected a share of zero or more, got {change_per_root_s!r}")
        its_options = _options(_one(start).channels, **options)
        asked = _asked(its_options, model=_fields(model), change_per_root_s=change_per_root_s)
        self._inner = _core.Live(start._inner, asked)

    @property
    def start(self) -> Characterisation:
        """The characterisation of the start."""
        return Characterisation._of(self._inner.start)  # type: ignore[no-any-return]

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write what is known now, for `load_live`. A file that exists is overwritten.

        Examples
        --------
        >>> import pathlib, tempfile, twinlag as tl
        >>> live = tl.Live(tl.simulate(tl.EXAMPLE_RIG))
        >>> path = pathlib.Path(tempfile.mkdtemp(), "live.json")
        >>> live.save(path)
        >>> tl.load_live(path).push(450.0, 451.0) == live.push(450.0, 451.0)
        True
        """
        replace(path, self._inner.state())

    @classmethod
    def _resumed(cls, state: str) -> Live:
        live = cls.__new__(cls)
        live._inner = _core.Live.resumed(state)
        return live

    def __reduce__(self) -> tuple[Any, ...]:
        return Live._resumed, (self._inner.state(),)

    def push(self, t1_c: float | None, t2_c: float | None, time_s: float | None = None) -> LiveAnswer | None:
        """Take a row.

        Parameters
        ----------
        t1_c, t2_c : float or None
            Readings, °C; one that is ``None`` or NaN is missing.
        time_s : float, optional
            The instant, s, on the clock of the start; one period after the last row if left out.

        Returns
        -------
        LiveAnswer or None
            ``None`` of a row that is left out: one that is not later than the last one, and one that is 100 000 periods later or 100
            earlier, unless the next row goes on from it, as after a pause or where the clock was set.

        Raises
        ------
        RecordError
            A reading that is no temperature, or an instant that is none. The row is left out; those after it can still be taken.
        """
        if time_s is not None and not math.isfinite(time_s):
            raise RecordError(f"time_s: expected an instant, got {time_s!r}")
        first, second = (_reading(c, name) for c, name in ((t1_c, "t1_c"), (t2_c, "t2_c")))
        now = self._inner.push(first, second, time_s)
        return None if now is None else LiveAnswer(*now)


def load_live(path: str | os.PathLike[str]) -> Live:
    """Go on from where `Live.save` was called: rows that come after get the answers, to the last bit, that they would have got there.

    Raises
    ------
    ValueError
        It is no such file, or it is damaged.
    """
    try:
        with open(path, encoding="utf-8") as file:
            return Live._resumed(file.read())
    except ValueError as error:  # bytes that are no text among them
        raise ValueError(f"{os.fspath(path)}: expected a state written by Live.save: {error}") from None
