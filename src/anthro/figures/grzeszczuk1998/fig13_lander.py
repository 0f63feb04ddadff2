"""Fig. 13c: the lander lands softly, as it learns to, and when it has."""

import sys

from anthro import cli
from anthro.figures.grzeszczuk1998 import motion

if __name__ == "__main__":
    sys.exit(cli.run(lambda argv: motion.main("lander", argv, __doc__)))
