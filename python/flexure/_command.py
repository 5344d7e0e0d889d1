"""The command ``flexure``, which comes with the package."""

import signal
import sys

from flexure._core import command


def main() -> int:
    """Runs the command with the arguments of the process."""
    # As in any command: Ctrl-C ends it, also in the middle of a computation.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    return command(["flexure", *sys.argv[1:]])
