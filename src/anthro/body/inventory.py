"""Everything a body is made of, row by row, with where each row comes from; as a page to search.

``python -m anthro.body.inventory --body results/laptop/body/zhou2021 --out inventory.html``
"""

from __future__ import annotations

import argparse
import csv
import sys
from dataclasses import asdict, dataclass
from html import escape
from pathlib import Path

from anthro import cli
from anthro.body.model import Body
from anthro.body.parts import Part, body_plan, load_parts
from anthro.body.tables import QUALITIES
from anthro.errors import UserError
from anthro.files import atomic

SIDES = {"_r": "right", "_l": "left"}


@dataclass(frozen=True)
class Inventory:
    """Rows of a built body: bones (kg), joints (degrees, N m/rad), muscles (cm^2, N, m).

    Each row is a dict of column to str or number; all rows of a kind have the same columns.
    """

    body: str
    bones: list[dict]
    joints: list[dict]
    muscles: list[dict]

    def kinds(self) -> dict[str, list[dict]]:
        """The rows by kind."""
        return {"bones": self.bones, "joints": self.joints, "muscles": self.muscles}


def take(body: Body, tables: Path) -> Inventory:
    """List what ``body`` is made of, from its tables and from what was fitted when it was built.

    Raises
    ------
    UserError
        The tables are not those that the body was built from.
    """
    plan = body_plan(body.name)
    parts = load_parts(plan, tables)
    inventory = Inventory(
        body=body.name,
        bones=[_bone(part, bone) for part in parts for bone in part.bones],
        joints=[_joint(part, joint) for part in parts if part.name in plan.moving for joint in part.joints],
        muscles=_muscles(parts, body),
    )
    listed = tuple(row["name"] for row in inventory.joints), tuple(row["name"] for row in inventory.muscles)
    if sorted(listed[0]) != sorted(body.dof_names) or listed[1] != body.muscle_names:
        raise UserError(f"{tables}: not the tables that {body.name} was built from; build the body again")
    return inventory


def _side(name: str) -> str:
    return SIDES.get(name[-2:], "middle")


def _bone(part: Part, bone) -> dict:
    return {
        "name": bone.bone,
        "region": part.name,
        "side": _side(bone.bone),
        "segment": bone.segment,
        "parent": bone.parent,
        "mass_kg": bone.mass_kg,
        "quality": bone.quality,
        "source": bone.source,
    }


def _joint(part: Part, joint) -> dict:
    row = asdict(joint)
    axis = " ".join(f"{value:g}" for value in joint.axis)
    kept = ("min_deg", "max_deg", "rest_deg", "stiffness_Nm_rad", "damping_Nms_rad", "quality", "source")
    head = {"name": joint.joint, "region": part.name, "side": _side(joint.joint), "bone": joint.bone, "axis": axis}
    return head | {key: row[key] for key in kept}


def _muscles(parts: list[Part], body: Body) -> list[dict]:
    known = {muscle.muscle: (part, muscle) for part in parts for muscle in part.muscles}
    if not set(body.muscle_names) <= known.keys():
        return []
    rows = []
    for index, name in enumerate(body.muscle_names):
        part, muscle = known[name]
        path = part.paths[name]
        rows.append(
            {
                "name": name,
                "region": part.name,
                "group": muscle.group,
                "anatomical_name": muscle.anatomical_name,
                "side": _side(name),
                "origin": path[0].bone,
                "insertion": path[-1].bone,
                "pcsa_cm2": muscle.pcsa_cm2,
                "max_force_N": float(body.max_force[index]),
                "optimal_fiber_length_m": float(body.slack_length[index]),
                "tendon_length_m": float(body.tendon_length[index]),
                "path_points": len(path),
                "path_quality": max((row.quality for row in path), key=QUALITIES.index),
                "quality": muscle.quality,
                "source": muscle.source,
            }
        )
    return rows


def write_csv(inventory: Inventory, path: Path) -> None:
    """Write all rows as one CSV: the kind first, cells empty where a kind lacks a column."""
    kinds = inventory.kinds()
    columns = list(dict.fromkeys(name for rows in kinds.values() for row in rows for name in row))
    columns.sort(key=("quality", "source").count)
    with atomic(path) as temporary, temporary.open("w", newline="", encoding="utf-8") as target:
        writer = csv.DictWriter(target, ["kind", *columns], lineterminator="\n")
        writer.writeheader()
        for kind, rows in kinds.items():
            writer.writerows({"kind": kind.removesuffix("s")} | row for row in rows)


