"""Which source files decide a stage's result: a module and what it imports inside the package.

Snakemake does not see edits to imported modules, so the rules declare these files as inputs. The
plumbing is left out: it decides how work is started, told and written, not what comes out, and an
edit of it must not cost a whole run.
"""

import ast
from functools import cache
from pathlib import Path

PACKAGE = "anthro"
PLUMBING = {
    f"{PACKAGE}.{name}"
    for name in ("cli", "config", "errors", "files", "progress", "registry", "runcard", "scorecard", "sources")
} | {PACKAGE}


def _path(module: str, src: Path) -> Path | None:
    """Return a module's file, or None if `module` names something inside one."""
    stem = src.joinpath(*module.split("."))
    for path in (stem.with_suffix(".py"), stem / "__init__.py"):
        if path.is_file():
            return path
    return None


@cache
def _imports(path: Path) -> tuple[str, ...]:
    """Return the dotted names a file imports from the package, at any depth of its code."""
    found: dict[str, None] = {}
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found |= dict.fromkeys(alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.level == 0 and node.module:
            found |= dict.fromkeys(f"{node.module}.{alias.name}" for alias in node.names)
    return tuple(name for name in found if name.startswith(f"{PACKAGE}."))


def _with_parents(module: str) -> list[str]:
    parts = module.split(".")
    return [".".join(parts[:count]) for count in range(1, len(parts) + 1)]


@cache
def source_files(*modules: str, src: Path = Path("src")) -> list[str]:
    """Return the files of modules and of all they import inside the package, plumbing left out.

    Parameters
    ----------
    *modules : str
        Dotted names, such as ``"anthro.learn.train"``.
    src : pathlib.Path
        The folder that holds the package.

    Returns
    -------
    list of str
        Paths that begin with `src`, sorted. A module that is not there is listed with the path it
        should have, so that Snakemake names it as missing.
    """
    found: dict[str, str] = {}
    waiting = list(modules)
    while waiting:
        module = waiting.pop()
        for name in _with_parents(module):
            if name in found or name in PLUMBING or not name.startswith(f"{PACKAGE}."):
                continue
            path = _path(name, src)
            if path is None:
                if name in modules:
                    found[name] = src.joinpath(*name.split(".")).with_suffix(".py").as_posix()
                continue
            found[name] = path.as_posix()
            waiting.extend(_imports(path))
    return sorted(found.values())
