"""`python -m biped` is `biped`."""

import sys

from biped.cli.main import main

if __name__ == "__main__":
    sys.exit(main())
