"""The tables: Markdown for people, CSV and JSON for machines."""

import csv
import json

from .compare import DARK, RANGES, TOLERANCE, is_neutral, pooled

OVEREXPOSED = ("ramp-14", "ramp-white", "ramp-full")


def percent(result):
    """The deviation in a cell; bold where it is more than it may be."""
    if result.problem:
        return "refused"
    within_noise = result.deviation == 0 and result.z_rms == result.z_rms
    text = f"z {result.z_rms:.2f}" if within_noise else f"{100 * result.deviation:.3f}"
    return text if result.is_right else f"**{text}**"


def table(head, rows):
    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    return "\n".join(lines + ["| " + " | ".join(map(str, row)) + " |" for row in rows])


def markdown(names, versions, results, files, differences, warnings, noises):
    """The page: `results` by file and converter, `differences` of tags and of what LibRaw reads by file, `noises` by file."""
    there = [name for name in names if versions[name]]
    missing = [name for name in names if not versions[name]]
    parts = ["Converters: " + ", ".join(f"{name} {versions[name]}" for name in there) + "."]
    if missing:
        parts.append("Not installed, and left out: " + ", ".join(missing) + ".")

    parts.append(
        f"**Colors.** Largest deviation of X, Y or Z of a patch's mean from the truth, in per cent of it, over patches of {DARK:.0%} of white"
        f" and more; bold above {TOLERANCE:.0%}. Of noisy files all are within four standard errors where *z* stands: the root mean square"
        " of errors in standard errors, about 1 by noise alone."
    )
    rows = [[f"`{file.name}`", file.about, *(percent(results[file.name, name]) for name in there)] for file in files]
    parts.append(table(["file", "", *there], rows))

    off = [result for result in results.values() if not result.problem and not result.is_right]
    refused = [result for result in results.values() if result.problem]
    if off:
        parts.append("Off by more: " + "; ".join(f"{r.converter}, `{r.file}`, most in *{r.patch}*" for r in off) + ".")
    if refused:
        parts.append("Refused: " + "; ".join(f"{r.converter}, `{r.file}`: {r.problem}" for r in refused) + ".")

    parts.append(f"**Dark patches**, below {DARK:.0%} of white: largest error beyond four standard errors, in 10⁻⁵ of white.")
    ramps = [file for file in files if file.scene == "ramp"]
    rows = [[f"`{f.name}`", *(f"{1e5 * results[f.name, name].dark_error:.1f}" for name in there)] for f in ramps]
    parts.append(table(["file", *there], rows))

    exposed = [file for file in files if file.name in OVEREXPOSED]
    if exposed:
        parts.append("**Overexposed** in all classes: chromaticity x, y of what comes out; white is 0.3127, 0.3290.")
        rows = [[f"`{f.name}`", *(chromaticity(results[f.name, name]) for name in there)] for f in exposed]
        parts.append(table(["file", *there], rows))

    parts.append("**What is shown** of the stored image:")
    shown = {}
    for (file, name), result in results.items():
        if not result.problem:
            shown.setdefault((name, result.shown), []).append(file)
    rows = []
    for name in there:
        kinds = sorted((kind for kind in shown if kind[0] == name), key=lambda kind: -len(shown[kind]))
        most, *others = kinds or [(name, "nothing")]
        rows.append([name, "; ".join([most[1], *(f"{kind[1]} of {', '.join(f'`{f}`' for f in shown[kind])}" for kind in others)])])
    parts.append(table(["converter", "shows"], rows))

    parts.append("**Tags, digest, samples.** " + told_differences(differences, files))
    parts.append(
        "exiftool is not installed."
        if warnings is None
        else "`exiftool -validate` has " + ("nothing to complain of." if not warnings else "; ".join(warnings))
    )

    if noises:
        parts.append(
            "**NoiseProfile.** Variance of the samples over that which the tag tells, by signal (0 black, 1 white), with its standard"
            " error."
        )
        heads = [f"{low:g} to {high:g}" for low, high in RANGES]
        rows = []
        for file, found in noises.items():
            cells = {f"{low:g} to {high:g}": f"{ratio:.3f} ± {error:.3f}" for low, high, ratio, error, _ in found}
            rows.append([f"`{file}`", *(cells.get(head, "") for head in heads)])
        rows.append(["all", *(f"{ratio:.3f} ± {error:.3f}" for *_, ratio, error, _ in pooled(noises))])
        parts.append(table(["file", *heads], rows))
    return "\n\n".join(parts) + "\n"


def chromaticity(result):
    if not result.overexposed_xy:
        return ""
    text = "{:.4f}, {:.4f}".format(*result.overexposed_xy)
    return text if is_neutral(result) else f"**{text}**"


def told_differences(differences, files):
    wrong = [(name, text) for name, texts in differences.items() for text in texts]
    right = len(files) - len({name for name, _ in wrong})
    text = f"Of {len(files)} files {right} are read as they should be, to the bit."
    return text + "".join(f" `{name}`: {what}." for name, what in wrong)


def write(directory, page, results, noises, versions):
    """table.md, results.csv (each patch) and results.json (each file)."""
    (directory / "table.md").write_text(page, encoding="utf-8")
    with open(directory / "results.csv", "w", encoding="utf-8", newline="") as out:
        lines = csv.writer(out, lineterminator="\n")
        what = [f"{kind}_{axis}" for kind in ("found", "true", "standard_error") for axis in "XYZ"]
        lines.writerow(["converter", "file", "patch", *what])
        for result in results.values():
            for name, *numbers in result.patches:
                lines.writerow([result.converter, result.file, name, *(f"{number:.7g}" for number in numbers)])
    keys = ("converter", "file", "problem", "shown", "deviation", "patch", "z_rms", "dark_error", "overexposed_xy")
    files = [{key: getattr(result, key) for key in keys} | {"is_right": result.is_right} for result in results.values()]
    for file in files:
        for key in ("deviation", "z_rms", "dark_error"):
            file[key] = None if file[key] != file[key] else float(file[key])
        file["overexposed_xy"] = [float(number) for number in file["overexposed_xy"]]
        file["is_right"] = bool(file["is_right"])
    names = ("lower_signal", "upper_signal", "variance_ratio", "standard_error", "degrees_of_freedom")
    told = {file: [dict(zip(names, map(float, row))) for row in rows] for file, rows in noises.items()}
    text = json.dumps({"converters": versions, "files": files, "noise_profile": told}, indent=1)
    (directory / "results.json").write_text(text + "\n", encoding="utf-8")
