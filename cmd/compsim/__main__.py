"""`compsim`, and `python -m compsim`: let Ctrl-C end the program, also while it is being loaded."""

import signal
import sys


def main() -> int:
    """Run a command and return its exit code."""
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, signal.SIG_DFL)  # no traceback of an import
    from compsim import cli

    return cli.main()


if __name__ == "__main__":
    sys.exit(main())
