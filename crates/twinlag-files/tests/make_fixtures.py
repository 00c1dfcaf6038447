"""Writes the fixtures of the tests with the libraries that people use, and beside each what is in it.

    python -m venv venv && venv/bin/pip install asammdf npTDMS openpyxl odfpy pandas pyarrow h5py netCDF4 scipy xlwt hypothesis pytest
    venv/bin/python make_fixtures.py [NAME...]

A fixture `x.mf4` comes with `x.mf4.csv`: names, units and kinds of the columns in the first three lines, then one
line for each row. Numbers stand as repr() gives them, that is, to the bit; instants as nanoseconds since 1970-01-01;
what is missing is empty. Numbers are those that the library itself reads back, wherever it has a reader.
"""

import datetime
import math
import struct
import sys
from pathlib import Path

import numpy as np

HERE = Path(__file__).parent / "fixtures"
ROWS = 40
START = datetime.datetime(2026, 1, 31, 10, 0, 0)
START_NS = int(START.replace(tzinfo=datetime.timezone.utc).timestamp()) * 10**9


def expect(name, columns):
    """Writes what is in a fixture.

    columns: (name, unit, values), values being numbers, datetimes or texts; None, NaN and NaT are missing.
    """

    def kind(values):
        some = next(v for v in values if v is not None)
        if isinstance(some, (datetime.datetime, np.datetime64)):
            return "instant"
        return "text" if isinstance(some, str) else "number"

    def cell(value, kind):
        if value is None or (kind == "instant" and np.isnat(np.datetime64(value))):
            return ""
        if kind == "instant":
            return str(int(np.datetime64(value).astype("datetime64[ns]").astype(np.int64)))
        if kind == "text":
            return value
        return "" if math.isnan(value) else repr(float(value))

    kinds = [kind(values) for _, _, values in columns]
    lines = [[n for n, _, _ in columns], [u for _, u, _ in columns], kinds]
    for row in zip(*(values for _, _, values in columns), strict=True):
        lines.append([cell(v, k) for v, k in zip(row, kinds)])
    text = "".join(",".join(line) + "\n" for line in lines)
    (HERE / f"{name}.csv").write_text(text, encoding="utf-8")


def masked(values, valid):
    return [v if ok else None for v, ok in zip(values, valid)]


def warm(seed, rows=ROWS, fine=True):
    """A temperature in degrees Celsius that uses all digits of a double."""
    rng = np.random.default_rng(seed)
    return 20 + (3 if fine else 2) * np.sin(np.arange(rows) / (3 if fine else 5)) + 0.01 * rng.standard_normal(rows)


def read_back(path, sheet, column, first):
    """Numbers of a column as openpyxl reads them: workbooks are written with 16 digits."""
    import openpyxl

    rows = openpyxl.load_workbook(HERE / path)[sheet].iter_rows(min_row=first, values_only=True)
    cells = [row[column] for row in rows if any(cell is not None for cell in row)]
    return [None if cell == "#N/A" else cell for cell in cells]


