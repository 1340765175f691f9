"""The shell pipelines of the jobs."""

import shlex

from . import conditions
from .conditions import Condition
from .plan import RIM, Plan


def _words(*words: str) -> str:
    return shlex.join(words)


def scene(plan: Plan, condition: Condition, output: str) -> str:
    """Renders the expected electrons of a scene behind the filter array."""
    size = f"{plan.sweep.width}x{plan.sweep.height}"
    render = _words("render-radiance", *conditions.scene_options(plan.sweep, condition), "--size", size)
    return f"set -euo pipefail\n{render} | {_words('mosaic', '--quiet', '-o', output)}\n"


def predicted(plan: Plan, condition: Condition, output: str) -> str:
    """Predicts a condition's noise by formula; the table has its exposure time and temperature from there."""
    options = conditions.scene_options(plan.sweep, condition) + conditions.temperature_options(condition)
    options += ["--method", condition.method]
    if {"xyz", "lab"} & set(plan.sweep.stages):
        options += ["--matrix", plan.matrix(condition.sensor) or "sensor"]
    if plan.sweep.white_luminance_cd_per_m2 is not None:
        options += _white(plan)
    return _words("predict-noise", *options, "--quiet", "--output-format", "json", "-o", output) + "\n"


def matrix(plan: Plan, key: str, output: str) -> str:
    """Fits the matrix of a sensor."""
    sensor = conditions.sensor_options(plan.sensors[key]) + conditions.optics_options(plan.sweep)
    return _words("fit-matrix", plan.sweep.matrix, *sensor, "-o", output) + "\n"


def measured(plan: Plan, condition: Condition, frames: range, part: str, to_part: str) -> str:
    """Draws a range of frames and measures each at every stage, in one pipeline; `to_part` makes the reports a file.

    Reports of stages on the way come of `tee`: each goes to a `measure` of its own through a named pipe. A program that
    fails ends the job, whichever it is.
    """
    stages = plan.sweep.stages
    width, height = plan.measured_size
    measure = f"measure --quiet --region {RIM},{RIM},{width},{height} --output-format csv"
    before, chain = [], [_add_noise(plan, condition, frames), "digitize --quiet"]
    for stage in stages:
        chain += _programs(plan, condition, stage, stages)
        if stage == stages[-1]:
            chain.append(f'{measure} -o "$reports/{stage}.csv"')
        else:
            before.append(
                f'mkfifo "$reports/{stage}"\n{measure} -o "$reports/{stage}.csv" < "$reports/{stage}" & others+=($!)'
            )
            chain.append(f'tee "$reports/{stage}"')
    lines = " \\\n  | ".join(chain)
    return (
        "set -euo pipefail\n"
        "reports=$(mktemp -d)\nothers=()\n"
        """trap 'kill "${others[@]}" 2> /dev/null || true; rm -rf "$reports"' EXIT\n"""
        + "".join(line + "\n" for line in before)
        + f"< {_words(plan.scene(condition))} {lines}\n"
        + 'for other in "${others[@]}"; do wait "$other"; done\n'
        + f'{to_part} "$reports" {_words(part)}\n'
    )


def kept(plan: Plan, condition: Condition, frames: range) -> str:
    """Draws a range of frames again, as files; those that are complete are left alone."""
    assert plan.sweep.keep is not None
    stage = plan.sweep.keep.stage
    directory = f"{plan.kept}/{condition.name}"
    chain = [_add_noise(plan, condition, frames), "digitize --quiet", *_programs(plan, condition, stage, (stage,))]
    chain[-1] += f" --resume -o {_words(f'{directory}/{stage}-{{frame:010}}.exr')}"
    lines = " \\\n  | ".join(chain)
    return f"set -euo pipefail\n{_words('mkdir', '-p', directory)}\n< {_words(plan.scene(condition))} {lines}\n"


def _add_noise(plan: Plan, condition: Condition, frames: range) -> str:
    seeds = ["--seed", str(condition.seed), "--sensor-seed", str(plan.sweep.sensor_seed)]
    options = [*seeds, *conditions.temperature_options(condition)]
    return _words("add-noise", "--quiet", *options, "--frames", f"{frames.start}..{frames.stop}")


def _programs(plan: Plan, condition: Condition, stage: str, stages: tuple[str, ...]) -> list[str]:
    """The programs between the stage before, of those that are measured, and this one; `digitize` stands before all."""
    order = ("adu", "demosaicked", "xyz", "lab")
    done = order.index(stages[stages.index(stage) - 1]) if stages.index(stage) else 0
    programs = {
        "demosaicked": _words("demosaic", "--quiet", "--method", condition.method),
        "xyz": _words("to-xyz", "--quiet", *_matrix(plan, condition)),
        "lab": _words("to-xyz", "--quiet", "--space", "lab", *(_white(plan) if "lab" in stages else [])),
    }
    return [programs[passed] for passed in order[done + 1 : order.index(stage) + 1]]


def _matrix(plan: Plan, condition: Condition) -> list[str]:
    matrix = plan.matrix(condition.sensor)
    return ["--matrix", matrix] if matrix else []


def _white(plan: Plan) -> list[str]:
    return ["--white-luminance", repr(plan.sweep.white_luminance_cd_per_m2)]
