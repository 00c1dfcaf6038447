"""What the package takes, for a reader: `cargo xtask python --measure` runs it, and says beside it what the library takes.

    python measure.py RECORD

The last line is JSON with what the library is compared in.
"""

from __future__ import annotations

import gc
import json
import os
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np

import twinlag as tl

MB = 1e6
STARTS = 5
RIGS = 8


def import_s(module: str) -> float:
    """The least time of several in which Python starts and imports a module."""
    times = []
    for _ in range(STARTS):
        begun = time.perf_counter()
        subprocess.run([sys.executable, "-c", f"import {module}"], check=True)
        times.append(time.perf_counter() - begun)
    return min(times)


def memory_mb(what: str) -> float:
    """What Linux says of this process: `VmRSS` is its memory, `VmHWM` the most since `reset_peak`."""
    lines = Path("/proc/self/status").read_text().splitlines()
    return next(int(line.split()[1]) for line in lines if line.startswith(what)) * 1024 / MB


def reset_peak() -> None:
    gc.collect()
    Path("/proc/self/clear_refs").write_text("5")


def imports() -> None:
    nothing, numpy, twinlag = (import_s(module) for module in ("sys", "numpy", "twinlag"))
    print(f"import twinlag: {twinlag - nothing:.3f} s, which imports NumPy when it is needed: {numpy - nothing:.3f} s")


def threads() -> None:
    records = [tl.simulate(tl.EXAMPLE_RIG.replace("seed = 1", f"seed = {seed}")) for seed in range(RIGS)]
    begun = time.perf_counter()
    alone = [tl.diagnose(record).to_dict() for record in records]
    one_s = time.perf_counter() - begun
    begun = time.perf_counter()
    with ThreadPoolExecutor(RIGS) as pool:
        together = [answer.to_dict() for answer in pool.map(tl.diagnose, records)]
    all_s = time.perf_counter() - begun
    if together != alone:
        raise SystemExit("threads give other answers than one after the other")
    print(f"{RIGS} diagnoses: {one_s:.2f} s one after the other, {all_s:.2f} s in {RIGS} threads on {os.cpu_count()} processors, the same answers")


def long_record(path: str) -> None:
    read = tl.read(path)
    arrays = [np.array(values) for values in (read.time_s, read.t1_c, read.t2_c)]
    del read
    reset_peak()
    size_mb = sum(values.nbytes for values in arrays) / MB
    before_mb = memory_mb("VmRSS")
    begun = time.perf_counter()
    record = tl.Record(*arrays)
    made_s = time.perf_counter() - begun
    after_mb, most_mb = memory_mb("VmRSS"), memory_mb("VmHWM")
    print(
        f"a record of {len(record)} samples from {size_mb:.0f} MB of arrays: {made_s:.2f} s, {after_mb - before_mb:.0f} MB more, "
        f"at most {most_mb - before_mb:.0f} MB"
    )
    begun, used_s = time.perf_counter(), time.process_time()
    answer = tl.characterise(record)
    wall_s, processor_s = time.perf_counter() - begun, time.process_time() - used_s
    tau_s = [sensor.time_constant_s for sensor in answer.sensors.values()]
    print(json.dumps({"rows": len(record), "wall_s": wall_s, "processor_s": processor_s, "peak_mb": memory_mb("VmHWM"), "tau_s": tau_s}))


if __name__ == "__main__":
    imports()
    threads()
    long_record(sys.argv[1])
