"""`python -m compsim` is `compsim`."""

from compsim.cli import main

raise SystemExit(main())
