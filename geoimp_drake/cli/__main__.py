"""`python -m geoimp_drake.cli` as the program `geoimp`."""

import sys

from geoimp_drake.cli import main

if __name__ == "__main__":
    sys.exit(main())
