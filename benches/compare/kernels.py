"""Kernels in memory on one core, ours beside peers, in turns."""

import subprocess

import measuring
from tables import Topic, figures, goal

HEADS = ["what", "peer", "ours, Mpix/s", "peer, Mpix/s", "ratio", "goal"]
ONE_CORE = (
    "In memory, one core, CPU time; in turns, run by run. Ours reads a frame and fills one band of rows after another, in the "
    "same buffer, as the programs do; the peers fill a frame."
)

# Least ratios to numpy's noise of a CFA plane, by the set of instructions.
NOISE_GOALS = {"baseline": 4.0, "avx2": 7.0, "avx512": 9.0}


def instruction_sets():
    command = [measuring.BIN / "bench-kernels", "--instructions"]
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout.split()


def pixels(size):
    width, height = size.split("x")
    return int(width) * int(height)


def speed(size, seconds):
    """Millions of pixels a second."""
    return pixels(size) / seconds / 1e6


def compare(topic, size, times, what, mine, peer, least=None, label=None):
    """A row of speeds in Mpix/s, where both ran; `label` names the peer where its key does not."""
    if mine in times and peer in times:
        ratio = times[peer] / times[mine]
        cells = [figures(speed(size, times[mine])), figures(speed(size, times[peer])), figures(ratio)]
        topic.rows.append([what, label or peer, *cells, goal(ratio, least) if least else ""])


def noise(settings):
    """Noise of one plane and of three."""
    sets, size = instruction_sets(), settings.size
    workers = {f"ours {name}": measuring.ours("noise-plane", size, name) for name in sets}
    workers["ours three"] = measuring.ours("noise-three", size)
    workers["rand_distr"] = measuring.ours("noise-rand-distr", size)
    workers["numpy"] = measuring.peer("noise", "plane", size)
    workers["numpy three"] = measuring.peer("noise", "three", size)
    workers["Pyxel"] = measuring.peer("noise", "pyxel", size)
    times, failures = measuring.in_turns(workers, settings.repeats)
    topic = Topic(
        "noise",
        "Noise in memory",
        f"{ONE_CORE} {size} photosites, light a ramp from 10 to 30 000 e⁻, 73.2 e⁻ of dark signal, 32-bit samples out. All "
        "but Pyxel draw five numbers for each photosite: Poisson numbers of light and dark current, normal numbers of "
        "PRNU, DCNU and read noise. Three planes count as one pixel. numpy: the default `Generator`, seeded, one array a "
        "source. rand_distr: its `Poisson` and `StandardNormal` on our keyed generator, photosite by photosite, built for "
        "the baseline. Pyxel: the functions of its models of shot noise, dark current, PRNU and read noise, on arrays; "
        "four draws, for its non-uniformity of dark current is one number a frame and is left out.",
        HEADS,
    )
    for name in sets:
        compare(topic, size, times, f"CFA plane, {name}", f"ours {name}", "numpy", NOISE_GOALS.get(name))
    widest = f"ours {sets[-1]}"
    compare(topic, size, times, f"CFA plane, {sets[-1]}", widest, "rand_distr", 8)
    compare(topic, size, times, f"CFA plane, {sets[-1]}", widest, "Pyxel")
    compare(topic, size, times, f"three planes, {sets[-1]}", "ours three", "numpy three", label="numpy")
    topic.missing(failures)
    topic.plots = {name: speed(size, seconds) for name, seconds in times.items() if "three" not in name}
    return topic


