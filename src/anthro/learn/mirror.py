"""The network of the other side of the body, exact: a trained one with its inputs and outputs mirrored.

A left limb is its right twin mirrored at the midplane, y to -y, and its muscles come in the same order.
So only the network's direction to the target changes: a left limb's net is the right one's with the
sign of dy turned, and a left reflex net is the right one's as it is.
"""

import argparse
import hashlib
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from anthro import cli
from anthro.errors import UserError
from anthro.motor.network import FeedForward


def mirrored(
    network: FeedForward,
    input_permutation: Sequence[int],
    input_sign: Sequence[int],
    output_permutation: Sequence[int],
    output_sign: Sequence[int],
    attrs: dict | None = None,
) -> FeedForward:
    """Return the network that does in the mirror what `network` does.

    With ``mirror(x)[i] = sign[i] * x[permutation[i]]`` for inputs and outputs alike, it gives
    ``predict(mirror(x)) == mirror(network.predict(x))``.

    Parameters
    ----------
    network : FeedForward
        A trained network.
    input_permutation, output_permutation : sequence of int, (n_in,) and (n_out,)
        Which column stands at each place in the mirror.
    input_sign, output_sign : sequence of int, (n_in,) and (n_out,)
        1, or -1 where the mirror turns the column's sign.
    attrs : dict, optional
        What to add to the network's attributes.

    Returns
    -------
    FeedForward
        A network of the same sizes.

    Raises
    ------
    ValueError
        When a permutation or the signs are none, or do not fit the network.
    """
    inputs = _mirror(input_permutation, input_sign, network.n_in)
    outputs = _mirror(output_permutation, output_sign, network.n_out)
    matrices, biases = list(network.matrices), list(network.biases)
    matrices[0] = matrices[0][:, inputs[0]] * inputs[1]
    matrices[-1] = matrices[-1][outputs[0]] * outputs[1][:, None]
    biases[-1] = biases[-1][outputs[0]] * outputs[1]
    factors = {}
    for name, values in network.normalisation.items():
        order, sign = inputs if name.startswith("input") else outputs
        factors[name] = values[order] * (sign if name.endswith("mean") else 1)
    return FeedForward(matrices, biases, factors, network.attrs | (attrs or {}))


def _mirror(permutation: Sequence[int], sign: Sequence[int], width: int) -> tuple[np.ndarray, np.ndarray]:
    order, signs = np.asarray(permutation), np.asarray(sign, dtype=np.float32)
    if not np.array_equal(np.sort(order), np.arange(width)):
        raise ValueError(f"not a permutation of {width} columns")
    if signs.shape != (width,) or not (np.abs(signs) == 1).all():
        raise ValueError(f"not {width} signs of 1 or -1")
    return order, signs


def mirror_limb(path: Path, offset_signs: Sequence[int], name: str | None = None) -> FeedForward:
    """Return the network of a limb's twin.

    Parameters
    ----------
    path : Path
        The limb's ``weights.h5``.
    offset_signs : sequence of int
        1 or -1 for each of the first inputs, the offset to the target; the others stay.
    name : str, optional
        The twin's net; that of the limb by default.

    Returns
    -------
    FeedForward
        Its attributes are those of the source (the spec's digest among them), `name`, `mirrored_from`
        (the source's name) and `source_digest` (SHA-256 of its file).

    Raises
    ------
    UserError
        When the file is no network, or the signs do not fit it.
    """
    network = FeedForward.load(path)
    signs = np.ones(network.n_in, dtype=int)
    if len(offset_signs) > network.n_in or not set(offset_signs) <= {1, -1}:
        raise UserError(f"offset signs {list(offset_signs)}: each is 1 or -1, for at most {network.n_in} inputs")
    signs[: len(offset_signs)] = offset_signs
    source = str(network.attrs.get("name", ""))
    attrs = {
        "name": name or source,
        "mirrored_from": source,
        "source_digest": hashlib.sha256(path.read_bytes()).hexdigest(),
    }
    every = np.arange(network.n_in), np.arange(network.n_out)
    return mirrored(network, every[0], signs, every[1], np.ones(network.n_out), attrs)


def main(argv: Sequence[str] | None = None) -> None:
    """Write the network of a limb's twin."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--weights", required=True, type=Path, metavar="FILE", help="the trained limb's weights.h5")
    parser.add_argument(
        "--offset-signs", nargs="*", type=int, default=(), metavar="SIGN", help="1 or -1 for each of the first inputs"
    )
    parser.add_argument("--name", help="the twin's net (default: the name of the source)")
    parser.add_argument("--out", required=True, metavar="FILE", help="the twin's weights.h5")
    given = parser.parse_args(argv)
    network = mirror_limb(given.weights, given.offset_signs, given.name)
    network.save(given.out)
    print(f"{network.attrs['name']}: mirrored from {network.attrs['mirrored_from']}")


if __name__ == "__main__":
    sys.exit(cli.run(main))