def spreadsheets():
    import openpyxl
    import pandas
    import xlwt

    # Title and settings above, dates as time, an error, an empty cell, an empty row, a second sheet without a table.
    book = openpyxl.Workbook()
    sheet = book.active
    sheet.title = "Messung 1"
    sheet.append(["Prüfstand 3"])
    sheet.append(["Operator", "K. M."])
    sheet.append([])
    sheet.append(["when", "T1 [°C]", "T2 [K]", "remark"])
    t1, t2 = warm(1), warm(2, fine=False) + 273.15
    stamps = [START + datetime.timedelta(milliseconds=250 * k) for k in range(ROWS)]
    for k in range(ROWS):
        if k == 30:
            sheet.append([])
        sheet.append([stamps[k], "#N/A" if k == 7 else float(t1[k]), None if k == 9 else float(t2[k]), "ok" if k == 3 else None])
    book.create_sheet("notes").append(["nothing", "here"])
    book.save(HERE / "preamble.xlsx")
    remark = ["ok" if k == 3 else "" for k in range(ROWS)]
    expect(
        "preamble.xlsx",
        [
            ("when", "", stamps),
            ("T1 [°C]", "", read_back("preamble.xlsx", "Messung 1", 1, 5)),
            ("T2 [K]", "", read_back("preamble.xlsx", "Messung 1", 2, 5)),
            ("remark", "", remark),
        ],
    )

    # Names, then units, then whole numbers and floats; words for a missing one make a column of texts.
    t1, t2 = warm(3), np.round(warm(4), 2)
    rows = [["time", "T1", "T2"], ["ms", "°C", "°C"]]
    rows += [[20 * k, float(t1[k]), "OL" if k == 5 else float(t2[k])] for k in range(ROWS)]
    pandas.DataFrame(rows).to_excel(HERE / "units.ods", engine="odf", header=False, index=False, sheet_name="log")
    expect(
        "units.ods",
        [
            ("time", "ms", [20.0 * k for k in range(ROWS)]),
            ("T1", "°C", t1),
            ("T2", "°C", ["OL" if k == 5 else repr(float(v)) for k, v in enumerate(t2)]),
        ],
    )

    # Day and time of day in two columns; no unit; integers.
    book = xlwt.Workbook()
    sheet = book.add_sheet("Sheet1")
    day, clock = xlwt.XFStyle(), xlwt.XFStyle()
    day.num_format_str, clock.num_format_str = "yyyy-mm-dd", "hh:mm:ss"
    for column, name in enumerate(["date", "clock", "T1", "T2"]):
        sheet.write(0, column, name)
    t1 = warm(5)
    for k in range(ROWS):
        sheet.write(k + 1, 0, START.date(), day)
        sheet.write(k + 1, 1, datetime.time(10, 0, k), clock)
        sheet.write(k + 1, 2, float(t1[k]))
        sheet.write(k + 1, 3, 20 + k % 3)
    book.save(str(HERE / "day.xls"))
    expect(
        "day.xls",
        [
            ("date", "", [str(START.date())] * ROWS),
            ("clock", "", [f"10:00:{k:02}.000000000" for k in range(ROWS)]),
            ("T1", "", t1),
            ("T2", "", [20.0 + k % 3 for k in range(ROWS)]),
        ],
    )

    # Two sheets with tables, one of which has two temperatures.
    with pandas.ExcelWriter(HERE / "sheets.xlsx", engine="openpyxl") as writer:
        frame = pandas.DataFrame({"time [s]": [0.5 * k for k in range(ROWS)], "p [bar]": 1 + warm(6) / 100})
        frame.to_excel(writer, sheet_name="pressure", index=False)
        frame = pandas.DataFrame({"time [s]": [0.1 * k for k in range(ROWS)], "T1": warm(7), "T2": warm(8)})
        frame.to_excel(writer, sheet_name="gas", index=False)
    expect("sheets.xlsx", [(name, "", read_back("sheets.xlsx", "gas", at, 2)) for at, name in enumerate(frame)])


def mdf():
    from asammdf import MDF, Signal

    def signal(name, unit, samples, time, invalid=None, conversion=None):
        return Signal(
            samples=samples, timestamps=time, name=name, unit=unit, invalidation_bits=invalid, conversion=conversion
        )

    def start(file):
        file.start_time = START.replace(tzinfo=datetime.timezone.utc)

    def read(path, names, invalid={}):
        with MDF(path) as file:
            columns = []
            for name, unit in names:
                signal = file.get(name, ignore_invalidation_bits=True)
                assert signal.unit == unit, (signal.unit, unit)
                valid = ~invalid.get(name, np.zeros(len(signal), bool))
                columns.append((name, unit, masked(signal.samples, valid)))
            return [("time", "s", signal.timestamps), *columns]

    time = 0.01 * np.arange(ROWS)
    linear = {"a": 0.01, "b": -40.0}
    counts = np.round((warm(12) + 40) / 0.01).astype(np.int16)
    invalid = np.arange(ROWS) % 11 == 4

    # Doubles, scaled integers with invalid samples, floats.
    file = MDF(version="4.10")
    start(file)
    file.append(
        [
            signal("T1", "°C", warm(11), time),
            signal("T2", "°C", counts, time, invalid, linear),
            signal("p", "bar", (warm(13) / 10).astype(np.float32), time),
        ],
        acq_name="gas",
        comment="gas",
    )
    file.save(HERE / "plain.mf4", overwrite=True)
    expect("plain.mf4", read(HERE / "plain.mf4", [("T1", "°C"), ("T2", "°C"), ("p", "bar")], {"T2": invalid}))

    # Two groups of different rates, compressed and transposed; one has the temperatures.
    file = MDF(version="4.11")
    start(file)
    file.append([signal("speed", "rpm", np.arange(80.0), 0.005 * np.arange(80))], acq_name="engine")
    file.append([signal("T1", "K", warm(14) + 273.15, time), signal("T2", "K", warm(15) + 273.15, time)], acq_name="gas")
    file.save(HERE / "groups.mf4", overwrite=True, compression=2)
    expect("groups.mf4", read(HERE / "groups.mf4", [("T1", "K"), ("T2", "K")]))

    # Numbers of two bytes, which the reader's library takes for zero.
    file = MDF(version="4.10")
    start(file)
    file.append([signal("T1", "°C", warm(11).astype(np.float16), time), signal("T2", "°C", warm(12), time)], acq_name="gas")
    file.save(HERE / "half.mf4", overwrite=True)

    # Each temperature in a group of its own: only joined are they a record. All times are sums of powers of two, so
    # that the interpolation is exact.
    time, its_time = np.arange(ROWS) / 128, 1 / 256 + np.arange(18) / 64
    its, bad = np.arange(18.0), np.arange(18) == 9
    file = MDF(version="4.10")
    start(file)
    file.append([signal("T1", "°C", warm(16), time)], acq_name="ECU1")
    file.append([signal("T2", "°C", its, its_time, bad)], acq_name="ECU2")
    file.save(HERE / "apart.mf4", overwrite=True)
    joined = np.interp(time, its_time, its, left=np.nan, right=np.nan)
    joined[(time > its_time[8]) & (time < its_time[10])] = np.nan
    expect("apart.mf4", [*read(HERE / "apart.mf4", [("T1", "°C")]), ("T2", "°C", joined)])

    # MDF 3, with scaled integers.
    time = 0.01 * np.arange(ROWS)
    file = MDF(version="3.30")
    start(file)
    file.append([signal("T1", "°C", warm(17), time), signal("T2", "°C", counts, time, None, linear)], comment="gas")
    file.save(HERE / "old.mdf", overwrite=True)
    expect("old.mdf", read(HERE / "old.mdf", [("T1", "°C"), ("T2", "°C")]))


