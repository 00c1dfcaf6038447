"""Files that answers are written to."""

from __future__ import annotations

import errno
import os
import secrets
import stat
from pathlib import Path


def replace(path: str | os.PathLike[str], text: str) -> None:
    """Write a file as a whole: one that is there stays as it is until the new one is complete, and its permissions stay.

    A link is followed. What is no file, such as a pipe, is written in place.
    """
    target = Path(path).resolve()
    if not target.parent.is_dir():
        if target.parent.exists():
            raise NotADirectoryError(errno.ENOTDIR, "this is no folder", str(target.parent))
        raise FileNotFoundError(errno.ENOENT, "there is no such folder", str(target.parent))
    if target.exists() and not target.is_file():
        target.write_text(text, encoding="utf-8", newline="\n")
        return
    part = target.with_name(f".twinlag-{secrets.token_hex(8)}.part")
    try:
        with part.open("x", encoding="utf-8", newline="\n") as file:
            if target.exists():
                part.chmod(stat.S_IMODE(target.stat().st_mode))
            file.write(text)
            file.flush()
            os.fsync(file.fileno())
        os.replace(part, target)
    except BaseException:
        part.unlink(missing_ok=True)
        raise
