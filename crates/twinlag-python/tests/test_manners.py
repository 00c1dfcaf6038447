"""Threads, Ctrl-C, progress."""

from __future__ import annotations

import signal
import subprocess
import sys
import textwrap
from concurrent.futures import ThreadPoolExecutor

import pytest

import twinlag as tl


def rigs(count: int) -> list[tl.Record]:
    return [tl.simulate(tl.EXAMPLE_RIG.replace("seed = 1", f"seed = {seed}")) for seed in range(count)]


def test_eight_threads_say_what_one_says() -> None:
    records = rigs(8)
    alone = [tl.diagnose(record).to_dict() for record in records]
    with ThreadPoolExecutor(8) as pool:
        together = [answer.to_dict() for answer in pool.map(tl.diagnose, records)]
    assert together == alone


def test_progress_is_reported_and_may_stop_the_work(calibrated) -> None:
    steps = []
    tl.diagnose(calibrated, progress=lambda task, done, total: steps.append((task, done, total)))
    assert steps and all(0 <= done <= total for _, done, total in steps)

    def stop(*_: object) -> None:
        raise RuntimeError("enough")

    with pytest.raises(RuntimeError, match="enough"):
        tl.diagnose(calibrated, progress=stop)
    pytest.importorskip("tqdm")
    assert tl.diagnose(calibrated, progress=True).verdict == "explained"


@pytest.mark.skipif(sys.platform == "win32", reason="signals are sent otherwise there")
def test_ctrl_c_stops_a_diagnosis() -> None:
    script = textwrap.dedent(
        """
        import signal
        import twinlag as tl
        # A process that was begun in the background ignores Ctrl-C.
        signal.signal(signal.SIGINT, signal.default_int_handler)
        rig = tl.EXAMPLE_RIG.replace("samples = 2500", "samples = 200000")
        record = tl.simulate(rig)
        try:
            print("begun", flush=True)
            while True:
                tl.diagnose(record)
        except KeyboardInterrupt:
            print("stopped", flush=True)
        """
    )
    process = subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, text=True)
    assert process.stdout.readline() == "begun\n"
    process.send_signal(signal.SIGINT)
    assert process.stdout.readline() == "stopped\n"
    assert process.wait() == 0