def tdms():
    from nptdms import ChannelObject, GroupObject, RootObject, TdmsFile, TdmsWriter

    waveform = {"wf_increment": 0.002, "wf_start_offset": 0.5, "wf_start_time": np.datetime64(START), "wf_samples": ROWS}

    def read(path, group, names):
        with TdmsFile.open(path) as file:
            return [(name, unit, file[group][name][:]) for name, unit in names]

    clock = [0.5 + 0.002 * k for k in range(ROWS)]

    # Doubles and floats in two segments, of which the second has no list of its own; integers that are numbers.
    path = HERE / "segments.tdms"
    t1, t2 = warm(21), (warm(22) + 273.15).astype(np.float32)
    with TdmsWriter(path) as writer:
        for part in [slice(0, 25), slice(25, ROWS)]:
            writer.write_segment([
                RootObject({"title": "rig"}),
                GroupObject("gas"),
                ChannelObject("gas", "T1", t1[part], {**waveform, "unit_string": "°C"}),
                ChannelObject("gas", "T2", t2[part], {**waveform, "unit_string": "K"}),
                ChannelObject("gas", "state", np.arange(ROWS, dtype=np.int16)[part] - 7, waveform),
            ])
    columns = read(path, "gas", [("T1", "°C"), ("T2", "K"), ("state", "")])
    expect("segments.tdms", [("time", "s", clock), *columns])

    # What LabVIEW writes while it streams: one segment of several chunks. npTDMS does not write it but reads it, so the
    # raw data of equal segments are put behind each other and the lead-in is told so.
    path = HERE / "chunks.tdms"
    with TdmsWriter(path) as writer:
        writer.write_segment([ChannelObject("gas", "T1", t1[:10], waveform), ChannelObject("gas", "T2", warm(23)[:10], waveform)])
    raw = bytearray(path.read_bytes())
    more = np.concatenate([np.concatenate([t1[k : k + 10], warm(23)[k : k + 10]]) for k in (10, 20, 30)])
    raw[12:20] = (int.from_bytes(raw[12:20], "little") + more.nbytes).to_bytes(8, "little")
    path.write_bytes(bytes(raw) + more.tobytes())
    expect("chunks.tdms", [("time", "s", clock), *read(path, "gas", [("T1", ""), ("T2", "")])])

    # Interleaved samples, big-endian numbers, stamps as a channel: the first by its flag, which npTDMS reads.
    path = HERE / "interleaved.tdms"
    with TdmsWriter(path) as writer:
        writer.write_segment([ChannelObject("gas", "T1", t1, {}), ChannelObject("gas", "T2", warm(24), {})])
    raw = bytearray(path.read_bytes())
    start = 28 + int.from_bytes(raw[20:28], "little")
    pairs = np.frombuffer(bytes(raw[start:]), "<f8").reshape(2, ROWS).T.copy()
    raw[4:8] = (int.from_bytes(raw[4:8], "little") | 0x20).to_bytes(4, "little")
    path.write_bytes(bytes(raw[:start]) + pairs.tobytes())
    expect("interleaved.tdms", read(path, "gas", [("T1", ""), ("T2", "")]))

    # Stamps as a channel, beside a group of another length.
    path = HERE / "stamps.tdms"
    stamps = np.datetime64(START) + np.arange(ROWS) * np.timedelta64(250, "ms")
    with TdmsWriter(path) as writer:
        writer.write_segment([
            ChannelObject("log", "Time", stamps.astype("datetime64[us]")),
            ChannelObject("log", "T1", t1, {"unit_string": "°C"}),
            ChannelObject("log", "T2", warm(25), {"unit_string": "°C"}),
            ChannelObject("other", "p", np.arange(7.0)),
        ])
    expect("stamps.tdms", [("Time", "", stamps), *read(path, "log", [("T1", "°C"), ("T2", "°C")])])

    # Counts with scales that are still to be applied; npTDMS applies them as it reads.
    def scaled(*scales):
        given = {"NI_Scaling_Status": "unscaled", "NI_Number_Of_Scales": len(scales)}
        for k, (kind, values) in enumerate(scales):
            given[f"NI_Scale[{k}]_Scale_Type"] = kind
            given.update({f"NI_Scale[{k}]_{kind}_{name}": value for name, value in values.items()})
        return given

    raw = 2**32 - 1
    volts = ("Linear", {"Slope": 2.0e-5, "Y_Intercept": 0.375, "Input_Source": raw})
    points = {f"Pre_Scaled_Values[{k}]": v for k, v in enumerate([0.5, 0.25, 0.0])}
    points |= {f"Scaled_Values[{k}]": v for k, v in enumerate([60.0, 21.0, -5.0])}
    resistance = {"Current_Excitation": 1e-3, "R0_Nominal_Resistance": 100.0, "A": 3.9083e-3, "B": -5.775e-7, "C": -4.183e-12}
    steinhart = {"A": 1.2873851e-3, "B": 2.3575235e-4, "C": 9.497806e-8, "Temperature_Offset": 273.15}
    laws = {
        "polynomial": [volts, ("Polynomial", {"Coefficients_Size": 3, "Coefficients[0]": -4.0, "Coefficients[1]": 70.0,
                                              "Coefficients[2]": 0.3, "Input_Source": 0})],
        "table": [volts, ("Table", {"Pre_Scaled_Values_Size": 3, "Scaled_Values_Size": 3, **points, "Input_Source": 0})],
        "resistance": [("Linear", {"Slope": 4.0e-6, "Y_Intercept": 0.1, "Input_Source": raw}),
                       ("RTD", {**resistance, "Lead_Wire_Resistance": 0.5, "Resistance_Configuration": 3, "Input_Source": 0})],
        "divider": [volts, ("Thermistor", {**steinhart, "Excitation_Type": 10322, "Excitation_Value": 2.5, "Lead_Wire_Resistance": 0.5,
                                           "Resistance_Configuration": 3, "R1_Reference_Resistance": 1e4, "Input_Source": 0})],
        "current": [volts, ("Thermistor", {**steinhart, "Excitation_Type": 10134, "Excitation_Value": 5e-5, "Lead_Wire_Resistance": 1.0,
                                           "Resistance_Configuration": 2, "R1_Reference_Resistance": 0.0, "Input_Source": 0})],
        "difference": [volts, ("Linear", {"Slope": 90.0, "Y_Intercept": 1.0, "Input_Source": 0}),
                       ("Subtract", {"Left_Operand_Input_Source": 0, "Right_Operand_Input_Source": 1})],
    }
    counts = np.round(9000 * np.sin(np.arange(ROWS) / 3)).astype(np.int16)
    path = HERE / "scales.tdms"
    with TdmsWriter(path) as writer:
        channels = [ChannelObject("daq", name, counts, {**waveform, **scaled(*law), "unit_string": "Deg C"}) for name, law in laws.items()]
        writer.write_segment(channels)
    expect("scales.tdms", [("time", "s", clock), *read(path, "daq", [(name, "Deg C") for name in laws])])

    # A scale that makes no temperature.
    with TdmsWriter(HERE / "strain.tdms") as writer:
        bridge = scaled(("Strain", {"Configuration": 10183, "Input_Source": raw}))
        writer.write_segment([ChannelObject("daq", name, counts, {**waveform, **bridge}) for name in ["T1", "T2"]])

    daqmx(scaled, resistance)
    big_endian(clock)