STYLE = """
:root { color-scheme: light dark; --line: #8884; --soft: #8881; }
body { font: 14px/1.45 system-ui, sans-serif; margin: 0; }
header { position: sticky; top: 0; background: Canvas; padding: 12px 20px; border-bottom: 1px solid var(--line); }
h1 { font-size: 18px; margin: 0 0 8px; }
nav { display: flex; gap: 8px; align-items: center; flex-wrap: wrap; }
button { font: inherit; padding: 4px 12px; border: 1px solid var(--line); border-radius: 6px; background: none; }
button[aria-pressed=true] { background: Highlight; color: HighlightText; }
input { font: inherit; padding: 4px 8px; min-width: 20em; }
main { padding: 0 20px 40px; overflow-x: auto; }
table { border-collapse: collapse; }
th, td { text-align: left; padding: 3px 10px; border-bottom: 1px solid var(--line); vertical-align: top; }
th { cursor: pointer; white-space: nowrap; }
td.number { text-align: right; font-variant-numeric: tabular-nums; }
tr:nth-child(even) { background: var(--soft); }
[hidden] { display: none; }
"""

SCRIPT = """
const box = document.querySelector('input'), count = document.querySelector('output');
const buttons = [...document.querySelectorAll('button')], tables = [...document.querySelectorAll('table')];
let open = tables.length - 1;
function show() {
  const words = box.value.toLowerCase().split(/\\s+/).filter(Boolean);
  buttons.forEach((button, i) => button.setAttribute('aria-pressed', i === open));
  tables.forEach((table, i) => table.hidden = i !== open);
  const rows = [...tables[open].tBodies[0].rows];
  let shown = 0;
  for (const row of rows) {
    const text = row.textContent.toLowerCase();
    row.hidden = !words.every(word => text.includes(word));
    shown += !row.hidden;
  }
  count.textContent = `${shown} of ${rows.length}`;
}
function sort(table, column) {
  const body = table.tBodies[0], up = table.dataset.sorted !== `${column}`;
  const cell = row => row.cells[column].textContent;
  const rows = [...body.rows].sort((a, b) => cell(a).localeCompare(cell(b), 'en', { numeric: true }));
  const numbers = rows.length && rows[0].cells[column].className === 'number';
  if (numbers) rows.sort((a, b) => parseFloat(cell(a)) - parseFloat(cell(b)));
  body.append(...(up ? rows : rows.reverse()));
  table.dataset.sorted = up ? column : '';
}
buttons.forEach((button, i) => button.onclick = () => { open = i; show(); });
tables.forEach(table => [...table.tHead.rows[0].cells].forEach((head, i) => head.onclick = () => sort(table, i)));
box.oninput = show;
show();
"""


def page(inventory: Inventory) -> str:
    """One self-contained HTML page: a tab a kind, a box that filters, columns that sort on a click."""
    kinds = inventory.kinds()
    tabs = "".join(f'<button type="button">{len(rows)} {kind}</button>' for kind, rows in kinds.items())
    title = f"Inventory of {escape(inventory.body)}"
    return (
        f'<!doctype html>\n<html lang="en"><head><meta charset="utf-8"><title>{title}</title>\n'
        f"<style>{STYLE}</style></head>\n<body><header><h1>{title}</h1><nav>{tabs}"
        f'<input type="search" placeholder="filter, e.g. multifidus left" aria-label="filter"><output></output>'
        f"</nav></header>\n<main>{''.join(_table(rows) for rows in kinds.values())}</main>\n"
        f"<script>{SCRIPT}</script></body></html>\n"
    )


def _table(rows: list[dict]) -> str:
    head = "".join(f"<th>{escape(name.replace('_', ' '))}</th>" for name in (rows[0] if rows else ()))
    body = "\n".join(f"<tr>{''.join(map(_cell, row.values()))}</tr>" for row in rows)
    return f"<table><thead><tr>{head}</tr></thead><tbody>\n{body}</tbody></table>\n"


def _cell(value) -> str:
    if isinstance(value, str):
        return f"<td>{escape(value)}</td>"
    return f'<td class="number">{value:.4g}</td>'


def main(argv=None) -> int:
    """Write the page."""
    parser = argparse.ArgumentParser(prog="anthro.body.inventory", description=__doc__.partition("\n")[0])
    parser.add_argument("--body", type=Path, required=True, help="folder of the built body")
    parser.add_argument("--tables", type=Path, default=Path("config/body"), help="anatomy tables")
    parser.add_argument("--out", type=Path, required=True, help="HTML file to write")
    args = parser.parse_args(argv)
    inventory = take(Body.load(args.body), args.tables)
    with atomic(args.out) as path:
        path.write_text(page(inventory), encoding="utf-8")
    print(f"{args.out}: " + ", ".join(f"{len(rows)} {kind}" for kind, rows in inventory.kinds().items()))
    return 0


if __name__ == "__main__":
    sys.exit(cli.run(main))
