"""Submits shards to a HyperQueue server that is running, and the merge behind them; prints the number of the job.

Needs the package `hyperqueue`, of the version of the server. --server-dir, or the variable HQ_SERVER_DIR, says which server.
"""

import argparse
import datetime
import os
import pathlib
import sys

from hyperqueue import Client, Job
from hyperqueue.ffi.protocol import ResourceRequest


def numbers(text):
    """The numbers in ranges such as 0-2,9; none of an empty text."""
    for part in filter(None, text.split(",")):
        first, _, last = part.partition("-")
        yield from range(int(first), int(last or first) + 1)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--name", required=True)
    parser.add_argument("--shards", required=True)
    parser.add_argument("--cpus", type=int, required=True)
    parser.add_argument("--time", type=int, required=True, help="minutes that a worker has to have left")
    parser.add_argument("--crash-limit", type=int, default=5, help="workers that a shard may lose")
    parser.add_argument("--server-dir", default=os.environ.get("HQ_SERVER_DIR"))
    options = parser.parse_args()

    here = pathlib.Path(__file__).resolve().parent
    # A shard whose workers were lost too often keeps no other from being run.
    job = Job(name=options.name, max_fails=None, default_workdir=here)
    shards = [
        job.program(
            # The merge names what is missing: to HyperQueue no shard fails, or it would cancel the merge.
            ["sh", "-c", 'sh "$0" "$1" || true', str(here / "shard.sh"), str(shard)],
            stdout=None,
            stderr=None,
            resources=ResourceRequest(cpus=options.cpus, min_time=datetime.timedelta(minutes=options.time)),
            crash_limit=options.crash_limit,
        )
        for shard in numbers(options.shards)
    ]
    job.program(["sh", str(here / "merge.sh")], stdout=None, stderr=None, deps=shards)
    try:
        print(Client(server_dir=options.server_dir).submit(job).id)
    except BaseException as error:
        server = options.server_dir or "its own folder"
        sys.exit(f"no server of HyperQueue takes it in {server}, where HQ_SERVER_DIR or --server-dir leads: {error}")


if __name__ == "__main__":
    main()
