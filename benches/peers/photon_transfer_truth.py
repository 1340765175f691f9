#!/usr/bin/env python3
"""Measures cameras whose numbers are known with photon-transfer and with the reference code of EMVA 1288, and tells which is nearer.

    benches/peers/photon_transfer_truth.py [--sets N] [--sources A,B] [--seed N] [--each] [--log FILE] [--read FILE]

Each set is a descriptor (EMVA1288_Data.txt) that both read: pairs of flats and of darks at 12 to 20 exposure times under one light,
and a stack of 16 to 50 flats and as many darks near half of saturation. Cameras are drawn anew for each set. Sources:

    generator   the simulator inside the package emva1288 (DatasetGenerator, Camera), patterns given to it
    ccd, cmos   a short simulator of numpy (class Numpy)
    own-ccd, own-cmos   render-radiance, add-noise and digitize
    hot         as cmos, with one photosite in 200 whose dark current is ten times as large, on average

Prints Markdown. Programs are those in CYANOMETER_BIN, or of the path. Runs under a Python with emva1288 1.0.2, numpy 1.26.4, scipy and Pillow.
With --log each set is a line of JSON in FILE; --read makes the table of such a file.
"""

import argparse
import json
import logging
import math
import os
import pathlib
import subprocess
import tempfile
import warnings

import numpy
from PIL import Image
from scipy.stats import norm

warnings.simplefilter("ignore")
logging.disable(logging.CRITICAL)
BIN = os.environ.get("CYANOMETER_BIN")
ROUNDING = 1 / 12
SOURCES = ("generator", "ccd", "cmos", "own-ccd", "own-cmos", "hot")
PARTS = ("total", "row", "column", "pixel")


def program(name):
    return str(pathlib.Path(BIN) / name) if BIN else name


# --- patterns -------------------------------------------------------------------------------------------------------------------

def mean_squares(pictures, freedom=1):
    """Mean squares of rows, columns and what is left, of pictures (frames, rows, columns) without their means."""
    pictures = numpy.asarray(pictures, float)
    pictures = pictures - pictures.mean(axis=(1, 2), keepdims=True)
    _, rows, columns = pictures.shape
    of_rows = columns * (pictures.mean(axis=2) ** 2).sum()
    of_columns = rows * (pictures.mean(axis=1) ** 2).sum()
    rest = (pictures ** 2).sum() - of_rows - of_columns
    return numpy.array([of_rows / (rows - 1), of_columns / (columns - 1), rest / (rows - 1) / (columns - 1)]) / freedom


def by_anova(squares, shape):
    """Variances total, row, column, pixel: unbiased, the total the sum of the parts."""
    rows, columns = shape
    row, column, pixel = (squares[0] - squares[2]) / columns, (squares[1] - squares[2]) / rows, squares[2]
    return numpy.array([row + column + pixel, row, column, pixel])


def by_image(picture):
    """The same by the reference code's own formulas, of a picture without any noise."""
    m, n = picture.shape
    mean, total = picture.mean(), picture.var(ddof=1)
    cav = ((picture.mean(axis=0) - mean) ** 2).sum() / n
    rav = ((picture.mean(axis=1) - mean) ** 2).sum() / m
    left = m * n - m - n
    column = (m * n - m) / left * cav - n / left * (total - rav)
    row = (m * n - n) / left * rav - m / left * (total - cav)
    return numpy.array([total, row, column, m * n / left * (total - cav - rav)])


# --- sets -----------------------------------------------------------------------------------------------------------------------

