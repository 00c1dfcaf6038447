"""A HyperQueue server of one's own with workers on this machine, until standard input ends.

    python3 hq-local.py DIR WORKERS

Needs the package `hyperqueue` (pip install hyperqueue). Clients reach it with HQ_SERVER_DIR=DIR.
"""

import sys

from hyperqueue import LocalCluster
from hyperqueue.cluster import WorkerConfig

directory, workers = sys.argv[1:]
with LocalCluster(server_dir=directory) as cluster:
    for _ in range(int(workers)):
        cluster.start_worker(WorkerConfig(cores=1))
    print("ready", flush=True)
    sys.stdin.read()
