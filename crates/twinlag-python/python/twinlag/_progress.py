"""Progress of a verb."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any


@contextmanager
def shown(progress: Any) -> Iterator[Callable[[str, int, int], object] | None]:
    """What is called with task, steps done and steps in all: a callable as it is, ``True`` a bar where `tqdm` is installed."""
    if progress is None or progress is False:
        yield None
    elif callable(progress):
        yield progress
    elif progress is not True:
        raise TypeError(f"progress: expected True, or what is called with task, steps done and steps in all, got {progress!r}")
    else:
        try:
            from tqdm.auto import tqdm
        except ImportError:
            yield None
            return
        bar: Any = tqdm(total=1, leave=False)

        def move(task: str, done: int, total: int) -> None:
            bar.set_description(task)
            bar.total = max(total, 1)
            bar.n = done
            bar.refresh()

        try:
            yield move
        finally:
            bar.close()
