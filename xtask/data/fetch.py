"""Takes the two measured data sets that ordinary Python source distributions carry, and writes them as CSV files.

Usage: fetch.py DIR [--force]

- seaexplorer_sea046: a SeaExplorer glider with a pumped thermometer (GPCTD) and the thermistor of an oxygen sensor (AROD), from
  pyglider 0.0.9. Licence of the data: "may be redistributed and used without restriction or warranty".
- seaglider_sg542: a Seaglider with an unpumped thermometer and the thermistor of an oxygen optode, from glidertools 2023.7.25.
  Licence of the data: "may be redistributed and used without restriction".

The distributions come from the package index that pip uses, and are held against their published SHA-256. Needs NumPy and SciPy.
"""

import csv
import datetime
import gzip
import hashlib
import io
import pathlib
import re
import subprocess
import sys
import tarfile
import urllib.parse
import urllib.request

import numpy
from scipy.io import netcdf_file

DISTRIBUTIONS = {
    "pyglider-0.0.9.tar.gz": "435d2ad5bf5b79607dbe3671246444ae2366118fae00dd55b68f2345f96c345d",
    "glidertools-2023.7.25.tar.gz": "07efc6d3e54eb78534b1eaace60a67b94abee145217ff73b3123ffd80f888176",
}
RAW = "pyglider-0.0.9/tests/example-data/example-seaexplorer-raw/delayed_raw/sea046.45.pld1.raw.12.gz"
DIVES = {n: f"glidertools-2023.7.25/tests/data/p5420{n}.nc" for n in (305, 306)}


def index():
    """Address of the package index that pip uses."""
    said = subprocess.run(
        [sys.executable, "-m", "pip", "config", "get", "global.index-url"], capture_output=True, text=True, check=False
    )
    return (said.stdout.strip() or "https://pypi.org/simple").rstrip("/")


def distribution(name):
    """The bytes of a source distribution, checked."""
    page = f"{index()}/{name.split('-')[0]}/"
    listing = urllib.request.urlopen(page).read().decode()
    link = re.search(r'href="([^"]*/' + re.escape(name) + r')[^"]*"', listing)
    if link is None:
        sys.exit(f"{name}: the package index does not list it")
    data = urllib.request.urlopen(urllib.parse.urljoin(page, link.group(1))).read()
    if hashlib.sha256(data).hexdigest() != DISTRIBUTIONS[name]:
        sys.exit(f"{name}: its SHA-256 is not the published one")
    return tarfile.open(fileobj=io.BytesIO(data))


def number(x, form):
    """A number without trailing zeros; nothing for NaN."""
    text = "" if numpy.isnan(x) else format(x, form)
    return text.rstrip("0").rstrip(".") if "." in text else text


def write(path, header, columns, forms):
    """Columns as CSV."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("w", newline="") as file:
        out = csv.writer(file, lineterminator="\n")
        out.writerow(header)
        for row in zip(*columns):
            out.writerow([number(x, form) for x, form in zip(row, forms)])
    print(f"{path}: {len(columns[0])} rows")


def seaexplorer(out):
    """One dive: both thermometers on their own clocks, and the second on the first one's."""
    text = gzip.decompress(distribution("pyglider-0.0.9.tar.gz").extractfile(RAW).read()).decode()
    gpctd, arod = [], []
    start = last = None
    for row in csv.DictReader(io.StringIO(text), delimiter=";"):
        stamp = datetime.datetime.strptime(row["PLD_REALTIMECLOCK"], "%d/%m/%Y %H:%M:%S.%f")
        start = start or stamp
        time_s = (stamp - start).total_seconds()
        if row["GPCTD_TEMPERATURE"]:
            gpctd.append((time_s, float(row["GPCTD_TEMPERATURE"]), float(row["GPCTD_PRESSURE"] or "nan")))
        # The logger writes the sensor's last message, temperature and oxygen, again and again.
        message = (row["AROD_FT_TEMP"], row["AROD_FT_DO"])
        if message[0] and message != last:
            arod.append((time_s, float(message[0])))
            last = message
    (t1, y1, p1), (t2, y2) = numpy.array(gpctd).T, numpy.array(arod).T
    write(out / "dive12_gpctd_native.csv", ["time_s", "T_gpctd_C", "pressure_dbar"], [t1, y1, p1], [".3f", ".4f", ".2f"])
    write(out / "dive12_arod_native.csv", ["time_s", "T_arod_C"], [t2, y2], [".3f", ".3f"])
    both = (t1 >= t2[0]) & (t1 <= t2[-1])
    on_first = numpy.interp(t1[both], t2, y2)
    header = ["time_s", "T1_gpctd_C", "T2_arod_C", "pressure_dbar"]
    write(out / "dive12_1hz.csv", header, [t1[both], y1[both], on_first, p1[both]], [".3f", ".4f", ".4f", ".2f"])


def seaglider(out):
    """Two dives, as stamped, missing values left out."""
    archive = distribution("glidertools-2023.7.25.tar.gz")
    for dive, member in DIVES.items():
        with netcdf_file(io.BytesIO(archive.extractfile(member).read()), "r", mmap=False) as file:
            get = lambda name: file.variables[name][:].astype(float)
            time_s = get("time")
            columns = [time_s - time_s[0], *map(get, ("temperature_raw", "eng_aa4330_Temp", "depth", "temperature"))]
            header = ["time_s", "T1_ct_raw_C", "T2_aa4330_C", "depth_m", "T_ct_lagcorr_C"]
            write(out / f"dive{dive}.csv", header, columns, [".3f", ".7g", ".7g", ".2f", ".7g"])


def main():
    arguments = [a for a in sys.argv[1:] if a != "--force"]
    if len(arguments) != 1:
        sys.exit(__doc__)
    root = pathlib.Path(arguments[0])
    folders = [root / "seaexplorer_sea046", root / "seaglider_sg542"]
    there = [str(f) for f in folders if f.exists()]
    if there and "--force" not in sys.argv:
        sys.exit(f"{', '.join(there)}: there already; name another folder, or give --force to overwrite")
    seaexplorer(folders[0])
    seaglider(folders[1])


main()