class Camera:
    """What a set's camera is: numbers in electrons, and the patterns that were drawn."""

    def __init__(self, random, is_cmos):
        self.random, self.is_cmos = random, is_cmos
        r, log = random.uniform, lambda low, high: math.exp(random.uniform(math.log(low), math.log(high)))
        self.columns, self.rows = int(random.integers(100, 161)), int(random.integers(80, 141))
        self.shape = (self.rows, self.columns)
        self.read = log(1.5, 6) if is_cmos else log(4, 15)
        self.full_well = log(5000, 40000)
        self.row_noise = self.read * r(0.1, 0.4) if is_cmos else 0.0
        self.column_noise = self.read * r(0.02, 0.1) if is_cmos else 0.0
        self.bits, filled = 12, r(0.8, 1.2)
        if 4000 * filled / self.full_well * self.read < 0.6:
            self.bits = 14
        self.top = 2 ** self.bits - 1
        self.gain = max(self.top * filled / self.full_well, 0.6 / self.read)
        self.efficiency = r(0.3, 0.8)
        self.longest_s = log(0.05, 2)
        self.rate = log(3, 300) / self.longest_s
        self.dcnu = r(0.05, 0.3) if is_cmos else r(0.02, 0.15)
        self.dsnu = (log(0.3, 2), log(0.1, 0.5), log(0.1, 1)) if is_cmos else (log(0.3, 1.5), log(0.05, 0.3), log(0.1, 0.5))
        self.prnu = (log(0.003, 0.012), log(0.0005, 0.003), log(0.0005, 0.003)) if is_cmos else (log(0.003, 0.012), log(0.0003, 0.001), log(0.0003, 0.001))
        self.black = round(6 * self.gain * math.hypot(self.read, self.row_noise, *self.dsnu)) + r(5, 30)
        self.times = int(random.integers(12, 21))
        self.stack = int(random.integers(16, 51))
        self.brightest = r(1.15, 1.4)

    def drawn(self, parts):
        pixel, row, column = parts
        normal = self.random.standard_normal
        return pixel * normal(self.shape) + row * normal((self.rows, 1)) + column * normal((1, self.columns))

    @property
    def capacity(self):
        """Electrons of all charge at which photosites or codes end."""
        return min(self.full_well, (self.top - self.black) / self.gain)

    def schedule(self):
        """Exposure times in s, light in electrons for each, and which has the stack."""
        shares = numpy.linspace(0.02, self.brightest, self.times)
        light = shares * (self.capacity - self.rate * self.longest_s * 0.75)
        times = numpy.round(shares / self.brightest * self.longest_s, 9)
        return times, light, int(numpy.abs(shares - 0.5).argmin())


class Numpy(Camera):
    """A linear camera: Poisson charge, ended at full well; read noise of photosites, rows and columns; fixed offsets; rounding."""

    def __init__(self, random, is_cmos):
        super().__init__(random, is_cmos)
        self.offset, self.response = self.drawn(self.dsnu), 1 + self.drawn(self.prnu)
        self.dark = self.rate * (1 + self.dcnu * random.standard_normal(self.shape)).clip(0)
        self.dark_square = self.dark.mean()

    def frame(self, light, time_s):
        normal = self.random.standard_normal
        charge = numpy.minimum(self.random.poisson(light * self.response + self.dark * time_s), self.full_well)
        noise = self.read * normal(self.shape) + self.row_noise * normal((self.rows, 1)) + self.column_noise * normal((1, self.columns))
        return numpy.rint(self.gain * (charge + self.offset + noise) + self.black).clip(0, self.top).astype(numpy.uint16)

    def conditions(self, folder):
        times, light, middle = self.schedule()
        plan = [(2, place) for place in range(len(times))] + [(self.stack, middle)]
        for count, place in plan:
            time_s = times[place]
            yield light[place] / self.efficiency, time_s, [self.frame(light[place], time_s) for _ in range(count)]
            yield None, time_s, [self.frame(0, time_s) for _ in range(count)]


