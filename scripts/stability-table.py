"""Puts the rows of tests/extremes.rs into the table of docs/stability.md, behind the line that marks it."""

import sys
from pathlib import Path

MARK = "<!-- made by scripts/stability -->"
PARTS = [
    "Poisson numbers", "Poisson tails", "dark current", "optics", "moments", "regression", "demosaicking", "converter",
    "patterns", "charge transfer", "wavelengths", "colors", "sensor files", "predictions",
]  # fmt: skip

rows = [line.rstrip("\n").split(" | ") for line in Path(sys.argv[1]).read_text(encoding="utf-8").splitlines()]
unknown = {row[0] for row in rows} - set(PARTS)
if unknown:
    sys.exit(f"stability-table: no place for {unknown}")
page = Path(sys.argv[2])
head, _, _ = page.read_text(encoding="utf-8").partition(MARK)
lines = [MARK, ""]
for part in PARTS:
    lines += [f"### {part[0].upper()}{part[1:]}", ""]
    lines += ["| case | expected, and why | found | error | time |", "|---|---|---|---|---|"]
    lines += [f"| {' | '.join(cell.replace('|', '∣') for cell in row[1:])} |" for row in rows if row[0] == part]
    lines.append("")
page.write_text(head + "\n".join(lines).rstrip() + "\n", encoding="utf-8")
