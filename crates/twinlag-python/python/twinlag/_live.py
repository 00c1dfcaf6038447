"""Gas temperature and time constants, reading by reading."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from twinlag import _core
from twinlag._answers import Characterisation
from twinlag._model import Model
from twinlag._record import Record
from twinlag._verbs import _asked, _fields, _one, _options

Band = tuple[float, float]


class LiveAnswer(NamedTuple):
    """What is known at an instant, from the readings up to it."""

    time_s: float
    """The instant, s."""
    gas_c: float
    """The gas temperature, °C."""
    gas_std_k: float
    """Its standard deviation, K."""
    tau_s: tuple[float | None, float | None]
    """Both time constants, s; ``None`` while the readings of late do not determine them."""
    tau_95_s: tuple[Band | None, Band | None]
    """Ends of their 95 % bands, s."""
    is_beyond: bool
    """Whether the time constants may have left the range that is tracked."""
    widened_by: float
    """What the bands were multiplied by, since readings of late are farther off than noise takes them."""


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
        **options: Any,
    ) -> None:
        its_options = _options(_one(start).channels, **options)
        asked = _asked(its_options, model=_fields(model), change_per_root_s=change_per_root_s)
        self._inner = _core.Live(start._inner, asked)

    @property
    def start(self) -> Characterisation:
        """The characterisation of the start."""
        return Characterisation._of(self._inner.start)  # type: ignore[no-any-return]

    def push(self, t1_c: float | None, t2_c: float | None, time_s: float | None = None) -> LiveAnswer | None:
        """Take a row; a reading that is ``None`` or NaN is missing.

        Returns
        -------
        LiveAnswer or None
            ``None`` of a row that is not later than the last one, which is left out.
        """
        first, second = (None if c is None or math.isnan(c) else float(c) for c in (t1_c, t2_c))
        now = self._inner.push(first, second, time_s)
        return None if now is None else LiveAnswer(*now)