class Own(Camera):
    """A camera that our programs simulate: the class R of three planes."""

    def __init__(self, random, is_cmos):
        super().__init__(random, is_cmos)
        self.black = round(self.black)
        self.seed = int(random.integers(1 << 31))
        self.number = 0

    def sensor(self, folder):
        keys = {
            "width": self.columns, "height": self.rows, "cfa": "grbg", "full_well_e": self.full_well, "dark_current_e_per_s": self.rate,
            "temperature_k": 298, "dcnu": self.dcnu, "prnu": self.prnu[0], "prnu_row": self.prnu[1], "prnu_column": self.prnu[2],
            "read_noise_e": self.read, "row_noise_e": self.row_noise, "column_noise_e": self.column_noise, "dsnu_e": self.dsnu[0],
            "dsnu_row_e": self.dsnu[1], "dsnu_column_e": self.dsnu[2], "bits": self.bits, "bias_adu": self.black, "adu_per_e": self.gain,
        }
        path = folder / "sensor.yaml"
        lines = "".join(f"  {key}: {value}\n" for key, value in keys.items())
        path.write_text(f"schema: cyanometer-sensor/2\nname: drawn\nreadout:\n{lines}")
        return path

    def draw(self, folder, light, time_s, count, noise=(), codes=()):
        """Frames of one light and time."""
        begin, self.number = self.number, self.number + count
        scene = ["--electrons", ",".join([repr(float(light))] * 3)] if light else ["--dark"]
        size = f"{self.columns}x{self.rows}"
        rendered, noisy = folder / "scene.exr", folder / "{frame}.exr"
        run = lambda *command: subprocess.run([program(command[0]), *map(str, command[1:]), "-q"], check=True, stdout=subprocess.DEVNULL)
        run("render-radiance", "--sensor", self.sensor(folder), *scene, "--size", size, "--exposure", repr(float(time_s)), "-o", rendered)
        run("add-noise", rendered, "--seed", self.seed, "--sensor-seed", self.seed, "--frames", f"{begin}..{begin + count}", *noise, "-o", noisy)
        found = []
        run("digitize", *[folder / f"{frame}.exr" for frame in range(begin, begin + count)], "--channel", "R", *codes, "-o", folder / "{stem}.tiff")
        for frame in range(begin, begin + count):
            found.append(numpy.asarray(Image.open(folder / f"{frame}.tiff")).astype(numpy.uint16))
            for path in folder.glob(f"{frame}.*"):
                path.unlink()
        return found

    def fixed(self, folder, light, time_s, slope, bias):
        """What the camera draws once, in electrons."""
        noise = ("--without", "dcsn,ssn,ron,row_noise,column_noise")
        codes = ("--bits", "16", "--bias", bias, "--slope", repr(slope))
        return (self.draw(folder, light, time_s, 1, noise, codes)[0].astype(float) - bias) / slope

    def conditions(self, folder):
        times, light, middle = self.schedule()
        level = 0.4 * self.capacity
        self.offset = self.fixed(folder, 0, 1e-9, 500.0, 30000)
        time_s = self.longest_s
        self.dark = (self.fixed(folder, 0, time_s, 16000 / max(30.0, self.rate * time_s), 20000) - self.offset) / time_s
        self.response = (self.fixed(folder, level, 1e-9, 50000 / level, 2000) - self.offset) / level
        # This model multiplies counts by the pattern.
        self.dark_square = (self.dark ** 2).mean() / self.rate
        plan = [(2, place) for place in range(len(times))] + [(self.stack, middle)]
        for count, place in plan:
            yield light[place] / self.efficiency, times[place], self.draw(folder, light[place], times[place], count)
            yield None, times[place], self.draw(folder, 0, times[place], count)


