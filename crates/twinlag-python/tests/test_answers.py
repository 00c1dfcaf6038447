"""Answers: fields, tables, pages, models, pickling."""

from __future__ import annotations

import html
import json
import os
import pickle

import numpy as np
import pytest

import twinlag as tl


def shown(answer: tl.Answer) -> str:
    """The page that an answer shows in a notebook."""
    return html.unescape(answer._repr_html_().split('srcdoc="')[1].split('"')[0])


@pytest.fixture(scope="module")
def diagnosis(calibrated) -> tl.Diagnosis:
    return tl.diagnose(calibrated)


def test_effects_are_found_with_their_numbers(diagnosis) -> None:
    assert diagnosis.verdict == "explained" and diagnosis.ok
    found = {effect.effect: effect for effect in diagnosis.effects}
    low, high = found["calibration"].numbers["offset"].interval_95
    assert low < 2.0 < high
    low, high = found["second-order"].numbers["second_time_constant"].interval_95
    assert low < 0.02 < high
    assert "second-order" in str(diagnosis) and "explained" in repr(diagnosis)
    assert diagnosis.error.chi2_per_dof.after < diagnosis.error.chi2_per_dof.before


def test_fields_are_attributes_and_what_is_not_there_is_named(diagnosis) -> None:
    assert diagnosis.record.samples == 2500
    assert diagnosis.sensors["coarse"].interval == tuple(diagnosis.sensors[1]["interval_95_s"])
    with pytest.raises(AttributeError, match="no field 'verdicts'"):
        _ = diagnosis.verdicts
    with pytest.raises(KeyError, match="there are fine, coarse"):
        _ = diagnosis.sensors["T1"]
    assert json.loads(json.dumps(diagnosis.to_dict())) == diagnosis.to_dict()


def test_tables_and_pages(diagnosis, tmp_path) -> None:
    pytest.importorskip("pandas")
    frame = diagnosis.to_frame()
    assert set(frame["number"]) >= {"time constant", "difference", "offset", "second_time_constant"}
    page = tmp_path / "page.html"
    diagnosis.report(page, static=True)
    assert "<html" in page.read_text(encoding="utf-8") and "Diagnosis of" in page.read_text(encoding="utf-8")
    framed = shown(diagnosis)
    verdict = framed.split('class="lead')[1].split("</p>")[0]
    assert "<svg" in framed and verdict in page.read_text(encoding="utf-8") and "How to reproduce" not in framed
    with pytest.raises(ValueError, match="no page"):
        tl.characterise(tl.simulate(tl.EXAMPLE_RIG)).report(page)


def test_a_name_that_is_a_script_stays_a_name(arrays) -> None:
    time_s, t1, t2 = arrays
    answer = tl.diagnose(tl.Record(time_s, t1, t2, names=("<script>alert(1)</script>", "b")))
    assert "<script" not in shown(answer) and "alert(1)" in shown(answer)
    assert "<script" not in answer._repr_html_()


def test_each_answer_shows_itself_in_a_notebook(rig, diagnosis) -> None:
    assert "Gas temperature of" in shown(tl.compensate(rig)) and "Time constants along" in shown(tl.track(rig))
    for without_page in (tl.characterise(rig), pickle.loads(pickle.dumps(diagnosis))):
        assert "<table>" in without_page._repr_html_() and "<iframe" not in without_page._repr_html_()


def test_an_answer_survives_pickling_with_its_numbers(diagnosis, rig) -> None:
    again = pickle.loads(pickle.dumps(diagnosis))
    assert again.to_dict() == diagnosis.to_dict() and type(again) is tl.Diagnosis
    with pytest.raises(ValueError, match="pickled"):
        again.report("page.html")
    gas = tl.compensate(rig)
    assert np.array_equal(pickle.loads(pickle.dumps(gas)).gas_c, gas.gas_c)
    assert again.model == diagnosis.model and pickle.loads(pickle.dumps(gas)).model == gas.model


def test_the_numbers_of_an_answer_cannot_be_changed(rig) -> None:
    gas = tl.compensate(rig)
    for answer in (gas, pickle.loads(pickle.dumps(gas))):
        with pytest.raises(ValueError, match="read-only"):
            answer.gas_c[0] = 0.0


def test_a_model_goes_to_another_record(diagnosis, calibrated, tmp_path) -> None:
    path = tmp_path / "model.json"
    diagnosis.model.save(path)
    model = tl.load_model(path)
    assert model == diagnosis.model and pickle.loads(pickle.dumps(model)) == model
    gas = model.compensate(calibrated)
    assert gas.status == "ok" and len(gas.gas_c) == len(calibrated)
    inside = np.abs(gas.gas_c - calibrated.reference_c) < 1.96 * gas.gas_std_k
    # Of 2500 that hang together; the level is 95 %.
    assert np.mean(inside) > 0.85
    assert model.characterise(calibrated).sensors["fine"].time_constant_s is not None
    path.write_text("{}")
    with pytest.raises(ValueError, match="expected a model"):
        tl.load_model(path)


