"""Draws the plots of the page as SVG."""

import math

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402

# The colors of Okabe and Ito, which the color-blind can tell apart; each line has a mark of its own besides.
OURS, PEER = "#0072b2", "#b5b5b5"
COLORS = {"ours": OURS, "numpy": "#d55e00", "OpenCV": "#009e73"}
MARKS = {"ours": "o", "numpy": "s", "OpenCV": "^"}
NAMES = {"ours": "cyanometer", "numpy": "numpy + colour", "OpenCV": "numpy + OpenCV"}

plt.rcParams.update({"svg.hashsalt": "cyanometer", "font.size": 12, "axes.spines.top": False, "axes.spines.right": False})


def save(figure, folder, name):
    figure.savefig(folder / f"{name}.svg", metadata={"Date": None}, bbox_inches="tight")
    plt.close(figure)
    return f"{name}.svg"


def speeds(topics, folder):
    """Bars of the speeds of noise and demosaicking, ours by the set of instructions beside the peers."""
    shown = [topics[name] for name in ("noise", "demosaic") if name in topics and topics[name].plots]
    if not shown:
        return None
    heights = [len(topic.plots) for topic in shown]
    figure, axes = plt.subplots(
        len(shown), 1, figsize=(7.5, 0.36 * sum(heights) + 1.4 * len(shown)), squeeze=False, height_ratios=heights
    )
    for axis, topic in zip(axes[:, 0], shown):
        titles = {"noise": "Noise of a CFA plane", "demosaic": "Demosaicking (bilinear unless named)"}
        names = sorted(topic.plots, key=topic.plots.get)
        labels = [label(name, topic.name) for name in names]
        values = [topic.plots[name] for name in names]
        colors = [OURS if name.startswith("ours") else PEER for name in names]
        bars = axis.barh(labels, values, color=colors)
        axis.bar_label(bars, fmt="%.3g", padding=3)
        axis.set_title(f"{titles[topic.name]}, one core", loc="left", fontsize=12)
        axis.set_xlabel("Mpix/s")
        axis.set_xlim(0, 1.12 * max(values))
    figure.tight_layout()
    return save(figure, folder, "speeds")


def label(name, topic):
    if not name.startswith("ours "):
        return name
    kind = name.removeprefix("ours ")
    if topic == "demosaic" and kind in ("shti", "eci", "mhc"):
        return f"cyanometer, {kind.upper()}"
    return f"cyanometer, bilinear, {kind}" if topic == "demosaic" else f"cyanometer, {kind}"


def by_pixels(topic, folder, column, name, what, scale):
    figure, axis = plt.subplots(figsize=(6.5, 3.8))
    for key, points in topic.plots.items():
        if points:
            xs = [number / 1e6 for number, *_ in points]
            ys = [scale(point[column], point[0]) for point in points]
            axis.loglog(xs, ys, MARKS[key] + "-", color=COLORS[key], label=NAMES[key])
    axis.set_xlabel("frame, Mpix")
    axis.set_ylabel(what)
    axis.grid(True, which="major", color="#dddddd")
    for formatted in (axis.xaxis, axis.yaxis):
        formatted.set_major_formatter(matplotlib.ticker.StrMethodFormatter("{x:.10g}"))
        formatted.set_minor_formatter(matplotlib.ticker.NullFormatter())
    values = [y for line in axis.lines for y in line.get_ydata()]
    axis.set_ylim(10 ** math.floor(math.log10(min(values))), 10 ** math.ceil(math.log10(max(values))))
    axis.legend(frameon=False)
    return save(figure, folder, name)


def threads(topic, folder):
    figure, axis = plt.subplots(figsize=(5, 3.6))
    numbers = sorted({number for points in topic.plots.values() for number, _ in points})
    axis.plot(numbers, numbers, "--", color=PEER, label="ideal")
    for (name, points), marker, color in zip(topic.plots.items(), MARKS.values(), COLORS.values()):
        axis.plot(*zip(*points), marker + "-", color=color, label=name)
    axis.set_xticks(numbers)
    axis.set_ylim(0, max(numbers) * 1.1)
    axis.set_xlabel("threads")
    axis.set_ylabel("times as fast as one thread")
    axis.legend(frameon=False)
    return save(figure, folder, "threads")


def draw(topics, folder):
    """Draws what there are numbers for; gives the file and the caption of each plot, by the topic it stands under."""
    folder.mkdir(parents=True, exist_ok=True)
    drawn = {}
    if speeds(topics, folder):
        under = "demosaic" if "demosaic" in topics else "noise"
        drawn[under] = [("speeds.svg", "Pixels a second on one core, ours by the set of vector instructions, beside peers")]
    if "pixels" in topics and topics["pixels"].plots["ours"]:
        topic = topics["pixels"]
        by_pixels(topic, folder, 1, "time", "clock, ns per pixel", lambda seconds, pixels: seconds / pixels * 1e9)
        by_pixels(topic, folder, 2, "memory", "peak resident memory, MiB", lambda mebibytes, _: mebibytes)
        drawn["pixels"] = [
            ("time.svg", "Clock time per pixel of the whole chain against the size of the frame"),
            ("memory.svg", "Peak memory of the chain against the size of the frame: ours, seven processes together"),
        ]
    if "threads" in topics and any(topics["threads"].plots.values()):
        threads(topics["threads"], folder)
        drawn["threads"] = [("threads.svg", "Speed against threads")]
    return drawn