class Generator(Camera):
    """The simulator of the package: no noise of rows and columns, dark current alike everywhere, a dither of one code before rounding."""

    def __init__(self, random, is_cmos=False):
        super().__init__(random, is_cmos)
        self.bias = 12 * self.read
        self.full_well = self.full_well + self.bias
        self.prnu, self.dsnu = self.prnu, self.dsnu
        self.offset, self.response = self.drawn(self.dsnu), 1 + self.drawn(self.prnu)
        self.dark = numpy.full(self.shape, self.rate)
        self.dark_square, self.dcnu = self.rate, 0.0
        # Light reaches the largest code: full well below it is passed.
        self.gain = min(self.gain, 0.8 * self.top / self.full_well)
        self.bits = 14 if self.gain * self.read < 0.6 else self.bits
        if self.bits == 14:
            self.gain *= 16383 / self.top
            self.top = 16383
        self.black = float(round(self.black))

    @property
    def capacity(self):
        return min(self.full_well, (self.top - self.black) / self.gain) - self.bias

    def conditions(self, folder):
        from emva1288.camera.dataset_generator import DatasetGenerator
        from emva1288.camera.routines import Qe
        from emva1288.process.parser import ParseEmvaDescriptorFile

        class Writing(DatasetGenerator):
            def save_image(self, image, name):
                # Pillow writes no 32 bits as PNG any more.
                Image.fromarray(image.astype(numpy.uint16)).save(os.path.join(self.outdir, "images", name), compress_level=1)

        response = Qe(qe=numpy.full((*self.shape, 1), self.efficiency), wavelength=numpy.array([550.0]), width=self.columns, height=self.rows)
        made = Writing(
            steps=self.times, L=self.stack, outdir=str(folder / "made"), bit_depth=self.bits, width=self.columns, height=self.rows, qe=response,
            exposure_min=round(0.01 * self.longest_s * 1e9), exposure_max=round(self.longest_s * 1e9),
            K=self.gain, K_min=self.gain, K_max=self.gain, K_steps=1,
            blackoffset=self.black, blackoffset_min=self.black, blackoffset_max=self.black, blackoffset_steps=1,
            temperature=30, temperature_ref=30, dark_current_ref=self.rate, dark_signal_0=self.bias, sigma2_dark_0=self.read ** 2,
            u_esat=self.full_well, dsnu=self.offset, prnu=self.response, seed=int(self.random.integers(1 << 31)),
        )
        images = ParseEmvaDescriptorFile(made.descriptor_path).images
        for kind in "temporal", "spatial":
            for time_ns, of_time in images[kind].items():
                for photons, names in of_time.items():
                    yield photons or None, time_ns / 1e9, [numpy.asarray(Image.open(name)).astype(numpy.uint16) for name in names]


def camera_of(source, random):
    if source == "generator":
        return Generator(random)
    camera = (Own if source.startswith("own") else Numpy)(random, not source.endswith("ccd"))
    if source == "hot":
        camera.hot_square = 0.005 * 1.995 * (10 * camera.rate) ** 2
        camera.dark += (random.random(camera.shape) < 0.005) * random.exponential(10 * camera.rate, camera.shape)
        camera.dark_square = camera.dark.mean()
    return camera


def expected_variance(camera, light, time_s, every=0):
    """Temporal variance of photosites under so much light, in electrons, of normal noise that ends at full well or at the largest code."""
    few = slice(None, None, 1 + every), slice(None, None, 1 + every)
    mean = light * camera.response[few] + camera.dark[few] * time_s
    noise = camera.read ** 2 + camera.row_noise ** 2 + camera.column_noise ** 2

    def ended(mean, variance, end):
        sigma = numpy.sqrt(variance)
        z = (end - mean) / sigma
        below, density = norm.cdf(z), norm.pdf(z)
        of_first = -density + z * (1 - below)
        of_second = below - z * density + z * z * (1 - below)
        return mean + sigma * of_first, variance * (of_second - of_first ** 2)

    mean, variance = ended(mean, mean, camera.full_well - getattr(camera, "bias", 0.0))
    _, variance = ended(mean, variance + noise, (camera.top - camera.black) / camera.gain - getattr(camera, "bias", 0.0))
    return variance.mean()


