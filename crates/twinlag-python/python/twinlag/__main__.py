"""The program: ``twinlag``, or ``python -m twinlag``."""

from __future__ import annotations

import signal
import sys

from twinlag import _core


def main() -> None:
    """Run the program with the arguments of the process, and end it."""
    # Ctrl-C ends the program at once, as it ends any other.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    script, *arguments = sys.argv
    # As a module it is started by a file that nobody calls by its name.
    name = "twinlag" if script == __file__ else script
    sys.exit(_core.run_program([name, *arguments]))


if __name__ == "__main__":
    main()
