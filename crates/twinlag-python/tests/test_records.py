"""Records of arrays, frames and files; hostile ones get a clear exception, and the interpreter lives."""

from __future__ import annotations

import datetime
import pickle

import numpy as np
import pytest

import twinlag as tl


def test_arrays_of_any_make_are_the_same_record(arrays) -> None:
    time_s, t1, t2 = arrays
    want = tl.Record(time_s, t1, t2)
    doubled = np.empty(2 * len(t1))
    doubled[::2] = t1
    read_only = t1.copy()
    read_only.flags.writeable = False
    table = np.stack([t1, t2], axis=1)
    for other in [doubled[::2], t1.astype(">f8"), read_only, list(t1), tuple(t1), t1.astype(object), table[:, 0], np.flip(np.flip(t1))]:
        record = tl.Record(time_s, other, t2)
        assert np.array_equal(record.t1_c, want.t1_c)
    single = tl.Record(time_s, t1.astype(np.float32), t2)
    assert np.allclose(single.t1_c, t1, rtol=1e-7)
    whole = tl.Record(np.arange(len(t1)), np.round(t1).astype(np.int16), t2.round().astype(np.uint16))
    assert np.array_equal(whole.t1_c, np.round(t1))


def test_units_are_converted(arrays) -> None:
    time_s, t1, t2 = arrays
    kelvin = tl.Record(1000 * time_s, t1 + 273.15, t2 + 273.15, unit="K", time_unit="ms")
    # 273.15 K is no double: readings near 700 K are off by as much as doubles there lie apart.
    assert np.max(np.abs(kelvin.t1_c - t1)) <= 4 * np.spacing(1000.0)
    assert kelvin.sample_period_s == pytest.approx(0.002)


def test_missing_values_are_missing_however_they_are_written(arrays) -> None:
    time_s, t1, t2 = arrays
    gaps = t1.copy()
    gaps[100] = np.nan
    masked = np.ma.masked_array(t1, mask=np.arange(len(t1)) == 100)
    nothing = [None if row == 100 else value for row, value in enumerate(t1)]
    for values in (gaps, masked, nothing):
        assert tl.Record(time_s, values, t2).missing == 1


@pytest.mark.parametrize(
    ("values", "message"),
    [
        (np.zeros((2, 3)), "shape"),
        (np.zeros(0), "no data|empty|rows|samples|length"),
        (np.array(["20.5", "b"]), "expected numbers, got text, such as 'b' in row 2"),
        (np.array([object(), object()], dtype=object), "expected a number"),
        (np.array([1j, 2j]), "expected numbers"),
        (np.array([True, False]), "expected numbers"),
        (np.array([20.5, True, 21.0], dtype=object), "expected a number, got True in row 2"),
        (np.array(["2026-01-31"], dtype="datetime64[s]"), "expected numbers"),
        (5.0, "shape"),
        (np.zeros(7), "7|length|rows"),
        (None, "shape|number"),
        ({"a": 1}, "shape|number"),
    ],
    ids=str,
)
def test_what_is_no_channel_is_refused(arrays, values, message) -> None:
    time_s, _, t2 = arrays
    with pytest.raises(tl.RecordError, match=message):
        tl.Record(time_s, values, t2)


def test_records_that_cannot_be_are_refused(arrays) -> None:
    time_s, t1, t2 = arrays
    for time, one, other in [
        (time_s[::-1], t1, t2),
        (np.zeros(len(t1)), t1, t2),
        (time_s, t1, t1),
        (time_s, np.full(len(t1), 20.0), t2),
        (time_s, np.full(len(t1), np.nan), t2),
        (time_s, t1 + 1e6, t2),
        (time_s[:3], t1[:3], t2[:3]),
        (np.full(len(t1), np.nan), t1, t2),
        (None, t1, t2),
    ]:
        with pytest.raises(tl.RecordError):
            tl.Record(time, one, other)
    assert len(tl.Record(None, t1, t2, period_s=0.002)) == len(t1)