def truth_of(camera, levels):
    """Numbers of the camera, and of the patterns drawn at the time of the stack."""
    mean = camera.response.mean()
    dark_noise = camera.read ** 2 + camera.row_noise ** 2 + camera.column_noise ** 2
    if isinstance(camera, Generator):
        dark_noise += ROUNDING / camera.gain ** 2
    with_rounding = dark_noise + ROUNDING / camera.gain ** 2
    efficiency = camera.efficiency * mean
    threshold = 0.5 + math.sqrt(0.25 + with_rounding)
    stack_s = max((frames.shape[0], time_s) for _, time_s, frames in levels)[1]
    # Photons that a photosite takes up to where it ends, in the time that it takes.
    light = sorted((photons / time_s) for photons, time_s, _ in levels if photons)[0]
    time_s = camera.capacity / (light * efficiency + camera.dark.mean())
    saturation = light * time_s * efficiency
    pattern = camera.offset + camera.dark * stack_s
    pairs = [(photons, time_s) for photons, time_s, frames in levels if photons and len(frames) == 2]
    variances = [expected_variance(camera, photons * camera.efficiency, time_s) for photons, time_s in pairs]
    of_level = pairs[int(numpy.argmax(variances))][0] * efficiency
    # Where levels were as close as can be.
    shares = numpy.linspace(0.7, 1.05, 141)
    variances = [expected_variance(camera, light * time_s * share * camera.efficiency, time_s * share, 2) for share in shares]
    of_peak = float(shares[int(numpy.argmax(variances))]) * saturation
    truth = {
        "gain": camera.gain, "qe": efficiency, "dark_noise": math.sqrt(dark_noise), "threshold": threshold / efficiency,
        "full_well": camera.full_well - getattr(camera, "bias", 0.0), "saturation": saturation, "saturation@level": of_level, "saturation@peak": of_peak, "snr_max": math.sqrt(saturation), "snr_max@level": math.sqrt(of_level), "dynamic_range": saturation / threshold,
        "dynamic_range@level": of_level / threshold,
        "dark_mean": camera.dark.mean(), "dark_variance": camera.dark_square, "linearity_min": 0.0, "linearity_max": 0.0,
    }
    laws = {"prnu": camera.prnu, "dsnu": (math.hypot(camera.dsnu[0], camera.dcnu * camera.rate * stack_s, math.sqrt(getattr(camera, "hot_square", 0.0)) * stack_s), *camera.dsnu[1:])}
    for name, picture, scale in ("prnu", camera.response, mean), ("dsnu", pattern, 1.0):
        image = numpy.sqrt(by_image(picture).clip(0)) / scale
        anova = numpy.sqrt(by_anova(mean_squares(picture[None]), picture.shape).clip(0)) / scale
        pixel, row, column = laws[name]
        law = (math.hypot(pixel, row, column), row, column, pixel)
        for part, *values in zip(PARTS, image, anova, law):
            truth.update({f"{name}_{part}{kind}": float(value) for kind, value in zip(("", "@anova", "@law"), values)})
    return {name: float(value) for name, value in truth.items()}


# --- measurements ---------------------------------------------------------------------------------------------------------------

def write_set(levels, bits, folder):
    """The descriptor, and its frames as PNG."""
    rows, columns = levels[0][2].shape[1:]
    lines, number = ["v 4.0", f"n {bits} {columns} {rows}"], 0
    for photons, time_s, frames in levels:
        lines.append(f"b {time_s * 1e9:.1f} {photons:.6f}" if photons else f"d {time_s * 1e9:.1f}")
        for frame in frames:
            Image.fromarray(frame).save(folder / f"{number}.png", compress_level=1)
            lines.append(f"i {number}.png")
            number += 1
    path = folder / "EMVA1288_Data.txt"
    path.write_text("\n".join(lines) + "\n")
    return path


def by_program(path, set_):
    told = subprocess.run([program("photon-transfer"), path, "--cfa", "monochrome", "--output-format", "json"], capture_output=True, text=True)
    if told.returncode:
        return {}, told.stderr
    channel = json.loads(told.stdout)["channels"][0]
    keys = {
        "gain": "gain_adu_per_e", "qe": "quantum_efficiency", "dark_noise": "dark_noise_e", "threshold": "threshold_photons",
        "saturation": "saturation_e", "snr_max": "snr_max", "dynamic_range": "dynamic_range", "dark_mean": "dark_current_e_per_s",
        "dark_variance": "dark_current_from_variance_e_per_s", "linearity_min": "linearity_error_min", "linearity_max": "linearity_error_max",
        "prnu_total": "prnu", "prnu_row": "prnu_row", "prnu_column": "prnu_column", "prnu_pixel": "prnu_pixel",
        "dsnu_total": "dsnu_e", "dsnu_row": "dsnu_row_e", "dsnu_column": "dsnu_column_e", "dsnu_pixel": "dsnu_pixel_e",
        "full_well": "full_well_e", "dcnu": "dcnu", "dsnu_offset": "dsnu_offset_e",
    }
    set_["intervals"] = {name: [channel[key]["low"], channel[key]["high"]] for name, key in keys.items() if channel.get(key)}
    found = {name: (channel.get(key) or {}).get("value") for name, key in keys.items()}
    return {name: value for name, value in found.items() if value is not None}, told.stderr