def demosaic(settings):
    """Interpolation of one plane."""
    sets, size = instruction_sets(), settings.size
    workers = {f"ours {name}": measuring.ours("bilinear", size, name) for name in sets}
    workers |= {f"ours {method}": measuring.ours(method, size) for method in ("shti", "eci", "mhc")}
    workers["OpenCV"] = measuring.peer("demosaic", "opencv", size)
    workers["colour-demosaicing"] = measuring.peer("demosaic", "colour", size)
    workers["LibRaw"] = measuring.peer("demosaic", "libraw", size)
    times, failures = measuring.in_turns(workers, settings.repeats)
    topic = Topic(
        "demosaic",
        "Demosaicking in memory",
        f"{ONE_CORE} {size} photosites behind R G / G B. Ours: 32-bit codes in, black removed, three signed 32-bit planes "
        "out. OpenCV: `cvtColor`, bilinear, 16-bit codes in and out, one thread. colour-demosaicing: bilinear, doubles. "
        "LibRaw: linear, 16 bits, by rawpy from a DNG of the same codes; its whole processing of the unpacked plane is in "
        "the time.",
        HEADS,
    )
    for name in sets:
        least = 1.2 if name == sets[-1] else None
        compare(topic, size, times, f"bilinear, {name}", f"ours {name}", "OpenCV", least)
    compare(topic, size, times, f"bilinear, {sets[-1]}", f"ours {sets[-1]}", "colour-demosaicing")
    compare(topic, size, times, f"bilinear, {sets[-1]}", f"ours {sets[-1]}", "LibRaw")
    for method, least in (("eci", 0.5), ("shti", None), ("mhc", None)):
        what = f"{method.upper()}, {sets[-1]}"
        compare(topic, size, times, what, f"ours {method}", "OpenCV", least, label="OpenCV, bilinear")
    topic.missing(failures)
    topic.plots = {name: speed(size, seconds) for name, seconds in times.items()}
    return topic


def matrix(settings):
    """The matrix of to-xyz beside libraries that multiply."""
    size = settings.size
    peers = {"numpy einsum": "einsum", "numpy matmul": "matmul", "OpenCV transform": "opencv", "colour vecmul": "colour"}
    workers = {"ours": measuring.ours("matrix", size)}
    workers |= {name: measuring.peer("matrix", workload, size) for name, workload in peers.items()}
    times, failures = measuring.in_turns(workers, settings.repeats)
    topic = Topic(
        "matrix",
        "Matrix in memory",
        f"{ONE_CORE} {size} pixels. Ours: 32-bit planes in and out, arithmetic in doubles, black removed, NaN counted. numpy "
        "and OpenCV: 32 bits, into an array that is made once. colour: `vecmul`, doubles.",
        HEADS,
    )
    for name in peers:
        compare(topic, size, times, "3×3 matrix", "ours", name)
    topic.missing(failures)
    return topic


def copy(settings):
    """Kernels that do little arithmetic beside copying of the same samples."""
    size = settings.size
    pairs = {"matrix": "copy-three", "moments": "copy-three", "adc": "copy", "moments-plane": "copy"}
    kernels = sorted(set(pairs) | set(pairs.values()))
    times, failures = measuring.in_turns({name: measuring.ours(name, size) for name in kernels}, settings.repeats)
    topic = Topic(
        "copy",
        "Light kernels beside copying",
        f"{ONE_CORE} {size} pixels, 32-bit. The peer is `memcpy` of the samples that the kernel reads, into a buffer that is "
        "made once: a ratio of 1 means as fast as copying.",
        HEADS,
    )
    names = {
        "matrix": "3×3 matrix, three planes",
        "moments": "moments and covariance, three planes",
        "adc": "converter, one plane",
        "moments-plane": "moments, one plane",
    }
    for kernel, copied in pairs.items():
        compare(topic, size, times, names[kernel], kernel, copied, 0.7, label="memcpy")
    topic.missing(failures)
    return topic


def spectral(settings):
    """Spectral images to the electrons of three classes."""
    sets, size = instruction_sets(), "256x128" if settings.quick else "512x256"
    workers = {f"ours {name}": measuring.ours("spectral", size, name) for name in sets}
    workers["numpy, planes"] = measuring.peer("spectral", "planes", size)
    workers["numpy, pixels"] = measuring.peer("spectral", "pixels", size)
    workers["reading alone"] = measuring.ours("spectral-read", size)
    times, failures = measuring.in_turns(workers, settings.repeats)
    topic = Topic(
        "spectral",
        "Spectral images in memory",
        f"{ONE_CORE} {size} pixels of 471 bands, 32-bit, to the electrons of three classes. Ours sums in doubles, from rows "
        "of planes as an EXR holds them. numpy: `tensordot` in 32 bits (OpenBLAS), once on planes, once on images whose "
        "bands lie side by side. Reading alone adds up all samples, in 32 bits: what this memory allows one core.",
        HEADS,
    )
    for name in sets:
        for peer in ("numpy, planes", "numpy, pixels"):
            compare(topic, size, times, name, f"ours {name}", peer, 3 if name == sets[-1] else None)
    compare(topic, size, times, sets[-1], f"ours {sets[-1]}", "reading alone", None)
    topic.missing(failures)
    return topic