def test_instants_of_any_kind(arrays) -> None:
    _, t1, t2 = arrays
    start = np.datetime64("2026-01-31T12:00:00", "ns")
    stamps = start + np.arange(len(t1)) * np.timedelta64(2, "ms")
    utc = datetime.timezone(datetime.timedelta(hours=2))
    aware = [datetime.datetime(2026, 1, 31, 12, tzinfo=utc) + datetime.timedelta(milliseconds=2 * k) for k in range(len(t1))]
    texts = [str(stamp) for stamp in stamps]
    objects = np.array(texts, dtype=object)
    for time in (stamps, stamps.astype("datetime64[ms]"), stamps - start, aware, texts, objects):
        record = tl.Record(time, t1, t2)
        assert record.sample_period_s == pytest.approx(0.002, rel=1e-9)
        assert record.time_s[0] == 0.0
    objects[9] = float("nan")  # as pandas has a missing text
    with pytest.raises(tl.RecordError, match="sample 10, .*the time is missing"):
        tl.Record(objects, t1, t2)


def test_frames(arrays) -> None:
    pd = pytest.importorskip("pandas")
    time_s, t1, t2 = arrays
    index = pd.date_range("2026-01-31", periods=len(t1), freq="2ms", tz="Europe/Berlin", name="time")
    frame = pd.DataFrame({"fine [K]": t1 + 273.15, "coarse [K]": t2 + 273.15, "note": "x"}, index=index)
    for made in (frame, frame.reset_index(), frame.convert_dtypes()):
        record = tl.Record.from_frame(made)
        assert record.channels == ("fine", "coarse") and len(record) == len(t1)
        assert record.sample_period_s == pytest.approx(0.002, rel=1e-9)
    plain = pd.DataFrame({"time_s": time_s, "a": t1, "b": t2, "c": t2})
    assert tl.Record.from_frame(plain, t1="c", t2="a").channels == ("c", "a")
    with pytest.raises(tl.RecordError, match="which columns are the two sensors"):
        tl.Record.from_frame(plain)
    # Units in a level of their own: failed, 273.15 K too high.
    levels = pd.DataFrame({("time", "ms"): 1e3 * time_s, ("fine", "K"): t1 + 273.15, ("coarse", "K"): t2 + 273.15})
    record = tl.Record.from_frame(levels)
    assert record.channels == ("fine", "coarse") and np.max(np.abs(record.t1_c - t1)) < 1e-9
    assert record.sample_period_s == pytest.approx(0.002, rel=1e-9)
    whole = pd.DataFrame({"time": 2 * np.arange(len(t1)), "fine": t1, "coarse": t2})
    with pytest.raises(tl.RecordError, match="names no unit of time"):
        tl.Record.from_frame(whole)
    assert tl.Record.from_frame(whole, time_unit="ms").sample_period_s == pytest.approx(0.002, rel=1e-9)
    with pytest.raises(tl.RecordError, match="twice"):
        tl.Record(time_s, t1, t2, names=("a", "a"))
    back = tl.Record.from_frame(plain, t1="a", t2="b").to_frame()
    assert np.array_equal(back["a"], t1) and np.array_equal(back.index, time_s)


def test_an_index_of_decimals_that_rise_is_the_time(arrays) -> None:
    pd = pytest.importorskip("pandas")
    time_s, t1, t2 = arrays
    plain = tl.Record(time_s, t1, t2)
    frame = pd.DataFrame({"a_C": t1, "b_C": t2}, index=time_s)
    record = tl.Record.from_frame(frame, time_unit="s")
    assert np.array_equal(record.time_s, plain.time_s) and record.channels == ("a", "b")