def by_code(path):
    from emva1288.process.data import Data1288
    from emva1288.process.loader import LoadImageData
    from emva1288.process.parser import ParseEmvaDescriptorFile
    from emva1288.process.results import Results1288

    images = LoadImageData(ParseEmvaDescriptorFile(str(path)).images, loglevel=logging.CRITICAL)
    told = Results1288(Data1288(images.data, loglevel=logging.CRITICAL).data, loglevel=logging.CRITICAL)
    numbers = {
        "gain": lambda: told.K, "qe": lambda: told.QE / 100, "dark_noise": lambda: told.sigma_d, "threshold": lambda: told.u_p_min,
        "saturation": lambda: told.u_e_sat, "snr_max": lambda: told.SNR_max, "dynamic_range": lambda: told.DR,
        "dark_mean": lambda: told.u_I_mean, "dark_variance": lambda: told.u_I_var,
        "linearity_min": lambda: told.LE_min / 100, "linearity_max": lambda: told.LE_max / 100,
        "prnu_total": lambda: told.PRNU1288 / 100, "prnu_row": lambda: told.PRNU1288_row / 100,
        "prnu_column": lambda: told.PRNU1288_col / 100, "prnu_pixel": lambda: told.PRNU1288_pixel / 100,
        "dsnu_total": lambda: told.DSNU1288, "dsnu_row": lambda: told.DSNU1288_row, "dsnu_column": lambda: told.DSNU1288_col,
        "dsnu_pixel": lambda: told.DSNU1288_pixel,
    }
    found = {}
    for name, of in numbers.items():
        try:
            value = float(of())
        except (ValueError, IndexError, ZeroDivisionError):
            continue
        if math.isfinite(value):
            found[name] = value
    return found


def measured(source, seed):
    random = numpy.random.default_rng([seed, SOURCES.index(source)])
    camera = camera_of(source, random)
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        levels = [(photons, time_s, numpy.stack(frames)) for photons, time_s, frames in camera.conditions(folder)]
        path = write_set(levels, camera.bits, folder)
        set_ = {}
        ours, said = by_program(path, set_)
        code = by_code(path)
    truth = truth_of(camera, levels)
    drawn = {name: value for name, value in vars(camera).items() if isinstance(value, (int, float, tuple))}
    set_ |= {"source": source, "seed": seed, "truth": truth, "ours": ours, "code": code, "said": said, "camera": drawn}
    return set_


# --- the table ------------------------------------------------------------------------------------------------------------------

def rms(values):
    return float(numpy.sqrt(numpy.mean(numpy.square(values))))


NUMBERS = {
    "gain": "K", "qe": "quantum efficiency", "dark_noise": "temporal dark noise", "threshold": "absolute sensitivity threshold",
    "saturation": "saturation capacity", "snr_max": "SNR_max", "dynamic_range": "dynamic range",
    **{f"prnu_{part}": f"PRNU {part}" for part in PARTS}, **{f"dsnu_{part}": f"DSNU {part}" for part in PARTS},
    "dark_mean": "dark current, of means", "dark_variance": "dark current, of variances",
    "linearity_min": "linearity error, least", "linearity_max": "linearity error, largest",
}


def error(found, truth, name, kind=""):
    value, true = found.get(name), truth.get(name + kind, truth[name])
    if value is None:
        return None
    if name.startswith("linearity"):
        return value - true
    # A pattern that is drawn may be nearly none: what counts is the law's.
    return (value - true) / truth.get(name + "@law", true)


