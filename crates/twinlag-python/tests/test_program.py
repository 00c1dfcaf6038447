"""The program that the wheel brings along."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import twinlag as tl


def run(*arguments: str, **options: object) -> subprocess.CompletedProcess[str]:
    script = Path(sys.executable).with_name("twinlag")
    return subprocess.run([script, *arguments], capture_output=True, text=True, check=False, **options)


def test_it_answers_as_the_package_does(tmp_path) -> None:
    rig = tmp_path / "rig.toml"
    rig.write_text(tl.EXAMPLE_RIG)
    assert run("simulate", "rig.toml", "--out", "run.csv", cwd=tmp_path).returncode == 0
    said = run("characterise", "run.csv", "--json", "--quiet", cwd=tmp_path)
    answer = tl.characterise(tl.read(tmp_path / "run.csv"))
    assert json.loads(said.stdout)["sensors"] == answer.to_dict()["sensors"]


def test_its_manners_are_those_of_a_program() -> None:
    version = run("--version")
    assert version.returncode == 0 and version.stdout.startswith(f"twinlag {tl.__version__}")
    wrong = run("characterise")
    assert wrong.returncode == 2 and "Usage: twinlag characterise" in wrong.stderr
    missing = run("characterise", "nothing.csv")
    assert missing.returncode == 3 and "nothing.csv" in missing.stderr
    module = subprocess.run([sys.executable, "-m", "twinlag", "explain", "gain"], capture_output=True, text=True, check=True)
    assert module.stdout == run("explain", "gain").stdout != ""
