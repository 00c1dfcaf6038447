"""Two temperature sensors' time constants, and the gas temperature, from their readings alone.

Two sensors of different thickness in one gas lag differently. What is asked of a record of both:

- `characterise`: both time constants, blind, with 95 % intervals;
- `diagnose`: which physical effect two first-order lags lack, and how much better it is with it;
- `compensate`: the gas temperature with its standard deviation;
- `track`: the time constants along a record, in flow that changes; `Live` does so row by row.

A record comes from arrays (`Record`), a data frame (`Record.from_frame`), a file (`read`) or a rig (`simulate`).

>>> import twinlag as tl
>>> answer = tl.characterise(tl.simulate(tl.EXAMPLE_RIG))
>>> answer.status
'ok'
"""

from __future__ import annotations

from twinlag import _core
from twinlag._answers import Answer, Characterisation, Compensation, Diagnosis, Track
from twinlag._errors import RecordError
from twinlag._live import Live, LiveAnswer, load_live
from twinlag._model import Model, load_model
from twinlag._part import Effect, Part, Sensor, Sensors
from twinlag._record import Record, read
from twinlag._verbs import characterise, compensate, diagnose, simulate, track

__version__ = _core.VERSION

EXAMPLE_RIG = """\
seed = 1
[record]
samples = 2500
sample_period_s = 0.002
[gas]
kind = "turbulence"
mean_c = 450.0
std_k = 15.0
corner_hz = 3.0
cutoff_hz = 200.0
[[sensors]]
channel = "fine"
time_constant_s = 0.0238
noise = { std_k = 0.3 }
[[sensors]]
channel = "coarse"
time_constant_s = 0.1168
noise = { std_k = 0.3 }
"""
"""A rig to try things on: two first-order sensors in turbulence."""

__all__ = [
    "EXAMPLE_RIG",
    "Answer",
    "Characterisation",
    "Compensation",
    "Diagnosis",
    "Effect",
    "Live",
    "LiveAnswer",
    "Model",
    "Part",
    "Record",
    "RecordError",
    "Sensor",
    "Sensors",
    "Track",
    "characterise",
    "compensate",
    "diagnose",
    "load_live",
    "load_model",
    "read",
    "simulate",
    "track",
]
