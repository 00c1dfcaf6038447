"""Files that answers are written to."""

from __future__ import annotations

import os
import stat
import tempfile
from pathlib import Path


def replace(path: str | os.PathLike[str], text: str) -> None:
    """Write a file as a whole: one that is there stays as it is until the new one is complete, and its permissions stay.

    A link is followed. What is no file, such as a pipe, is written in place.
    """
    target = Path(path).resolve()
    if target.exists() and not target.is_file():
        target.write_text(text, encoding="utf-8", newline="\n")
        return
    with tempfile.NamedTemporaryFile(
        "w", encoding="utf-8", newline="\n", dir=target.parent, prefix=".twinlag-", suffix=".part", delete=False
    ) as part:
        try:
            part.write(text)
            part.flush()
            os.fsync(part.fileno())
        except BaseException:
            part.close()
            os.unlink(part.name)
            raise
    os.chmod(part.name, stat.S_IMODE(target.stat().st_mode) if target.exists() else 0o666 & ~_umask())
    os.replace(part.name, target)


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask
