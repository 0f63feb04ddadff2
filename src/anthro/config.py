"""One run's settings: config.yaml, its scale, data, nets, plants, ablations and papers, all checked against schemas.

jsonschema is imported where files are checked: most calls of the command line write a job's spec.
"""

from __future__ import annotations

import argparse
import csv
import difflib
import json
import math
import sys
from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

import yaml

from anthro import cli, registry
from anthro.errors import UserError
from anthro.files import write_json

if TYPE_CHECKING:
    from jsonschema import Draft202012Validator
    from jsonschema.exceptions import ValidationError

COMMAND_LINE = "command line"
LOADER = getattr(yaml, "CSafeLoader", yaml.SafeLoader)  # libyaml's, where it is there, takes a tenth of the time


def _complain(error: ValidationError, source: str) -> str:
    """Return one line that names file, key and value."""
    key = ".".join(str(part) for part in error.absolute_path)
    if error.validator == "additionalProperties":
        known = list(error.schema.get("properties", {}))
        odd = next(name for name in error.instance if name not in known)
        close = difflib.get_close_matches(str(odd), known, n=1)
        hint = f"did you mean '{close[0]}'?" if close else f"known: {', '.join(known)}"
        path = ".".join(filter(None, (key, str(odd))))
        return f"{source}: {path}: {error.instance[odd]!r}: unknown key; {hint}"
    return f"{source}: {key or '(top)'}: {error.message}"


@cache
def _rules(schema: Path) -> Draft202012Validator:
    from jsonschema import Draft202012Validator

    return Draft202012Validator(yaml.load(schema.read_text(encoding="utf-8"), LOADER))  # noqa: S506  a safe loader


def check(content, schema: str, source: str, root: Path) -> None:
    """Check a file's content against ``workflow/schemas/<schema>.schema.yaml``.

    Raises
    ------
    UserError
        Naming the file, the key and the value.
    """
    from jsonschema.exceptions import best_match

    rules = _rules(root / "workflow" / "schemas" / f"{schema}.schema.yaml")
    error = best_match(rules.iter_errors(content))
    if error is not None:
        raise UserError(_complain(error, source))


def read_yaml(path: Path, schema: str, root: Path) -> dict:
    """Read and check one YAML file below `root`; errors name it relative to `root`."""
    source = path.relative_to(root).as_posix()
    try:
        content = yaml.load(path.read_text(encoding="utf-8"), LOADER)  # noqa: S506  a safe loader
    except FileNotFoundError:
        raise UserError(f"{source}: no such file") from None
    except (yaml.YAMLError, UnicodeDecodeError) as error:
        raise UserError(f"{source}: not readable as YAML ({error})") from None
    check(content, schema, source, root)
    return content


def _number(text: str, source: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise UserError(f"{source}: {text!r} is not a number") from None


def _cell(key: str, text: str, where: str) -> str | float | list[int]:
    if key == "net":
        return text
    if key == "hidden":
        return [int(_number(units, f"{where}: {key}")) for units in text.split()]
    return _number(text, f"{where}: {key}")


def read_ablation(path: Path, root: Path) -> dict[str, dict]:
    """Read a table of ablations: each row's changes to the net, by the row's name.

    Columns are ``row``, ``net`` (the net that is varied, if it is not the paper's ``ablation_net``) and keys
    of a net; ``hidden`` is a list of units separated by spaces.
    """
    source = path.relative_to(root).as_posix()
    table: dict[str, dict] = {}
    with path.open(newline="", encoding="utf-8") as file:
        for line in csv.DictReader(file, delimiter="\t"):
            name = line.pop("row", None)
            if not name or name in table:
                raise UserError(f"{source}: row: {name!r} is missing or repeated")
            where = f"{source}: row {name}"
            changes = {key: _cell(key, text, where) for key, text in line.items() if text is not None}
            check(changes, "ablation", where, root)
            table[name] = changes
    return table


EMULATORS = "grzeszczuk1998"  # the paper whose nets emulate plants
PLAIN = {"learning_rate": 1e-3, "schedule": "constant", "start": "he", "softening": {}}


SIGHT = ("foveation", "vision")  # roles of the nets that see
SEES = "nakada2018"  # the body whose eyes these are


def role_of(dataset: str) -> str:
    """Return a data set's role from its name, ``<limb>_<role>``: "voluntary", "reflex", "foveation" or "vision"."""
    return dataset.rpartition("_")[2]


def sizes_of(settings: Mapping, dataset: str) -> dict:
    """Return the scale's sizes for a data set: those of its limb's region, or of sight (limb vision: by region too)."""
    role = role_of(dataset)
    limb = settings["data"][dataset].get("limb", dataset.removesuffix(f"_{role}"))
    if role not in SIGHT:
        return settings["sizes"]["limbs"][settings["limbs"][limb]["region"]]
    sizes = settings["sizes"]["sight"]
    if role == "vision":
        return sizes | {role: sizes[role][settings["limbs"][limb]["region"]]}
    return sizes


def load(overrides: Mapping | None = None, root: str | Path = ".") -> dict:
    """Merge and check the settings of a run.

    Parameters
    ----------
    overrides : mapping, optional
        Keys of ``config.yaml`` with other values, from the command line.
    root : path-like
        The repository.

    Returns
    -------
    dict
        The keys of ``config.yaml`` with `run` filled in, ``sizes`` (the scale), ``papers``,
        ``limbs``, ``nets``, ``data``, ``ablations``, ``plants`` and ``emulators`` (each by file name), ``feedback``
        and ``loop`` (``feedback.yaml``, ``loop.yaml``).

    Raises
    ------
    UserError
        Naming the file, the key and the value of what is unknown, missing or of the wrong kind.
    """
    root = Path(root)
    settings = read_yaml(root / "config" / "config.yaml", "config", root)
    check(settings | dict(overrides or {}), "config", COMMAND_LINE, root)
    settings |= overrides or {}
    scale = root / "config" / "scales" / f"{settings['scale']}.yaml"
    if not scale.is_file():
        known = sorted(path.stem for path in scale.parent.glob("*.yaml"))
        raise UserError(f"scale: {settings['scale']!r} is not a file of config/scales/ ({', '.join(known)})")
    settings["run"] = settings["run"] or settings["scale"]
    settings["sizes"] = read_yaml(scale, "scale", root)
    settings["papers"] = {
        name: read_yaml(root / "config" / "papers" / f"{name}.yaml", "paper", root) for name in settings["papers"]
    }
    settings["limbs"] = {
        path.stem: read_yaml(path, "limb", root) for path in sorted((root / "config" / "limbs").glob("*.yaml"))
    }
    settings["nets"] = {
        path.stem: read_yaml(path, "net", root)
        for paper in settings["papers"]
        if paper != EMULATORS
        for path in sorted((root / "config" / "nets" / paper).glob("*.yaml"))
    }
    settings["plants"] = {
        path.stem: read_yaml(path, "plant", root) for path in sorted((root / "config" / "plants").glob("*.yaml"))
    }
    settings["emulators"] = {
        path.stem: read_yaml(path, "emulator", root)
        for path in sorted((root / "config" / "nets" / EMULATORS).glob("*.yaml"))
    }
    settings["data"] = {
        path.stem: read_yaml(path, f"data_{role_of(path.stem)}", root)
        for path in sorted((root / "config" / "data").glob("*.yaml"))
    }
    settings["feedback"] = read_yaml(root / "config" / "feedback.yaml", "feedback", root)
    settings["loop"] = read_yaml(root / "config" / "loop.yaml", "loop", root)
    settings["ablations"] = {
        path.stem: read_ablation(path, root) for path in sorted((root / "config" / "ablations").glob("*.tsv"))
    }
    for table, rows in settings["ablations"].items():
        for row, changes in rows.items():
            net = changes.get("net", varied_net(settings))
            if net not in settings["nets"]:
                raise UserError(f"config/ablations/{table}.tsv: row {row}: net: {net!r} is not in config/nets/")
    return settings


def varied_net(settings: Mapping) -> str:
    """Return the net that ablations vary unless their row names another."""
    return next(paper["ablation_net"] for paper in settings["papers"].values() if "ablation_net" in paper)


def data_spec(settings: Mapping, dataset: str) -> dict:
    """Return what one shard of a data set is made from; the number of shards is no part of it."""
    role = role_of(dataset)
    common = {"pairs": sizes_of(settings, dataset)[role]["pairs"], "seed": settings["seed"]}
    if role in SIGHT:
        limbs = {name: settings["limbs"][name] for name in registry.SEATED}
        return settings["data"][dataset] | common | {"name": dataset, "limbs": limbs}
    limb = dataset.removesuffix(f"_{role}")
    return settings["data"][dataset] | {"limb": {"name": limb} | settings["limbs"][limb]} | common


def net_spec(settings: Mapping, net: str) -> dict:
    """Return what a net is trained from: its YAML, the scale's epochs, the seed."""
    content = settings["nets"][net]
    epochs = sizes_of(settings, content["dataset"])["epochs"][role_of(content["dataset"])]
    return content | {"epochs": epochs, "seed": settings["seed"], "samples": None}


def _examples(settings: Mapping, count: int) -> int:
    """Return how many examples train at the run's scale, of those that the paper's net has."""
    return max(10, round(settings["sizes"]["neuroanimator"]["examples"] * count))


def plant_spec(settings: Mapping, plant: str, super_step: int) -> dict:
    """Return what a plant's examples are sampled from: its YAML with the super-step, and a tenth more to validate."""
    content = settings["plants"][plant]
    rows = 10 * math.ceil(_examples(settings, content["examples"]) / 9)
    return content | {"plant": plant, "super_step": super_step, "examples": rows, "seed": settings["seed"]}


def emulator_spec(settings: Mapping, emulator: str) -> dict:
    """Return what an emulator's network is trained from: its YAML, the scale's examples and epochs, the seed.

    Conjugate gradients take all pairs at once, and their line searches know no rate.
    """
    content = settings["emulators"][emulator]
    examples = _examples(settings, content["examples"])
    whole = {"batch_size": examples, "learning_rate": 1.0} if content["optimiser"] == "conjugate_gradient" else {}
    return (
        whole
        | content
        | {
            "examples": examples,
            "rows": 10 * math.ceil(examples / 9),
            "samples": round(examples / 0.9),
            "epochs": settings["sizes"]["neuroanimator"]["epochs"][content["optimiser"]],
            "seed": settings["seed"],
        }
    )


def ablation_spec(settings: Mapping, table: str, row: str) -> dict:
    """Return what an ablation's row is trained from: a paper's net with the row's changes and the scale's sizes.

    Ablations train as the papers do: from He's weights, at the constant rate that they print (Nakada 2018,
    footnote 1), on inputs and labels as they are.
    """
    changes = {"net": varied_net(settings)} | settings["ablations"][table][row]
    net = changes.pop("net")
    sizes = settings["sizes"]["ablation"][table]
    return net_spec(settings, net) | sizes | PLAIN | changes | {"name": f"{net}_{table}_{row}"}


def _override(text: str) -> tuple[str, object]:
    key, equals, value = text.partition("=")
    if not equals:
        raise UserError(f"{COMMAND_LINE}: {text!r}: KEY=VALUE is wanted")
    return key, yaml.safe_load(value)


def main(argv: Sequence[str] | None = None) -> None:
    """Check or print the settings, or write one job's spec."""
    parser = argparse.ArgumentParser(description=__doc__)
    action = parser.add_mutually_exclusive_group(required=True)
    action.add_argument("--check", action="store_true", help="say nothing if all is well")
    action.add_argument("--print", action="store_true", help="print the merged settings as YAML")
    action.add_argument("--write", metavar="FILE", help="write a job's spec, given by --spec")
    parser.add_argument("--spec", metavar="JSON", help="the spec's content")
    parser.add_argument("overrides", nargs="*", metavar="KEY=VALUE", help="in place of config.yaml's values")
    given = parser.parse_args(argv)
    if given.write:
        try:
            write_json(given.write, json.loads(given.spec or ""))
        except ValueError as error:
            raise UserError(f"--spec: not JSON ({error})") from None
        return
    settings = load(dict(map(_override, given.overrides)))
    if given.print:
        print(yaml.safe_dump(settings, sort_keys=False, default_flow_style=None), end="")


if __name__ == "__main__":
    sys.exit(cli.run(main))
