"""Python's numbers are those of the program, to the last bit."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path

import pytest
from conftest import REPOSITORY

import twinlag as tl

DATA = REPOSITORY / "tests/data"
SHARED = REPOSITORY.parent / "shared"
RECORDS = sorted(DATA.glob("*.csv"))


def said(program: str, verb: str, path: Path) -> dict:
    """The program's answer, without how it was asked and read."""
    out = subprocess.run([program, verb, str(path), "--json", "--quiet"], capture_output=True, check=False, text=True)
    assert out.returncode in (0, 4), out.stderr
    return without_making(json.loads(out.stdout))


def without_making(answer: object) -> object:
    """An answer without what is of the program alone: its notes name options, and commands."""
    if isinstance(answer, dict):
        return {key: without_making(value) for key, value in answer.items() if key not in {"notes", "made_by", "advice"}}
    if isinstance(answer, list):
        return [without_making(item) for item in answer]
    return answer


@pytest.mark.parametrize("path", RECORDS, ids=lambda path: path.stem)
@pytest.mark.parametrize("verb", ["characterise", "diagnose"])
def test_answers_are_those_of_the_program(program: str, verb: str, path: Path) -> None:
    answer = getattr(tl, verb)(tl.read(path))
    assert without_making(answer.to_dict()) == said(program, verb, path)


@pytest.mark.parametrize("path", sorted(SHARED.glob("challenge/*.csv")), ids=lambda path: path.stem)
def test_answers_to_the_challenge_are_those_of_the_program(program: str, path: Path) -> None:
    answer = tl.characterise(tl.read(path))
    assert without_making(answer.to_dict()) == said(program, "characterise", path)


def test_records_of_one_rig_are_diagnosed_together() -> None:
    rigs = [tl.EXAMPLE_RIG.replace("seed = 1", f"seed = {seed}") for seed in (1, 2, 3)]
    answer = tl.diagnose([tl.simulate(rig) for rig in rigs])
    assert len(answer.records) == 3
    for channel, truth in [("fine", 0.0238), ("coarse", 0.1168)]:
        low, high = answer.sensors[channel].interval
        assert low < truth < high


def test_known_values_are_those_of_a_sensor_by_its_name(rig: tl.Record) -> None:
    answer = tl.characterise(rig, known={"fine": (0.0238, 1e-4)})
    assert "0.0238 ± 0.0001" in answer.sensors["fine"].because
    assert tl.characterise(rig, known={"T1": "23.8ms"}).sensors[0].time_constant_s == 0.0238
    for wrong in [{"T3": 1.0}, {"T1": "23.8 kg"}, {"T1": -1.0}]:
        with pytest.raises(ValueError, match="expected"):
            tl.characterise(rig, known=wrong)


def test_a_value_that_the_record_contradicts_is_not_given(rig: tl.Record) -> None:
    for verb in (tl.characterise, tl.diagnose):
        fine = verb(rig, known={"fine": 0.1}).sensors["fine"]
        assert (fine.time_constant_s, fine.grade) == (None, "no-go") and "contradicts" in fine.because


def test_optimisers_and_a_bootstrap_are_called_by_name(rig: tl.Record) -> None:
    usual = tl.characterise(rig).sensors["fine"]
    simplex = tl.characterise(rig, estimator="bias-compensated", optimiser="nelder-mead").to_dict()
    assert simplex["optimiser"] == "nelder-mead"
    low, high = tl.characterise(rig, intervals="bootstrap", replicates=39).sensors["fine"].interval
    assert low < usual.time_constant_s < high


def test_options_that_cannot_be_are_refused(rig: tl.Record) -> None:
    with pytest.raises(ValueError, match="free: expected gain or offset, got 'slope'"):
        tl.characterise(rig, free=["slope"])
    for option, expected in {"estimator": "whitened", "optimiser": "nelder-mead", "hold": "bilinear", "intervals": "profile"}.items():
        with pytest.raises(ValueError, match=f"{option}.*oracle.*{expected}"):
            tl.characterise(rig, **{option: "oracle"})
    with pytest.raises(ValueError, match="replicates: of a bootstrap alone"):
        tl.characterise(rig, replicates=50)
    with pytest.raises(TypeError, match="no option 'nkown'; did you mean 'known'?"):
        tl.characterise(rig, nkown=1)
    for wrong in [{1: 0.05}, ["T1"], {"T1": True}]:
        with pytest.raises(TypeError, match="known"):
            tl.characterise(rig, known=wrong)
    for levels in [0.05, (0.1, 0.1, 0.1)]:
        with pytest.raises(ValueError, match="levels of both sensors"):
            tl.characterise(rig, noise_std_k=levels)
    with pytest.raises(ValueError, match="one of them twice"):
        tl.characterise([rig, rig])
    with pytest.raises(TypeError, match="twinlag.Record"):
        tl.characterise([1, 2, 3])
    with pytest.raises(ValueError, match="effect|variant|expected"):
        tl.diagnose(rig, without=["magic"])


def test_free_gain_and_offset(rig: tl.Record) -> None:
    answer = tl.characterise(rig, free=("gain", "offset"))
    low, high = answer.free.gain.interval_95
    assert low < 1.0 < high
    low, high = answer.free.offset_K.interval_95
    assert low < 0.0 < high
