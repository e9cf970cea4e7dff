"""What ``fit`` identifies on real logs, as Markdown: ``python identification_real.py DATA [DOCS]``.

DATA holds the folders ``ur10_db3``, ``ur3_bags``, ``tiago_csv`` and ``urdf``. DOCS is the page whose tables between
``<!-- name -->`` and ``<!-- /name -->`` are replaced.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator
from contextlib import redirect_stderr, redirect_stdout
from io import StringIO
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from tables import put

from collaudit.cli.main import run

#: Findings on what an effort is.
KINDS = ("effort-kind", "effort-gain", "effort-no-torque", "effort-sign-inverted")
UR3 = ("Base", "Shoulder", "Elbow", "Wrist 1", "Wrist 2", "Wrist 3")
MODEL = ("shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3")
NAMES = "[log.joint_names]\n" + "".join(f'"{a}" = "{b}_joint"\n' for a, b in zip(UR3, MODEL, strict=True))
SIGNS = "[log.units]\neffort_sign = { " + ", ".join(f"{b}_joint = -1" for b in MODEL) + " }\n"
COLUMNS = '[log.csv]\ntime = "t"\n' + "".join(f'{q} = "- {{joint}}_{q}"\n' for q in ("position", "velocity", "effort"))


def fitted(logs: list[Path], urdf: Path, extra: str, estimate: tuple[str, ...]) -> dict[str, Any]:
    """friction.json of one fit."""
    wanted = ", ".join(f'"{name}"' for name in ("friction", *estimate))
    out, said = StringIO(), StringIO()
    with TemporaryDirectory() as folder, redirect_stdout(out), redirect_stderr(said):
        config = Path(folder) / "c.toml"
        config.write_text(f'[robot]\nurdf = "{urdf}"\n{extra}[fit]\nestimate = [{wanted}]\n', encoding="utf-8")
        code = run(["fit", *map(str, logs), "-c", str(config), "--json"])
        if not out.getvalue():
            raise SystemExit(f"fit of {logs} ended with {code}: {said.getvalue()}")
    found: dict[str, Any] = json.loads(out.getvalue())
    return found


def held_out(data: Path) -> Iterator[str]:
    """RMS on time left out, with the inertials on file and as identified."""
    yield "| log | joint 1 | 2 | 3 | 4 | 5 | 6 |"
    yield "|---|---|---|---|---|---|---|"
    urdf = data / "urdf"
    bags = [data / "ur3_bags" / name for name in ("id1.bag", "id2.bag")]
    for title, logs, model, extra, estimate in (
        ("UR10, `inertials`", sorted((data / "ur10_db3").glob("*.db3")), "ur10_robot.urdf", "", ("inertials",)),
        ("UR3 id1 + id2, signs stated, `inertials`, `tool`", bags, "ur3_robot.urdf", NAMES + SIGNS,
         ("inertials", "tool")),
    ):  # fmt: skip
        found = fitted(logs, urdf / model, extra, estimate)
        cells = []
        for joint in found["identified"]["joints"].values():
            before, after = joint["held_out_rms_file_nm"], joint["held_out_rms_nm"]
            known = joint["gain"] is not None and before is not None
            cells.append(f"{before:.2f} → {after:.2f}" if known else "gain not shown")
        yield f"| {title} | {' | '.join(cells)} |"


def kinds(data: Path) -> Iterator[str]:
    """What the efforts look like."""
    yield "| log | what the effort looks like |"
    yield "|---|---|"
    urdf = data / "urdf"
    raw = '[log.units]\neffort = "raw"\n'
    for title, logs, model, extra in (
        ("UR10", sorted((data / "ur10_db3").glob("*.db3")), "ur10_robot.urdf", ""),
        ("UR3 id1", [data / "ur3_bags" / "id1.bag"], "ur3_robot.urdf", NAMES),
        ("TIAGo", sorted((data / "tiago_csv").glob("*.csv")), "tiago_no_hand.urdf", COLUMNS + raw),
    ):
        found = fitted(logs, urdf / model, extra, ())
        said = [f["text"] for f in found["findings"] if f["code"] in KINDS]
        late = [f["text"] for f in found["findings"] if f["code"] == "effort-delay"]
        text = " ".join([*said, *late])
        yield f"| {title} | {text or 'not told'} |"


def main(data: Path, docs: Path | None) -> None:
    """Print the tables; put them into the page when one is given."""
    for name, lines in (("real-held-out", list(held_out(data))), ("real-kinds", list(kinds(data)))):
        print("\n".join(lines), end="\n\n")
        if docs is not None:
            put(docs, name, lines)


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]) if len(sys.argv) > 2 else None)