def row(sets, name, kind, random):
    pairs = [(error(one["ours"], one["truth"], name, kind), error(one["code"], one["truth"], name, kind)) for one in sets]
    both = numpy.array([pair for pair in pairs if None not in pair])
    if not len(both):
        return None
    def ratio(values):
        """That of the code over that here, with an interval."""
        of = lambda values: rms(values[:, 1]) / rms(values[:, 0])
        ratios = [of(values[random.integers(len(values), size=len(values))]) for _ in range(2000)]
        return "{:.2f} ({:.2f} to {:.2f})".format(of(values), *numpy.quantile(ratios, [0.025, 0.975]))

    ours, code = rms(both[:, 0]), rms(both[:, 1])
    nearer = int((numpy.abs(both[:, 0]) < numpy.abs(both[:, 1])).sum())
    missing = [sum(pair[place] is None for pair in pairs) for place in (1, 0)]
    held = [one["intervals"][name][0] <= one["truth"].get(name + kind, one["truth"][name]) <= one["intervals"][name][1] for one in sets if name in one["intervals"]]
    bias = [f"{100 * both[:, place].mean():+.3f}±{100 * both[:, place].std() / math.sqrt(len(both)):.3f}" for place in (0, 1)]
    return f"{100 * ours:.3f} | {100 * code:.3f} | {ratio(both)} | {nearer} of {len(both)} | {missing[0]} | {missing[1]} | {bias[0]} | {bias[1]} | {sum(held)} of {len(held)}"


def table(sets, title):
    print(f"\n{title}, {len(sets)} sets; errors relative to the truth in %, of patterns to the law's number, of linearity in % of the signal\n")
    print("| | rms here | rms code | code / here (95 %) | nearer here | code: none | here: none | mean error here | of the code | 95 % interval here holds it |")
    print("|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|")
    random = numpy.random.default_rng(0)
    for name, words in NUMBERS.items():
        kinds = [("", "")]
        if name.startswith(("prnu", "dsnu")):
            kinds = [("", ", drawn, formulas of the code"), ("@anova", ", drawn, analysis of variance"), ("@law", ", law")]
        if name == "saturation":
            kinds = [("", ", where charge ends"), ("@peak", ", largest variance"), ("@level", ", level of the set")]
        if name in ("snr_max", "dynamic_range"):
            kinds = [("", ""), ("@level", ", level of the set")]
        for kind, more in kinds:
            told = row(sets, name, kind, random)
            if told:
                print(f"| {words}{more} | {told} |")
    full = numpy.array([one["ours"]["full_well"] / one["truth"]["full_well"] - 1 for one in sets if "full_well" in one["ours"]])
    if len(full):
        print(f"\nFull well, of all charge, which the code does not tell: rms {100 * rms(full):.3f}, mean {100 * full.mean():+.3f}, in {len(full)} of {len(sets)} sets.")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sets", type=int, default=20, help="of each source")
    parser.add_argument("--sources", default=",".join(SOURCES[:5]))
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--log", type=pathlib.Path)
    parser.add_argument("--read", type=pathlib.Path)
    parser.add_argument("--each", action="store_true", help="tables of each source besides")
    asked = parser.parse_args()
    sets = [json.loads(line) for line in asked.read.read_text().splitlines()] if asked.read else []
    sets = [one for one in sets if one["source"] in asked.sources.split(",")]
    for source in asked.sources.split(",") if not asked.read else ():
        for seed in range(asked.seed, asked.seed + asked.sets):
            sets.append(measured(source, seed))
            if asked.log:
                with asked.log.open("a") as log:
                    log.write(json.dumps(sets[-1]) + "\n")
    table(sets, "All sources")
    for source in dict.fromkeys(one["source"] for one in sets) if asked.each else ():
        chosen = [one for one in sets if one["source"] == source]
        table(chosen, source)


if __name__ == "__main__":
    main()