def daqmx(scaled, resistance):
    """What DAQmx logs of two thermocouples of type K whose cold junction is at a resistance thermometer.

    The file is put together with what npTDMS tests itself with. npTDMS takes the published inverse polynomials; what
    is expected here are the temperatures at which its reference function has the voltage.
    """
    from nptdms import TdmsFile
    from nptdms.test import test_daqmx, util
    from nptdms.thermocouples import type_k
    from scipy.optimize import brentq

    rng = np.random.default_rng(26)
    chunk = 16  # the last one is of eight rows
    counts = [np.round(4000 + amplitude * np.sin(np.arange(ROWS) / slow) + rng.normal(0, 2, ROWS)) for amplitude, slow in [(9000, 3), (6000, 5)]]
    cold = np.round(30 * np.sin(np.arange(ROWS) / 9))
    rows = b"".join(np.array([a, b], "<i4").tobytes() + np.array([c], "<i2").tobytes() for a, b, c in zip(*counts, cold))
    voltage = [
        ("Polynomial", {"Coefficients_Size": 2, "Coefficients[0]": 3.5, "Coefficients[1]": 0.25, "Input_Source": 0}),
        ("Linear", {"Slope": 2e-5, "Y_Intercept": 0.109, "Input_Source": 1}),
        ("RTD", {**resistance, "Lead_Wire_Resistance": 0.0, "Resistance_Configuration": 4, "Input_Source": 3}),
        ("Thermocouple", {"Thermocouple_Type": 10073, "Scaling_Direction": 1, "Input_Source": 4}),
        ("Add", {"Left_Operand_Input_Source": 2, "Right_Operand_Input_Source": 5}),
    ]
    temperature = ("Thermocouple", {"Thermocouple_Type": 10073, "Scaling_Direction": 0, "Input_Source": 6})

    def typed(properties):
        kinds = {str: (0x20, lambda v: util.hexlify_value("<I", len(v)) + util.string_hexlify(v))}
        kinds |= {int: (7, lambda v: util.hexlify_value("<I", v)), float: (10, lambda v: util.hexlify_value("<d", v))}
        return {name: (kinds[type(v)][0], kinds[type(v)][1](v)) for name, v in properties.items()}

    def write(path, scales):
        # Scales 0 and 1 are the counts: of the channel, and of the cold junction.
        properties = scaled(("", {}), ("", {}), *scales)
        properties = {name: v for name, v in properties.items() if not name.startswith(("NI_Scale[0]", "NI_Scale[1]"))}
        properties |= {"unit_string": "Deg C", "wf_increment": 0.002, "wf_start_offset": 0.0}
        channels = [
            test_daqmx.daqmx_channel_metadata(
                name, chunk, [10],
                [test_daqmx.daqmx_scaler_metadata(0, 5, at), test_daqmx.daqmx_scaler_metadata(1, 3, 8)], typed(properties))
            for name, at in [("T1", 0), ("T2", 4)]
        ]
        file = util.GeneratedFile()
        metadata = util.segment_objects_metadata(util.root_metadata(), util.group_metadata(), *channels)
        file.add_segment(("kTocMetaData", "kTocRawData", "kTocNewObjList", "kTocDAQmxRawData"), metadata, rows, binary_data=True)
        with file.get_tempfile() as written:
            path.write_bytes(written.file.read())
        with TdmsFile.open(path) as read:
            return [read["Group"][name][:] for name in ["T1", "T2"]]

    path = HERE / "daqmx.tdms"
    excess_mv = lambda celsius, uv: float(type_k.celsius_to_mv(np.array([celsius]))[0]) - uv / 1000
    exact = [[brentq(excess_mv, -200, 1372, args=(uv,), xtol=1e-11) for uv in channel] for channel in write(path, voltage)]
    for found, by_polynomials in zip(exact, write(path, [*voltage, temperature])):
        assert np.max(np.abs(np.array(found) - by_polynomials)) < 0.06, "NIST: within 0.06 K"
    expect("daqmx.tdms", [("time", "s", [0.002 * k for k in range(ROWS)]), ("T1", "Deg C", exact[0]), ("T2", "Deg C", exact[1])])