def test_files_are_written_as_a_whole(diagnosis, tmp_path, monkeypatch) -> None:
    path = tmp_path / "model.json"
    path.write_text("old")
    path.chmod(0o640)

    def full(_: int) -> None:
        raise OSError("no space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(OSError, match="no space"):
        diagnosis.model.save(path)
    assert path.read_text() == "old" and list(tmp_path.iterdir()) == [path]
    monkeypatch.undo()
    diagnosis.model.save(path)
    assert tl.load_model(path) == diagnosis.model and path.stat().st_mode & 0o777 == 0o640


def test_forms_of_compensation(rig) -> None:
    errors = {}
    for form in ("smoother", "filter", 5):
        gas = tl.compensate(rig, form=form)
        errors[form] = np.sqrt(np.mean((gas.gas_c - rig.reference_c) ** 2))
    assert max(errors["smoother"], errors[5]) < errors["filter"]
    with pytest.raises(ValueError, match="trust"):
        tl.compensate(rig, trust="T3")


def test_tracks_and_live(rig) -> None:
    answer = tl.track(rig)
    assert answer.change == "constant"
    assert answer.series("tau1_s").shape == rig.time_s.shape
    live = tl.Live(rig)
    assert live.start.ok
    rows = [live.push(t1, t2, t) for t, t1, t2 in zip(rig.time_s[:50], rig.t1_c, rig.t2_c)]
    assert all(row.gas_std_k > 0 for row in rows) and rows[10].time_s == rig.time_s[10]
    assert live.push(450.0, float("nan")) is not None
    assert live.push(450.0, 450.0, time_s=-1.0) is None
    for t1, time_s in [(1e9, None), (-500.0, None), (float("inf"), None), (450.0, float("nan"))]:
        with pytest.raises(tl.RecordError, match="absolute zero|an instant"):
            live.push(t1, 450.0, time_s)
    assert live.push(450.0, 450.0).gas_std_k < 100.0
    pause_s = 3600.0
    assert live.push(450.0, 450.0, pause_s) is None
    assert live.push(450.0, 450.0, pause_s + 0.002).is_resumed and not live.push(450.0, 450.0).is_resumed
    with pytest.raises(ValueError, match="change_per_root_s"):
        tl.Live(rig, change_per_root_s=-1.0)
    with pytest.raises(tl.RecordError):
        tl.Live(tl.simulate(tl.EXAMPLE_RIG.replace("samples = 2500", "samples = 30")))


def test_live_goes_on(rig, tmp_path) -> None:
    live = tl.Live(rig, best_effort=True)
    rows = list(zip(rig.t1_c, rig.t2_c, rig.time_s))
    for row in rows[:700]:
        live.push(*row)
    path = tmp_path / "live.json"
    live.save(path)
    loaded, pickled = tl.load_live(path), pickle.loads(pickle.dumps(live))
    assert loaded.start.to_dict() == live.start.to_dict()
    for t1, t2, time_s in rows[700:900]:
        now = live.push(t1, t2, time_s)
        assert loaded.push(t1, t2, time_s) == now == pickled.push(t1, t2, time_s)
    damaged = path.read_text().replace("tau_s", "tau_z", 1)
    for text in [damaged, "", "{}", '{"schema":"other/1","sha256":""}\n']:
        path.write_text(text)
        with pytest.raises(ValueError, match="written by Live.save"):
            tl.load_live(path)
    with pytest.raises(FileNotFoundError):
        tl.load_live(tmp_path / "none.json")


def test_pictures(diagnosis, rig) -> None:
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    assert tl.compensate(rig).plot().get_ylabel() == "temperature (°C)"
    assert tl.track(rig).plot().get_yscale() == "log"
    axes = diagnosis.plot()
    assert diagnosis.plot(ax=axes) is axes


def test_rigs_come_as_text_mapping_or_file(tmp_path) -> None:
    path = tmp_path / "rig.toml"
    path.write_text(tl.EXAMPLE_RIG)
    text, file = tl.simulate(tl.EXAMPLE_RIG), tl.simulate(path)
    assert np.array_equal(text.t1_c, file.t1_c) and file.reference_c is not None
    rig = {
        "seed": 1,
        "record": {"samples": 100, "sample_period_s": 0.1},
        "gas": {"kind": "turbulence", "mean_c": 20.0, "std_k": 1.0, "corner_hz": 0.1, "cutoff_hz": 1.0},
        "sensors": [{"channel": "a", "time_constant_s": 0.5}, {"channel": "b", "time_constant_s": 2.0}],
    }
    assert tl.simulate(rig).channels == ("a", "b")
    with pytest.raises(ValueError, match="seed|missing|expected"):
        tl.simulate({"seed": 1})


def test_names_of_the_record_go_before_those_of_the_library(arrays) -> None:
    time_s, t1, t2 = arrays
    plain = tl.Record(time_s, t1, t2, names=("a", "b"))
    crossed = tl.Record(time_s, t1, t2, names=("T2", "T1"))
    want = tl.characterise(plain, known={"a": (0.05, 0.02)}).sensors[0].time_constant_s
    assert tl.characterise(crossed, known={"T2": (0.05, 0.02)}).sensors[0].time_constant_s == want
    assert tl.characterise(crossed, known={"T1": (0.05, 0.02)}).sensors[0].time_constant_s != want
    for of_plain, of_crossed in ((None, None), ("a", "T2"), ("b", "T1")):
        gas = tl.compensate(crossed, trust=of_crossed)
        assert np.array_equal(gas.gas_c, tl.compensate(plain, trust=of_plain).gas_c)


def test_a_model_of_another_schema_is_refused(diagnosis, tmp_path) -> None:
    path = tmp_path / "model.json"
    diagnosis.model.save(path)
    saved = json.loads(path.read_text(encoding="utf-8"))
    for fields in ({**saved, "schema": "twinlag.model/99"}, {"schema": "twinlag.model/1"}, [], 1):
        path.write_text(json.dumps(fields), encoding="utf-8")
        with pytest.raises(ValueError, match="expected a model"):
            tl.load_model(path)
    with pytest.raises(TypeError, match="load_model"):
        tl.compensate(tl.simulate(tl.EXAMPLE_RIG), model=str(path))


@pytest.mark.parametrize(
    "options",
    [
        {"noise_std_k": (np.nan, 0.1)},
        {"noise_ratio": np.inf},
        {"known": {"T1": np.nan}},
        {"known": {"T1": (0.1,)}},
        {"quiet_s": (0, 1)},
        {"quiet_s": [(0, np.nan)]},
        {"discard": -1},
        {"discard": 2.5},
        {"intervals": "bootstrap", "seed": True},
        {"estimator": 5},
        {"hold": ["auto"]},
        {"best_effort": "no"},
        {"noise_ratio": "1"},
        {"progress": "yes"},
    ],
)
def test_options_that_are_not_what_they_have_to_be_are_named(rig, options) -> None:
    with pytest.raises((TypeError, ValueError), match=rf"^{list(options)[-1]}\b"):
        tl.characterise(rig, **options)
    assert tl.characterise(rig, free=None, second_order=None, noise_ratio=np.float32(1.0)).ok


def test_series_go_to_the_rows_of_a_frame(rig) -> None:
    pd = pytest.importorskip("pandas")
    index = pd.date_range("2026-01-31", periods=len(rig), freq="2ms", name="time")
    readings = pd.DataFrame({"fine_C": rig.t1_c, "coarse_C": rig.t2_c}, index=index)
    # Rows 700 to 709 were never logged, and a reading of row 300 is missing.
    readings.iloc[300, 0] = np.nan
    logged = readings.drop(readings.index[700:710])
    gas = tl.compensate(tl.Record.from_frame(logged))
    assert len(gas.gas_c) == len(index)
    want = np.delete(gas.gas_c, np.arange(700, 710))
    # Labels of the caller's own, some of them twice, and a column with the name of the program's.
    twice = logged.assign(time_s=0.0).set_axis(np.arange(len(logged)) // 2)
    for frame in (logged, twice):
        beside = pd.concat([frame, gas.to_frame(frame.index)], axis=1)
        assert np.array_equal(beside["gas_C"], want) and beside.index.equals(frame.index)
        assert set(beside["grade"]) == {gas.grade}
    assert pickle.loads(pickle.dumps(gas)).to_frame(logged.index).equals(gas.to_frame(logged.index))
    with pytest.raises(ValueError, match="rows"):
        gas.to_frame(index)


def test_a_track_of_windows_has_no_rows_of_the_record() -> None:
    pytest.importorskip("pandas")
    longer = tl.simulate(tl.EXAMPLE_RIG.replace("samples = 2500", "samples = 10000"))
    track = tl.track(longer, window_s=5.0)
    assert len(pickle.loads(pickle.dumps(track)).to_frame()) == len(track.time_s) > 0
    with pytest.raises(ValueError, match="windows"):
        track.to_frame(range(len(longer)))


def test_a_folder_that_is_not_there_is_named(diagnosis, tmp_path) -> None:
    with pytest.raises(FileNotFoundError, match="no such folder.*nowhere'$"):
        diagnosis.report(tmp_path / "nowhere" / "page.html")


def test_what_is_not_used_is_said(rig, diagnosis, tmp_path) -> None:
    assert "not used here: estimator" in str(tl.diagnose(rig, estimator="hybrid"))
    with pytest.raises(ValueError, match="^without: "):
        tl.compensate(rig, model=diagnosis.model, without=["delay"])
    text = tmp_path / "record.csv"
    rig.to_frame().to_csv(text)
    with pytest.raises(tl.RecordError, match="group"):
        tl.read(text, group="gas")
    for form in (-3, True, "backward"):
        with pytest.raises((TypeError, ValueError), match="^form: "):
            tl.compensate(rig, form=form)
    picture = tmp_path / "picture.png"
    picture.write_bytes(b"\x89PNG\r\n")
    with pytest.raises(ValueError, match="picture.png: expected a model"):
        tl.load_model(picture)
    with pytest.raises(TypeError, match="expected a twinlag.Record"):
        tl.diagnose(None)
