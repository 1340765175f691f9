"""Raw files beside LibRaw (rawpy): samples, levels, filter arrays, of a camera, of a corpus, and of DNGs that are made here.

The camera's files and the corpus are no part of this tree: `shared/data/raw` and `shared/corpus` are looked for beside it, and
CYANOMETER_CORPUS names another corpus. Where they are missing the tests say that they are skipped.
"""

import itertools
import os
import pathlib
import re
import struct
import unittest

import numpy as np
import rawpy
import tifffile

from programs import ROOT, SAMPLE_DATA, ProgramCase, read_spec

BYTE, SHORT, LONG, RATIO = 1, 3, 4, 5
FORMATS = {BYTE: "B", SHORT: "H", LONG: "I", RATIO: "I"}


def beside(place):
    """A file or directory of the data beside the tree; skips the test where it is missing."""
    found = [above / "shared" / place for above in ROOT.parents if (above / "shared" / place).exists()]
    if not found:
        raise unittest.SkipTest(f"shared/{place} is missing")
    return found[0]


def packed(samples, bits, order):
    """Rows of samples, packed with the highest bit first; 16 bits in the file's order."""
    if bits == 16:
        return samples.astype(order + "u2").tobytes()
    ones = (samples[..., None] >> np.arange(bits - 1, -1, -1)) & 1
    return np.packbits(ones.reshape(samples.shape[0], -1).astype(np.uint8), axis=1).tobytes()