def big_endian(clock):
    """Numbers with the high byte first, as LabVIEW writes them where it is told to: npTDMS reads them and writes none."""
    from nptdms import TdmsFile

    def text(s):
        return struct.pack(">I", len(s.encode())) + s.encode()

    waveform = [("wf_increment", 0.002), ("wf_start_offset", 0.5)]
    properties = b"".join(text(name) + struct.pack(">Id", 10, value) for name, value in waveform)

    def channel(name):
        index = struct.pack(">IIIQ", 20, 10, 1, ROWS)
        return text(f"/'gas'/'{name}'") + index + struct.pack(">I", len(waveform)) + properties

    metadata = struct.pack(">I", 2) + channel("T1") + channel("T2")
    samples = np.concatenate([warm(27), warm(28)]).astype(">f8").tobytes()
    flags = 1 << 1 | 1 << 2 | 1 << 3 | 1 << 6
    lead_in = b"TDSm" + struct.pack("<I", flags) + struct.pack(">IQQ", 4713, len(metadata) + len(samples), len(metadata))
    path = HERE / "big_endian.tdms"
    path.write_bytes(lead_in + metadata + samples)
    with TdmsFile.open(path) as file:
        expect("big_endian.tdms", [("time", "s", clock), *((name, "", file["gas"][name][:]) for name in ["T1", "T2"])])


