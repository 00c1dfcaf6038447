"""
The compiled part of `twinlag`.
"""

from _typeshed import Incomplete, SupportsGetItem
from numpy import float64
from numpy.typing import NDArray
from os import PathLike
from typing import Any, Final, SupportsFloat, SupportsIndex, final

__all__ = ["TEMPERATURE_RANGE_C", "VERSION", "Answer", "Live", "Record", "characterise", "check_model", "compensate", "diagnose", "run_program", "simulate", "track"]

TEMPERATURE_RANGE_C: Final[tuple[float, float]]
"""
Both ends of what a temperature can be, °C.
"""

VERSION: Final[str]
"""
The version of the library.
"""

@final
class Answer:
    """
    What a verb has said, with the records that it was asked about.
    """
    def json(self, /) -> str:
        """
        The answer in the form of the program's `--json`.
        """
    def model(self, /) -> str | None:
        """
        The model that the answer rests on, as JSON; `None` where there is none.
        """
    def page(self, /, made_at: str, is_static: bool, is_first_screen: bool) -> str | None:
        """
        The page of the answer, one HTML file, or its first screen; `None` of a characterisation, which has none.
        """
    def samples_of_rows(self, /) -> list[int | None]:
        """
        For each row of the record the index of its sample in the series, from 0; `None` where it has none. Fails for a series that has other
        instants than the record.
        """
    def series(self, /) -> list[tuple[str, NDArray[float64] | list[str]]]:
        """
        The series of the answer, each with the name of the column that the program writes; none where it has none.
        """

@final
class Live:
    """
    Tracks both sensors after a start.
    """
    def __new__(cls, /, record: Record, asked: str) -> Live: ...
    def push(self, /, t1_c: SupportsFloat | SupportsIndex | None, t2_c: SupportsFloat | SupportsIndex | None, time_s: SupportsFloat | SupportsIndex | None = None) -> tuple[float, float, float, tuple[float | None, float | None], tuple[tuple[float, float] | None, tuple[float, float] | None], bool, float, bool] | None:
        """
        What is known once a row is read: time, gas temperature and its standard deviation, then time constant and band of each
        sensor, whether they may have left the range that is tracked, what the bands were multiplied by, and whether there was a long pause; `None` of a row that is
        left out.
        """
    @staticmethod
    def resumed(state: str) -> Live:
        """
        Goes on from a state.
        """
    @property
    def start(self, /) -> Answer:
        """
        The characterisation of the start.
        """
    def state(self, /) -> str:
        """
        What is known now, as text.
        """

@final
class Record:
    """
    Two temperatures over time, checked.
    """
    def __len__(self, /) -> int: ...
    @property
    def channels(self, /) -> tuple[str, str]:
        """
        Names of the two sensors.
        """
    @property
    def flow(self, /) -> NDArray[float64] | None:
        """
        The flow in the unit of its column, if there is one.
        """
    @staticmethod
    def from_columns(source: str, columns: SupportsGetItem[int, tuple[str, str, Incomplete | SupportsGetItem[int, str]]], selection: str) -> Record:
        """
        A record of columns: name, unit and array of each.
        """
    @property
    def is_irregular(self, /) -> bool:
        """
        Whether samples are taken to be where their stamps are, uneven ones.
        """
    @property
    def missing(self, /) -> int:
        """
        Rows in which a temperature is missing.
        """
    @property
    def notes(self, /) -> list[str]:
        """
        How it was read.
        """
    @staticmethod
    def read(path: str | PathLike[str], selection: str, group: str | None = None, join: bool = False) -> Record:
        """
        A record of a file. One of text has no groups: that one is asked for is refused.
        """
    @property
    def reference_c(self, /) -> NDArray[float64] | None:
        """
        The reference, °C, if there is one.
        """
    @property
    def sample_period_s(self, /) -> float:
        """
        Time between samples, s: of uneven ones the median.
        """
    @property
    def source(self, /) -> str:
        """
        What it is called in messages.
        """
    @property
    def speed_m_s(self, /) -> NDArray[float64] | None:
        """
        The speed of sensors that move, m/s, if their position is known.
        """
    @property
    def t1_c(self, /) -> NDArray[float64]:
        """
        Readings of the first sensor, °C; NaN where one is missing.
        """
    @property
    def t2_c(self, /) -> NDArray[float64]:
        """
        Readings of the second sensor, °C; NaN where one is missing.
        """
    @property
    def time_s(self, /) -> NDArray[float64]:
        """
        Instants, s from the first.
        """

def characterise(records: SupportsGetItem[int, Record], asked: str, progress: Any | None = None) -> Answer:
    """
    Estimates both time constants of a record, or of several of one rig.
    """

def check_model(text: str) -> None:
    """
    Fails where a text is no model that this version reads.
    """

def compensate(record: Record, asked: str, progress: Any | None = None) -> Answer:
    """
    Reconstructs the gas temperature.
    """

def diagnose(records: SupportsGetItem[int, Record], asked: str, progress: Any | None = None) -> Answer:
    """
    Finds the effects that two first-order lags lack, in a record or in several of one rig.
    """

def run_program(arguments: SupportsGetItem[int, str]) -> int:
    """
    Runs the program and returns its exit code.

    - `arguments`: those of a command line; the first is the script that was started
    """

def simulate(rig: str, is_json: bool, source: str) -> Record:
    """
    Simulates a rig, given as TOML or, with `is_json`, as JSON.
    """

def track(record: Record, asked: str, progress: Any | None = None) -> Answer:
    """
    Estimates both time constants along a record.
    """
