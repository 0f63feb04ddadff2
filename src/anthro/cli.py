"""What every command line shares: one clear line and exit code 2 on bad input."""

import sys
from collections.abc import Callable, Sequence

from anthro.errors import UserError


def run(main: Callable[[Sequence[str] | None], int | None], argv: Sequence[str] | None = None) -> int:
    """Call a module's ``main`` and turn the errors of bad input into one line.

    Parameters
    ----------
    main : callable
        Takes the argument list (None: ``sys.argv``) and returns an exit code, None meaning 0.
    argv : sequence of str, optional
        Arguments without the program's name.

    Returns
    -------
    int
        The exit code: 2 after a `UserError` or an `OSError` (a full disk, a missing folder).
        Any other exception is a bug and keeps its traceback.
    """
    try:
        return main(argv) or 0
    except BrokenPipeError:
        return 0
    except (UserError, OSError) as error:
        print("error:", " ".join(str(error).split()), file=sys.stderr)
        return 2