def parquet():
    import pandas
    import pyarrow
    import pyarrow.parquet as pq

    stamps = [START + datetime.timedelta(microseconds=1500 * k) for k in range(ROWS)]

    def read(path, units={}):
        table = pq.read_table(path)
        return [(name, units.get(name, ""), table[name].to_pylist()) for name in table.column_names]

    # Nulls, floats, whole numbers, texts; several row groups; zstd.
    t2 = [None if k % 9 == 2 else float(v) for k, v in enumerate(warm(32))]
    table = pyarrow.table({
        "time": pyarrow.array(stamps, pyarrow.timestamp("us")),
        "T1 [°C]": warm(31),
        "T2 [°C]": pyarrow.array(t2, pyarrow.float64()),
        "p": pyarrow.array(warm(33), pyarrow.float32()),
        "n": pyarrow.array(range(ROWS), pyarrow.uint16()),
        "remark": pyarrow.array(["ok" if k == 3 else None for k in range(ROWS)], pyarrow.string()),
    })
    pq.write_table(table, HERE / "nulls.parquet", compression="zstd", row_group_size=16)
    columns = read(HERE / "nulls.parquet")
    expect("nulls.parquet", [(n, u, ["" if v is None else v for v in vs] if n == "remark" else vs) for n, u, vs in columns])

    # A data frame with its index, snappy, dictionary; nanoseconds.
    frame = pandas.DataFrame({"T1": warm(34), "T2": np.round(warm(35), 1)}, index=pandas.DatetimeIndex(stamps, name="when"))
    frame.to_parquet(HERE / "frame.parquet")
    when = [np.datetime64(stamp) for stamp in stamps]
    expect("frame.parquet", [("T1", "", frame["T1"]), ("T2", "", frame["T2"]), ("when", "", when)])

    # Milliseconds, no compression, pages of version 2, a time in seconds.
    table = pyarrow.table({
        "t [s]": 0.5 * np.arange(ROWS),
        "T1": warm(36),
        "T2": warm(37),
        "when": pyarrow.array(stamps, pyarrow.timestamp("ms"), safe=False),
    })
    pq.write_table(table, HERE / "pages.parquet", compression="none", data_page_version="2.0", use_dictionary=False)
    expect("pages.parquet", read(HERE / "pages.parquet"))


def hdf5():
    import h5py

    # Groups, attributes of units, packed integers with a fill value, chunks; a time since an instant.
    path = HERE / "groups.h5"
    counts = np.round((warm(42) + 40) / 0.01).astype(np.int16)
    counts[[5, 17]] = -9999
    with h5py.File(path, "w") as file:
        gas = file.create_group("rig/gas")
        gas.create_dataset("time", data=0.25 * np.arange(ROWS)).attrs["units"] = "seconds since 2026-01-31 10:00:00"
        gas.create_dataset("T1", data=warm(41), chunks=(16,), compression="gzip", shuffle=True).attrs["units"] = "degC"
        packed = gas.create_dataset("T2", data=counts)
        packed.attrs.update({"units": "degC", "scale_factor": 0.01, "add_offset": -40.0, "_FillValue": np.int16(-9999)})
        file.create_dataset("rig/note", data="nothing")
        file.create_dataset("other/p", data=np.arange(7.0))
    with h5py.File(path) as file:
        gas = file["rig/gas"]
        t2 = [None if v == -9999 else float(v) * 0.01 + -40.0 for v in gas["T2"][:]]
        expect("groups.h5", [
            ("T1", "degC", gas["T1"][:]),
            ("T2", "degC", t2),
            ("time", "seconds since 2026-01-31 10:00:00", gas["time"][:]),
        ])

    # A mark of missing values that is a double, of values that are not.
    values = warm(49).astype(np.float32)
    values[7] = 1e20
    with h5py.File(HERE / "marks.h5", "w") as file:
        file.create_dataset("time", data=0.25 * np.arange(ROWS)).attrs["units"] = "s"
        file.create_dataset("T1", data=warm(40))
        file.create_dataset("T2", data=values).attrs["missing_value"] = 1e20
    t2 = masked(values, np.arange(ROWS) != 7)
    expect("marks.h5", [("T1", "", warm(40)), ("T2", "", t2), ("time", "s", 0.25 * np.arange(ROWS))])

    # Records with fields; floats of big-endian order.
    path = HERE / "records.h5"
    records = np.zeros(ROWS, dtype=[("t", "<f8"), ("T1", ">f4"), ("T2", "<f8"), ("n", "<i4")])
    records["t"], records["T1"], records["T2"], records["n"] = 0.1 * np.arange(ROWS), warm(43), warm(44), np.arange(ROWS)
    with h5py.File(path, "w") as file:
        file.create_dataset("log", data=records)
    with h5py.File(path) as file:
        log = file["log"][:]
        expect("records.h5", [(name, "", log[name]) for name in log.dtype.names])

    # A matrix, and the rate as an attribute.
    path = HERE / "matrix.h5"
    with h5py.File(path, "w") as file:
        matrix = file.create_dataset("T", data=np.stack([warm(45), warm(46)], axis=1).astype(np.float32))
        matrix.attrs["units"] = "K"
        file.attrs["fs"] = 500.0
    with h5py.File(path) as file:
        matrix = file["T"][:]
    clock = [0.002 * k for k in range(ROWS)]
    expect("matrix.h5", [("time", "s", clock), ("T 1", "K", matrix[:, 0]), ("T 2", "K", matrix[:, 1])])

    # MATLAB 7.3 as MATLAB lays it out: a block of text before, vectors as rows, classes as attributes.
    path = HERE / "seven.mat"
    with h5py.File(path, "w", userblock_size=512, libver="earliest") as file:
        for name, values in [("T1", warm(47)), ("T2", warm(48)), ("fs", np.array([100.0]))]:
            file.create_dataset(name, data=values.reshape(1, -1)).attrs["MATLAB_class"] = np.bytes_("double")
        text = np.frombuffer("rig".encode("utf-16-le"), np.uint16).reshape(-1, 1)
        file.create_dataset("title", data=text).attrs["MATLAB_class"] = np.bytes_("char")
    with open(path, "r+b") as file:
        file.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\0\2IM")
    clock = [0.01 * k for k in range(ROWS)]
    expect("seven.mat", [("time", "s", clock), ("T1", "", warm(47)), ("T2", "", warm(48))])