def lossless_jpeg(samples, precision, predictor=1, components=1, restart_rows=0):
    """ITU-T T.81, process 14; each size has a code of five bits."""
    height, row = samples.shape
    width = row // components
    planes = samples.astype(int).reshape(height, width, components)
    predicted = np.zeros_like(planes)
    a, b, c = np.zeros_like(planes), np.zeros_like(planes), np.zeros_like(planes)
    a[:, 1:], b[1:], c[1:, 1:] = planes[:, :-1], planes[:-1], planes[:-1, :-1]
    rules = [a, b, c, a + b - c, a + ((b - c) >> 1), b + ((a - c) >> 1), (a + b) >> 1]
    predicted[:] = rules[predictor - 1]
    predicted[:, 0] = b[:, 0]
    for y in range(0, height, restart_rows or height):
        predicted[y] = a[y]
        predicted[y, 0] = 1 << (precision - 1)
    differences = (planes - predicted + 32767) % 65536 - 32767

    def segment(marker, body):
        return struct.pack(">BBH", 0xFF, marker, len(body) + 2) + body

    out = b"\xff\xd8" + segment(0xC4, bytes([0, 0, 0, 0, 0, 17, *[0] * 11, *range(17)]))
    frame = struct.pack(">BHHB", precision, height, width, components)
    out += segment(0xC3, frame + b"".join(bytes([c, 0x11, 0]) for c in range(components)))
    if restart_rows:
        out += segment(0xDD, struct.pack(">H", restart_rows * width))
    scan = b"".join(bytes([c, 0]) for c in range(components))
    out += segment(0xDA, bytes([components]) + scan + bytes([predictor, 0, 0]))
    for part, y in enumerate(range(0, height, restart_rows or height)):
        if part:
            out += bytes([0xFF, 0xD0 + (part - 1) % 8])
        words = []
        for difference in differences[y : y + (restart_rows or height)].ravel().tolist():
            size = abs(difference).bit_length()
            words.append(f"{size:05b}")
            if 0 < size < 16:
                words.append(f"{difference if difference > 0 else difference + (1 << size) - 1:0{size}b}")
        bits = "".join(words)
        bits += "1" * (-len(bits) % 8)
        out += int(bits, 2).to_bytes(len(bits) // 8, "big").replace(b"\xff", b"\xff\x00")
    return out + b"\xff\xd9"


def write_dng(path, samples, bits, compression=1, store=None, tile=None, rows=None, order="<", more=()):
    """Writes a DNG with one directory, in strips or tiles; a tag that is None is left out."""
    height, width = samples.shape
    store = store or (lambda part: packed(part, bits, order))
    if tile:
        columns, down = tile
        wide = np.pad(samples, ((0, -height % down), (0, -width % columns)), mode="edge")
        corners = itertools.product(range(0, height, down), range(0, width, columns))
        chunks = [store(wide[y : y + down, x : x + columns]) for y, x in corners]
        places, counts, shape = 324, 325, {322: (LONG, [columns]), 323: (LONG, [down])}
    else:
        rows = rows or height
        chunks = [store(samples[y : y + rows]) for y in range(0, height, rows)]
        places, counts, shape = 273, 279, {278: (LONG, [rows])}
    out = (b"II*\0" if order == "<" else b"MM\0*") + b"\0" * 4
    offsets = []
    for chunk in chunks:
        offsets.append(len(out))
        out += chunk + b"\0" * (len(chunk) % 2)
    tags = {
        254: (LONG, [0]),
        256: (LONG, [width]),
        257: (LONG, [height]),
        258: (SHORT, [bits]),
        259: (SHORT, [compression]),
        262: (SHORT, [32803]),
        271: (2, b"Test\0"),
        272: (2, b"Camera\0"),
        277: (SHORT, [1]),
        places: (LONG, offsets),
        counts: (LONG, [len(chunk) for chunk in chunks]),
        33421: (SHORT, [2, 2]),
        33422: (BYTE, [0, 1, 1, 2]),
        50706: (BYTE, [1, 4, 0, 0]),
        50708: (2, b"Test Camera\0"),
        50721: (10, struct.pack(order + "18i", *[n for x in (1, 0, 0, 0, 1, 0, 0, 0, 1) for n in (x, 1)])),
        50728: (RATIO, [1, 1, 1, 1, 1, 1]),
        50778: (SHORT, [21]),
        **shape,
        **dict(more),
    }
    tags = {tag: value for tag, value in tags.items() if value is not None}
    table = struct.pack(order + "H", len(tags))
    for tag, (kind, values) in sorted(tags.items()):
        value = values if isinstance(values, bytes) else struct.pack(order + FORMATS[kind] * len(values), *values)
        count = len(value) // {2: 1, 10: 8}[kind] if isinstance(values, bytes) else len(values)
        count = count // 2 if kind == RATIO else count
        if len(value) > 4:
            place, out = len(out), out + value + b"\0" * (len(value) % 2)
            value = struct.pack(order + "I", place)
        table += struct.pack(order + "HHI", tag, kind, count) + value.ljust(4, b"\0")
    place, out = len(out), out + table + b"\0" * 4
    path.write_bytes(out[:4] + struct.pack(order + "I", place) + out[8:])


def scene(bits, height=48, width=64, seed=1):
    """Noise about a slope: what neighbors tell of each other, and what they do not."""
    random = np.random.default_rng(seed)
    slope = np.add.outer(np.arange(height), np.arange(width)) / (height + width)
    codes = 0.7 * 2**bits * slope + random.normal(0, 2 ** (bits / 2), (height, width))
    codes[random.random((height, width)) < 0.02] = 2**bits - 1
    return np.clip(codes, 0, 2**bits - 1).astype(np.uint16)


class Raw(ProgramCase):
    """What `import-raw` makes of a DNG, and what LibRaw makes of it."""

    def same_as_libraw(self, path):
        """Compares all that is stored and what sees light, sample by sample; pattern, black and white by sites."""
        self.run_program(["import-raw", path, "--crop", "full", "-o", "full.exr", "-q"])
        self.run_program(["import-raw", path, "-o", "active.tiff", "-q"])
        full = self.planes((self.directory / "full.exr").read_bytes())["Y"]
        active = self.planes((self.directory / "active.tiff").read_bytes(), ".tiff")["Y"]
        known = self.metadata("full.exr")
        with rawpy.imread(str(path)) as raw:
            np.testing.assert_array_equal(full, raw.raw_image.astype(np.float32), str(path))
            # LibRaw leaves out the first row or column of an area that begins at an odd one, and counts the sites of black
            # levels from what is left, not from the area's corner as the specification has it (BlackLevel).
            below, right = raw.raw_image_visible.shape
            skipped = (active.shape[0] - below, active.shape[1] - right)
            self.assertLessEqual(max(skipped), 1)
            np.testing.assert_array_equal(active[-below:, -right:], raw.raw_image_visible, str(path))
            letters = np.frombuffer(raw.color_desc, np.uint8)
            corner = letters[raw.raw_colors[:2, :2]].tobytes().decode().lower()
            sites = np.roll(np.array(raw.black_level_per_channel)[raw.raw_colors[:2, :2]], skipped, (0, 1))
            white = raw.white_level
        corner = np.array(list(corner)).reshape(2, 2)
        self.assertEqual(known["cfa"], "".join(corner.ravel()), str(path))
        np.testing.assert_array_equal(known["black"], sites, str(path))
        self.assertEqual(known["white"], white, str(path))
        self.assertEqual(known["origin"], (0, 0))

    def metadata(self, name):
        """Origin, pattern and levels of a frame, from its report."""
        text = (self.directory / f"{name}.yaml").read_text(encoding="utf-8")
        lines = text.splitlines()
        value = {line.split(":")[0]: line.split(":", 1)[1].strip() for line in lines if ":" in line}
        at = lines.index(next(line for line in lines if line.startswith("black_level_adu:")))
        black = value["black_level_adu"]
        if black:
            numbers = [float(word) for word in black.strip("[]").split(",")]
        else:
            numbers = [float(line.strip(" -")) for line in lines[at + 1 : at + 5]]
        numbers = numbers * 4 if len(numbers) == 1 else numbers
        spec = read_spec(self.path(name))
        return {
            "cfa": value["cfa"],
            "white": float(value["white_level_adu"]),
            "black": np.array(numbers).reshape(2, 2),
            "origin": (spec.x, spec.y),
        }

    def test_frames_of_a_camera(self):
        directory = beside("data/raw")
        paths = sorted(directory.glob("*.dng"))
        self.assertGreaterEqual(len(paths), 2)
        for path in paths:
            self.same_as_libraw(path)

    def test_valid_files_of_the_corpus(self):
        named = os.environ.get("CYANOMETER_CORPUS")
        directory = pathlib.Path(named) if named else beside("corpus")
        paths = sorted((directory / "dng/valid").glob("*.dng"))
        self.assertGreaterEqual(len(paths), 1)
        for path in paths:
            self.same_as_libraw(path)

    def test_depths_strips_and_tiles(self):
        path = self.directory / "a.dng"
        for bits, order in itertools.product((10, 12, 14, 16), "<>"):
            for shape in ({}, {"rows": 7}, {"tile": (16, 32)}, {"tile": (64, 48)}):
                with self.subTest(bits=bits, order=order, **shape):
                    write_dng(path, scene(bits), bits, order=order, **shape)
                    self.same_as_libraw(path)

    def test_lossless_jpeg(self):
        path = self.directory / "a.dng"
        for predictor, components, precision in itertools.product(range(1, 8), (1, 2), (12, 14, 16)):
            for shape in ({}, {"tile": (16, 16)}):
                with self.subTest(predictor=predictor, components=components, precision=precision, **shape):
                    restart = 4 if predictor == 1 and precision == 14 else 0
                    settings = (precision, predictor, components, restart)
                    write_dng(path, scene(precision), precision, 7, lambda part, s=settings: lossless_jpeg(part, *s), **shape)
                    self.same_as_libraw(path)

    def test_levels_areas_and_tables(self):
        path = self.directory / "a.dng"
        levels = {50713: (SHORT, [2, 2]), 50714: (SHORT, [64, 65, 66, 67]), 50717: (LONG, [4000])}
        for top, left in itertools.product((0, 2, 3), (0, 4, 5)):
            area = {50829: (LONG, [top, left, 44, 60])}
            with self.subTest(top=top, left=left):
                write_dng(path, scene(12), 12, more={**levels, **area})
                self.same_as_libraw(path)
        table = np.minimum(np.arange(256) ** 2 // 16, 4095).tolist()
        more = {50712: (SHORT, table), 50714: (SHORT, [16]), 50717: (LONG, [4000])}
        write_dng(path, scene(8), 8, more=more)
        self.same_as_libraw(path)


class Written(ProgramCase):
    """What LibRaw and tifffile make of a DNG that is written here."""

    XYZ_TO_SRGB = np.array([[3.2406, -1.5372, -0.4986], [-0.9689, 1.8758, 0.0415], [0.0557, -0.2040, 1.0570]])

    def frame(self, pattern, crop="0,0,64,48"):
        """Codes of a sky behind a pattern, from a place on the sensor, as EXR and as DNG."""
        sky = SAMPLE_DATA / "skies/sky912.exr"
        self.run_program(["render-radiance", sky, "--patch", "9x9", "--cfa", pattern, "-o", "rates.exr"])
        self.run_program(["add-noise", "rates.exr", "--seed", "7", "-o", "noisy.exr"])
        self.run_program(["digitize", "noisy.exr", "--crop", crop, "-o", "codes.exr"])
        self.run_program(["digitize", "noisy.exr", "--crop", crop, "-o", "codes.dng"])
        return self.planes((self.directory / "codes.exr").read_bytes())["Y"]

    def tags(self, name):
        """Tags of the first directory and of the raw image, by number."""
        with tifffile.TiffFile(self.path(name)) as file:
            first = file.pages[0]
            raw = first.pages[0]
            return [{tag.code: tag.value for tag in page.tags} for page in (first, raw)], raw.asarray(), first.asarray()

    def test_codes_pattern_and_levels(self):
        for pattern, corner in itertools.product(("rggb", "bggr", "grbg", "gbrg"), ((0, 0), (1, 0), (0, 1), (3, 5))):
            with self.subTest(pattern=pattern, corner=corner):
                codes = self.frame(pattern, f"{corner[0]},{corner[1]},63,41")
                letters = np.array(list(pattern)).reshape(2, 2)
                letters = np.roll(letters, (-corner[1], -corner[0]), (0, 1))
                with rawpy.imread(self.path("codes.dng")) as raw:
                    np.testing.assert_array_equal(raw.raw_image, codes)
                    names = np.frombuffer(raw.color_desc, np.uint8)[raw.raw_pattern].tobytes().decode().lower()
                    self.assertEqual(names, "".join(letters.ravel()))
                    black = float(self.key("codes.dng", "black_level_adu"))
                    # LibRaw cuts the fraction off.
                    np.testing.assert_array_equal(raw.black_level_per_channel, [int(black)] * 4)
                    self.assertEqual(raw.white_level, float(self.key("codes.dng", "white_level_adu")))
                    self.assertEqual(raw.extract_thumb().data.shape, (20, 31, 3))

    def key(self, name, key):
        lines = (self.directory / f"{name}.yaml").read_text(encoding="utf-8").splitlines()
        return next(line.split(":")[1].strip() for line in lines if line.startswith(f"{key}:"))

    def test_colors(self):
        self.frame("rggb")
        (first, _), _, _ = self.tags("codes.dng")
        matrix = np.array(first[50721], float).reshape(9, 2)
        camera_from_xyz = (matrix[:, 0] / matrix[:, 1]).reshape(3, 3)
        neutral = np.array(first[50728], float).reshape(3, 2)
        neutral = neutral[:, 0] / neutral[:, 1]
        white = np.array([0.3127 / 0.3290, 1, (1 - 0.3127 - 0.3290) / 0.3290])
        np.testing.assert_allclose(camera_from_xyz @ white, neutral, atol=1e-8)
        self.assertAlmostEqual(neutral.max(), 1, places=9)
        text = (SAMPLE_DATA / "sensors/kaf-5101ce.yaml").read_text(encoding="utf-8").split("xyz_from_camera:")[1]
        numbers = re.findall(r"-?\d+(?:\.\d+)?(?:e-?\d+)?", text)[:9]
        product = camera_from_xyz @ np.array(numbers, float).reshape(3, 3)
        np.testing.assert_allclose(product / product[0, 0], np.eye(3), atol=1e-7)
        with rawpy.imread(self.path("codes.dng")) as raw:
            np.testing.assert_allclose(raw.camera_whitebalance[:3] * neutral / neutral.max(), 1, rtol=1e-6)
            # LibRaw's own white of D65 has other last digits.
            np.testing.assert_allclose(raw.daylight_whitebalance[:3] * neutral, 1, rtol=1e-3)
            # Camera to sRGB, white to white.
            srgb = np.linalg.inv(camera_from_xyz @ np.linalg.inv(self.XYZ_TO_SRGB))
            expected = srgb * (camera_from_xyz @ white)
            np.testing.assert_allclose(raw.color_matrix[:, :3], expected, atol=2e-3)

    def test_tags(self):
        codes = self.frame("grbg")
        (first, raw), samples, picture = self.tags("codes.dng")
        np.testing.assert_array_equal(samples, codes)
        self.assertEqual(max(picture.shape), 32)
        self.assertEqual(bytes(first[50706]), bytes([1, 4, 0, 0]))
        self.assertEqual(bytes(first[50707]), bytes([1, 1, 0, 0]))
        self.assertEqual((first[50708], first[50778], first[274]), ("kaf-5101ce", 21, 1))
        self.assertTrue(first[270].startswith("schema: cyanometer/1"))
        self.assertEqual(tuple(raw[50829]), (0, 0, 48, 64))
        above, below = raw[50714][:2]
        self.assertAlmostEqual(above / below, float(self.key("codes.dng", "black_level_adu")), places=6)
        self.assertEqual(len(raw[51041]), 6)

    def test_the_noise_profile_is_the_noise_of_frames(self):
        """Two exposures of flat scenes without patterns: half the variance of their difference, and that of each."""
        for electrons in (0, 3000, 20000):
            scene = ["--electrons", f"{electrons},{electrons},{electrons}"]
            self.run_program(["render-radiance", *scene, "--size", "300x200", "--cfa", "rggb", "-o", "rates.exr"])
            frames = []
            for number in (0, 1):
                without = ["--without", "dcnu,prnu"]
                self.run_program(["add-noise", "rates.exr", "--frame", number, *without, "-o", "noisy.exr"])
                self.run_program(["digitize", "noisy.exr", "-o", "codes.dng"])
                (_, raw), samples, _ = self.tags("codes.dng")
                frames.append(samples.astype(float))
            black, white = raw[50714][0] / raw[50714][1], raw[50717]
            slope, offset = raw[51041][:2]
            x = (np.mean(frames) - black) / (white - black)
            found = np.var(frames[0] - frames[1]) / 2 / (white - black) ** 2
            # The relative standard deviation of a variance of n samples is √(2/n): five of them.
            self.assertAlmostEqual(found / (slope * x + offset), 1, delta=5 * np.sqrt(2 / samples.size))

    def test_the_noise_profile_is_that_from_frame_to_frame(self):
        """Half the variance of the difference of two is that of the line, at any signal; a single frame has those of PRNU and DCNU besides."""
        slope_adu, dark_e, dcnu, prnu = 0.058824, 73.2, 0.2, 0.008
        for electrons in (0, 1000, 10000):
            scene = ["--electrons", f"{electrons},{electrons},{electrons}"]
            self.run_program(["render-radiance", *scene, "--size", "600x400", "--cfa", "rggb", "-o", "rates.exr"])
            frames = []
            for number in (0, 1):
                self.run_program(["add-noise", "rates.exr", "--frame", number, "-o", "noisy.exr"])
                self.run_program(["digitize", "noisy.exr", "-o", "codes.dng"])
                (_, raw), samples, _ = self.tags("codes.dng")
                frames.append(samples.astype(float))
            black, white = raw[50714][0] / raw[50714][1], raw[50717]
            slope, offset = raw[51041][:2]
            scale = white - black
            told = (slope * slope_adu * electrons / scale + offset) * scale**2
            single = np.mean([np.var(frame) for frame in frames])
            pair = np.var(frames[0] - frames[1]) / 2
            # Five standard deviations √(2/n) of a variance.
            tolerance = 5 * np.sqrt(2 / samples.size)
            patterns = (slope_adu * prnu * electrons) ** 2 + (slope_adu * dcnu * dark_e) ** 2
            self.assertAlmostEqual(single / (told + patterns), 1, delta=tolerance)
            self.assertAlmostEqual(pair / told, 1, delta=tolerance)

    def test_floats_between_codes_are_not_rounded(self):
        """Floats that lie between codes stay what they are in TIFF by default, and are refused where they would be rounded."""
        self.frame("rggb")
        self.run_program(["correct-frame", "codes.exr", "--black", "auto", "-o", "between.dng"])
        written = self.directory / "between.dng"
        # A stranger's, without metadata of ours.
        begin = b"schema: cyanometer/1"
        self.assertIn(begin, written.read_bytes())
        written.write_bytes(written.read_bytes().replace(begin, b"x" * len(begin)))
        (self.directory / "between.dng.yaml").unlink()
        self.run_program(["import-raw", "-q", "between.dng", "-o", "imported.tiff"])
        imported = self.planes((self.directory / "imported.tiff").read_bytes(), ".tiff")
        np.testing.assert_array_equal(next(iter(imported.values())), self.tags("between.dng")[1])
        for name in ("rounded.tiff", "rounded.png"):
            failed = self.attempt(["import-raw", "-q", "between.dng", "--sample-type", "u16", "-o", name])
            self.assertEqual(failed.returncode, 1)
            self.assertIn("lies between codes, and 16-bit integers would round it", failed.stderr.decode())
            self.assertFalse((self.directory / name).exists())

    def test_floats(self):
        self.frame("rggb")
        self.run_program(["correct-frame", "codes.exr", "--black", "auto", "-o", "signed.exr"])
        signed = self.planes((self.directory / "signed.exr").read_bytes())["Y"]
        self.assertLess(signed.min(), signed.max())
        for compression in ("none", "deflate"):
            self.run_program(["correct-frame", "codes.exr", "--black", "auto", "--compression", compression, "-o", "signed.dng"])
            if compression == "none":
                np.testing.assert_array_equal(self.tags("signed.dng")[1], signed)
            with rawpy.imread(self.path("signed.dng")) as raw:
                # LibRaw makes integers of floats: scaled, and nothing below zero.
                self.assertGreater(np.corrcoef(raw.raw_image.ravel(), np.maximum(signed, 0).ravel())[0, 1], 0.9999)


if __name__ == "__main__":
    unittest.main()
