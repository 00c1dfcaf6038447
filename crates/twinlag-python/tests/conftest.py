"""What several tests need."""

from __future__ import annotations

import os
import shutil
from pathlib import Path

import numpy as np
import pytest

import twinlag as tl

REPOSITORY = Path(__file__).resolve().parents[3]


@pytest.fixture(scope="session")
def rig() -> tl.Record:
    """Two first-order sensors in turbulence, 0.0238 and 0.1168 s."""
    return tl.simulate(tl.EXAMPLE_RIG)


@pytest.fixture(scope="session")
def calibrated() -> tl.Record:
    """The same sensors, of which the second reads 2 K too hot and has a second lag of 0.02 s."""
    rig = tl.EXAMPLE_RIG.replace('channel = "coarse"', 'channel = "coarse"\nsecond_time_constant_s = 0.02\noffset_k = 2.0')
    return tl.simulate(rig)


@pytest.fixture(scope="session")
def arrays(rig: tl.Record) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Instants and readings of the rig."""
    return rig.time_s, rig.t1_c, rig.t2_c


@pytest.fixture(scope="session")
def program() -> str:
    """The program of the same sources: TWINLAG_PROGRAM, or what the repository was built to."""
    candidates = [os.environ.get("TWINLAG_PROGRAM"), REPOSITORY / "target/release/twinlag", REPOSITORY / "target/debug/twinlag"]
    for candidate in candidates:
        if candidate and Path(candidate).exists():
            return str(candidate)
    found = shutil.which("twinlag")
    if found is None:
        pytest.fail("no program to compare with: set TWINLAG_PROGRAM, or build it by `cargo build --release`")
    return found