def netcdf():
    from netCDF4 import Dataset

    def write(path, kind, unlimited=False):
        with Dataset(path, "w", format=kind) as file:
            file.createDimension("time", None if unlimited else ROWS)
            time = file.createVariable("time", "f8", ("time",))
            time.units = "seconds since 2026-01-31 10:00:00"
            time[:] = 0.25 * np.arange(ROWS)
            t1 = file.createVariable("T1", "f8", ("time",), fill_value=-999.0)
            t1.units = "degC"
            t1[:] = np.ma.masked_where(np.arange(ROWS) % 13 == 6, warm(51))
            t2 = file.createVariable("T2", "i2", ("time",))
            t2.setncatts({"units": "K", "scale_factor": 0.01, "add_offset": 300.0, "valid_range": np.array([-3000, 3000], "i2")})
            t2.set_auto_maskandscale(False)
            stored = np.round((warm(52) + 273.15 - 300) / 0.01).astype(np.int16)
            stored[8] = 9999
            t2[:] = stored

    def read(path):
        with Dataset(path) as file:
            columns = []
            for name in ["time", "T1", "T2"]:
                variable = file[name]
                valid = ~np.ma.getmaskarray(variable[:])
                # The library scales floats in another order on some platforms; it is defined as stored * scale + offset.
                variable.set_auto_maskandscale(False)
                scale, offset = getattr(variable, "scale_factor", 1.0), getattr(variable, "add_offset", 0.0)
                values = [float(v) * scale + offset if "scale_factor" in variable.ncattrs() else float(v) for v in variable[:]]
                columns.append((name, variable.units, masked(values, valid)))
            return columns

    for name, kind, unlimited in [
        ("classic.nc", "NETCDF3_CLASSIC", True),
        ("offset.nc", "NETCDF3_64BIT_OFFSET", False),
        ("four.nc", "NETCDF4", False),
    ]:
        write(HERE / name, kind, unlimited)
        expect(name, read(HERE / name))

    # Whole numbers that are stored as if they had a sign, and floats whose mark of missing ones is a double, big-endian; the
    # last rows of one were never written.
    for name, kind in [("marks.nc", "NETCDF3_CLASSIC"), ("marks4.nc", "NETCDF4")]:
        with Dataset(HERE / name, "w", format=kind) as file:
            file.createDimension("time", None)
            file.createVariable("time", "f8", ("time",))[:] = 0.25 * np.arange(ROWS)
            file["time"].units = "s"
            t1 = file.createVariable("T1", "i2", ("time",), fill_value=np.int16(-1))
            t1.setncatts({"units": "K", "scale_factor": 0.01, "_Unsigned": "true"})
            t1.set_auto_maskandscale(False)
            stored = np.round((warm(55) + 400) / 0.01).astype(np.uint16)
            stored[[4, 9]] = 65535
            t1[:] = stored.view(np.int16)
            t2 = file.createVariable("T2", "f4", ("time",), endian="big" if kind == "NETCDF4" else "native")
            t2.setncatts({"units": "K", "missing_value": 1e20})
            t2.set_auto_maskandscale(False)
            values = warm(56).astype(np.float32)
            values[7] = 1e20
            t2[:35] = values[:35]
        # netCDF4-python applies no double mark that no float equals. The values expected here are those that were written.
        t1 = [None if v == 65535 else float(v) * 0.01 + 0.0 for v in stored]
        t2 = masked(values, [k != 7 and k < 35 for k in range(ROWS)])
        expect(name, [("time", "s", 0.25 * np.arange(ROWS)), ("T1", "K", t1), ("T2", "K", t2)])

    # Two dimensions, groups, and values that were never written.
    path = HERE / "stations.nc"
    with Dataset(path, "w") as file:
        rig = file.createGroup("rig")
        rig.createDimension("time", ROWS)
        rig.createDimension("place", 2)
        rig.createVariable("time", "i4", ("time",))[:] = 100 * np.arange(ROWS)
        rig["time"].units = "milliseconds since 2026-01-31"
        t = rig.createVariable("T", "f4", ("time", "place"))
        t.units = "degC"
        t[:30, :] = np.stack([warm(53), warm(54)], axis=1)[:30]
    with Dataset(path) as file:
        rig = file["rig"]
        values = np.ma.filled(rig["T"][:], np.nan)
        expect("stations.nc", [
            ("time", rig["time"].units, rig["time"][:]),
            ("T 1", "degC", values[:, 0]),
            ("T 2", "degC", values[:, 1]),
        ])


