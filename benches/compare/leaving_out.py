"""What leaving out saves, as `cargo bench --bench leave_out` measures it."""

import json
import os
import pathlib
import subprocess

from tables import Topic, figures

ROOT = pathlib.Path(__file__).resolve().parents[2]


def leave_out(settings):
    """Work with and without what a scene does not need."""
    quick = ["--warm-up-time", "0.3", "--measurement-time", "0.5"] if settings.quick else ["--measurement-time", "2"]
    command = ["cargo", "bench", "--quiet", "--bench", "leave_out", "--", "--noplot", *quick]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    topic = Topic(
        "leave_out",
        "What leaving out saves",
        "`cargo bench --bench leave_out`, medians by the clock, frames of 1332x400 in memory. Each pair does the same work on "
        "what a scene needs and on all; `tests/leave_out.rs` shows that the results are the same.",
        ["left out", "with it, ms", "without, ms", "saving"],
    )
    if done.returncode != 0:
        topic.notes.append(f"cargo bench failed: {done.stderr.strip().splitlines()[-1:]}")
        return topic
    target = pathlib.Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target")) / "criterion"
    for group in sorted(target.iterdir()):
        medians = [median_ms(group / name) for name in ("with", "left out")]
        if None not in medians:
            ratio = medians[0] / medians[1]
            topic.rows.append([group.name, figures(medians[0]), figures(medians[1]), f"{figures(ratio)}×"])
    return topic


def median_ms(folder):
    estimates = folder / "new" / "estimates.json"
    if not estimates.exists():
        return None
    return json.loads(estimates.read_text(encoding="utf-8"))["median"]["point_estimate"] / 1e6