def test_frames_of_polars(arrays) -> None:
    pl = pytest.importorskip("polars")
    time_s, t1, t2 = arrays
    frame = pl.DataFrame({"time_s": time_s, "T1": t1, "T2": t2})
    assert np.array_equal(tl.Record.from_frame(frame).t2_c, t2)
    stamped = frame.with_columns(pl.from_epoch((pl.col("time_s") * 1e6).round().cast(pl.Int64), time_unit="us").alias("time_s"))
    assert tl.Record.from_frame(stamped).sample_period_s == pytest.approx(0.002, rel=1e-9)


def test_datasets_of_xarray(arrays) -> None:
    xr = pytest.importorskip("xarray")
    time_s, t1, t2 = arrays
    variables = {"T1": ("time", t1 + 273.15, {"units": "K"}), "T2": ("time", t2 + 273.15, {"units": "K"})}
    dataset = xr.Dataset(variables, coords={"time": ("time", time_s, {"units": "s"})})
    record = tl.Record.from_frame(dataset)
    assert record.channels == ("T1", "T2") and np.max(np.abs(record.t1_c - t1)) < 1e-9


def test_files(tmp_path) -> None:
    path = tmp_path / "run.csv"
    rows = "".join(f"{k},{20 + (k % 7)},{21 + (k % 5)}\n" for k in range(20))
    path.write_text("t_s,bare,sheathed\n" + rows)
    record = tl.read(path, t1="sheathed", t2=2)
    assert record.channels == ("sheathed", "bare") and record.source == str(path)
    path.write_text("t_s,bare,sheathed\n0,20,21\n1,20.5,cold\n")
    with pytest.raises(tl.RecordError) as caught:
        tl.read(path, t1="bare", t2="sheathed")
    assert caught.value.line == 3 and caught.value.file == str(path)
    assert pickle.loads(pickle.dumps(caught.value)).line == 3
    with pytest.raises(OSError, match="nothing.csv"):
        tl.read(tmp_path / "nothing.csv")
    with pytest.raises(OSError):
        tl.read(tmp_path)


def test_a_record_survives_pickling(rig) -> None:
    again = pickle.loads(pickle.dumps(rig))
    assert again.channels == rig.channels and np.array_equal(again.t1_c, rig.t1_c)
    assert tl.characterise(again).sensors[0].time_constant_s == tl.characterise(rig).sensors[0].time_constant_s


def test_a_record_with_a_flow_keeps_it_when_pickled(arrays) -> None:
    time_s, t1, t2 = arrays
    flow = 2.0 + np.sin(time_s)
    record = tl.Record(time_s, t1, t2, flow=flow)
    again = pickle.loads(pickle.dumps(record))
    assert np.array_equal(record.flow, flow) and np.array_equal(again.flow, flow)
    assert tl.characterise(again).to_dict()["sensors"] == tl.characterise(record).to_dict()["sensors"]
    moving = tl.Record(time_s, t1, t2, position=time_s + 0.1 * np.sin(time_s))
    assert moving.speed_m_s is not None
    with pytest.raises(TypeError, match="position"):
        pickle.dumps(moving)


def test_stamps_that_count_something_shorter_than_seconds_are_refused(arrays) -> None:
    time_s, t1, t2 = arrays
    milliseconds = (1.7e12 + 1000.0 * time_s).astype(np.int64)
    with pytest.raises(tl.RecordError, match="time_unit"):
        tl.Record(milliseconds, t1, t2)
    assert tl.Record(milliseconds, t1, t2, time_unit="ms").sample_period_s == pytest.approx(time_s[1] - time_s[0])


@pytest.mark.parametrize("what", [{"T1": [1.0]}, [1.0, 2.0], np.zeros((3, 2)), None])
def test_what_is_no_frame_is_refused(what: object) -> None:
    with pytest.raises(TypeError, match="data frame"):
        tl.Record.from_frame(what)


@pytest.mark.parametrize("names", ["ab", ("a",), (1, 2)])
def test_names_that_are_not_two_are_refused(arrays, names: object) -> None:
    with pytest.raises(TypeError, match="names of both sensors"):
        tl.Record(*arrays, names=names)
