"""Fig. 13b: the truck parks, as it learns to, and when it has."""

import sys

from anthro import cli
from anthro.figures.grzeszczuk1998 import motion

if __name__ == "__main__":
    sys.exit(cli.run(lambda argv: motion.main("truck", argv, __doc__)))