def numpy():
    # A structured array with instants, big-endian and whole numbers, and a gap for alignment.
    path = HERE / "fields.npy"
    kinds = np.dtype([("when", "<M8[us]"), ("T1", ">f8"), ("n", "<u2"), ("T2", "<f4")], align=True)
    records = np.zeros(ROWS, dtype=kinds)
    records["when"] = np.datetime64(START) + np.arange(ROWS) * np.timedelta64(1500, "us")
    records["T1"], records["n"], records["T2"] = warm(61), np.arange(ROWS), warm(62)
    records["T1"][4] = np.nan
    np.save(path, records)
    back = np.load(path)
    expect("fields.npy", [(name, "", list(back[name])) for name in back.dtype.names])

    # A matrix in the order of Fortran.
    path = HERE / "matrix.npy"
    np.save(path, np.asfortranarray(np.stack([0.5 * np.arange(ROWS), warm(63), warm(64)], axis=1)))
    back = np.load(path)
    expect("matrix.npy", [("", "", back[:, column]) for column in range(3)])

    # Names, a rate, floats, an array of another length.
    path = HERE / "named.npz"
    np.savez_compressed(path, T1=warm(65), T2=warm(66).astype(np.float32), fs=np.float64(50), other=np.arange(3))
    back = np.load(path)
    clock = [0.02 * k for k in range(ROWS)]
    expect("named.npz", [("time", "s", clock), ("T1", "", back["T1"]), ("T2", "", back["T2"])])


def matlab():
    from scipy.io import loadmat, savemat

    def read(path, names):
        back = loadmat(path)
        return [(name, "", back[name].ravel()) for name in names]

    # Vectors with their time, compressed, beside a text and a structure.
    path = HERE / "vectors.mat"
    values = {"t": 0.1 * np.arange(ROWS), "T1": warm(71), "T2": warm(72).astype(np.float32)}
    savemat(path, {**values, "title": "rig", "settings": {"gain": 2.0}}, do_compression=True, oned_as="column")
    expect("vectors.mat", read(path, ["t", "T1", "T2"]))

    # A rate instead of a time; whole numbers; rows.
    path = HERE / "rate.mat"
    savemat(path, {"T1": warm(73), "T2": np.arange(ROWS, dtype=np.int32), "Fs": 20.0}, oned_as="row")
    clock = [0.05 * k for k in range(ROWS)]
    expect("rate.mat", [("time", "s", clock), *read(path, ["T1", "T2"])])

    # A matrix, whose columns are channels.
    path = HERE / "columns.mat"
    savemat(path, {"T": np.stack([warm(74), warm(75)], axis=1), "dt": 0.25})
    back = loadmat(path)["T"]
    clock = [0.25 * k for k in range(ROWS)]
    expect("columns.mat", [("time", "s", clock), ("T 1", "", back[:, 0]), ("T 2", "", back[:, 1])])


MAKERS = {maker.__name__: maker for maker in [spreadsheets, mdf, tdms, parquet, hdf5, netcdf, numpy, matlab]}

if __name__ == "__main__":
    HERE.mkdir(exist_ok=True)
    for wanted in sys.argv[1:] or MAKERS:
        MAKERS[wanted]()
