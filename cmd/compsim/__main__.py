"""`compsim`, and `python -m compsim`: let Ctrl-C end the program, also while it is being loaded."""

import gc
import signal
import sys


def main() -> int:
    """Run a command and return its exit code."""
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, signal.SIG_DFL)  # no traceback of an import
    gc.set_threshold(50_000)  # what is loaded is no garbage: to look at it took a tenth of a start
    from compsim import cli

    code = cli.main()
    gc.freeze()  # nor is what ends with the program: to look at it took up to half a second
    return code


if __name__ == "__main__":
    sys.exit(main())
