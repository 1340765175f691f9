"""Makers' own raw files beside LibRaw (rawpy): samples, levels, filter arrays, areas.

No camera's files are at hand. These are laid out as five makers lay out theirs, by the tags that readers ask for; what a camera
writes besides, and compressions other than lossless JPEG, are not in them. Files of cameras in the directory that
CYANOMETER_RAWS names are compared too.
"""

import os
import pathlib
import struct
import unittest

import numpy as np
import rawpy

from programs import ProgramCase
from test_raw import beside, lossless_jpeg, packed, scene

ASCII, BYTE, SHORT, LONG, RATIO, UNDEFINED = 2, 1, 3, 4, 5, 7
FORMATS = {BYTE: "B", SHORT: "H", LONG: "I", RATIO: "I"}
SIZES = {ASCII: 1, BYTE: 1, SHORT: 2, LONG: 4, RATIO: 8, UNDEFINED: 1}
X_TRANS = "RBGBRGGGRGGBGGBGGRBRGRBGGGBGGRGGRGGB"


class Tiff:
    """A file laid out as a TIFF, as it grows."""

    def __init__(self, order, more=b""):
        self.order = order
        self.bytes = (b"II*\0" if order == "<" else b"MM\0*") + b"\0" * 4 + more

    def put(self, data):
        """Appends bytes, and gives their place."""
        self.bytes += b"\0" * (len(self.bytes) % 2)
        self.bytes += data
        return len(self.bytes) - len(data)

    def directory(self, tags, following=0):
        """Appends a directory, its values behind it, and gives its place."""
        place = len(self.bytes) + len(self.bytes) % 2
        behind, table, values = place + 2 + 12 * len(tags) + 4, struct.pack(self.order + "H", len(tags)), b""
        for tag, (kind, value) in sorted(tags.items()):
            if isinstance(value, str):
                value = value.encode() + b"\0"
            elif not isinstance(value, bytes):
                value = struct.pack(self.order + FORMATS[kind] * len(value), *value)
            count = len(value) // SIZES[kind]
            if len(value) > 4:
                values += b"\0" * (len(values) % 2)
                values, value = values + value, struct.pack(self.order + "I", behind + len(values))
            table += struct.pack(self.order + "HHI", tag, kind, count) + value.ljust(4, b"\0")
        return self.put(table + struct.pack(self.order + "I", following) + values)

    def exif(self, notes):
        """The directory of the exposure, 1/250 s at f/5.6, with notes of the maker."""
        exposure = {33434: (RATIO, [1, 250]), 33437: (RATIO, [56, 10]), 34855: (SHORT, [200])}
        return self.directory({**exposure, 37500: (UNDEFINED, notes)})

    def done(self, first):
        """The bytes of the file with its first directory."""
        return self.bytes[:4] + struct.pack(self.order + "I", first) + self.bytes[8:]


def plane(samples, place, length, bits, compression=1):
    """The tags of a plane behind R G / G B, in one strip."""
    height, width = samples.shape
    numbers = {254: [0], 256: [width], 257: [height], 273: [place], 278: [height], 279: [length]}
    shorts = {258: [bits], 259: [compression], 262: [32803], 277: [1], 33421: [2, 2]}
    tags = {tag: (LONG, value) for tag, value in numbers.items()} | {tag: (SHORT, value) for tag, value in shorts.items()}
    return {**tags, 33422: (BYTE, [0, 1, 1, 2])}


def picture(tiff, make, model):
    """The tags of a small picture of a camera."""
    place = tiff.put(bytes(144))
    numbers = {254: [1], 256: [8], 257: [6], 273: [place], 278: [6], 279: [144]}
    shorts = {258: [8, 8, 8], 259: [1], 262: [2], 274: [8], 277: [3]}
    tags = {tag: (LONG, value) for tag, value in numbers.items()} | {tag: (SHORT, value) for tag, value in shorts.items()}
    return {**tags, 271: (ASCII, make), 272: (ASCII, model)}


def nef(samples):
    """Nikon: a picture, and below it 12 bits packed."""
    tiff, notes = Tiff(">"), Tiff(">")
    data = packed(samples, 12, ">")
    balance = {0x0C: (RATIO, [19, 10, 14, 10, 1, 1, 1, 1]), 0x93: (SHORT, [1])}
    exif = tiff.exif(b"Nikon\0\x02\x10\0\0" + notes.done(notes.directory(balance)))
    below = tiff.directory(plane(samples, tiff.put(data), len(data), 12))
    first = {**picture(tiff, "NIKON CORPORATION", "NIKON D700"), 330: (LONG, [below]), 34665: (LONG, [exif])}
    return tiff.done(tiff.directory(first))


def pef(samples):
    """Pentax: 16 bits in the first directory, four black levels."""
    tiff = Tiff(">")
    levels = [tiff.put(struct.pack(">4H", *values)) for values in ((17, 18, 19, 20), (15000, 8192, 8192, 12000))]
    entries = [struct.pack(">HHII", tag, SHORT, 4, place) for tag, place in zip((0x200, 0x201), levels)]
    exif = tiff.exif(b"AOC\0MM" + struct.pack(">H", 2) + b"".join(entries) + bytes(4))
    data = samples.astype(">u2").tobytes()
    tags = plane(samples, tiff.put(data), len(data), 16)
    who = {271: (ASCII, "PENTAX Corporation"), 272: (ASCII, "PENTAX K10D"), 34665: (LONG, [exif])}
    return tiff.done(tiff.directory({**tags, **who}))


def mef(samples):
    """Mamiya: a picture, and below it 12 bits packed."""
    tiff = Tiff(">")
    data = packed(samples, 12, ">")
    below = tiff.directory(plane(samples, tiff.put(data), len(data), 12))
    return tiff.done(tiff.directory({**picture(tiff, "Mamiya-OP Co.,Ltd.", "MAMIYA ZD"), 330: (LONG, [below])}))


def cr2(samples):
    """Canon: lossless JPEG of two components, in the second directory."""
    height, width = samples.shape
    tiff = Tiff("<", b"CR\x02\0" + bytes(4))
    data = lossless_jpeg(samples, 12, components=2)
    colors = tiff.put(struct.pack("<653H", 1, *[0] * 652))
    sensor = tiff.put(struct.pack("<17H", 34, width, height, 0, 0, 4, 2, width - 5, height - 3, *[0] * 8))
    kinds = ((0x10, LONG, 1, 0x80000236), (0xE0, SHORT, 17, sensor), (0x4001, SHORT, 653, colors))
    notes = struct.pack("<H", 3) + b"".join(struct.pack("<HHII", *entry) for entry in kinds) + bytes(4)
    exif = tiff.exif(notes)
    strip = {259: (SHORT, [6]), 273: (LONG, [tiff.put(data)]), 279: (LONG, [len(data)])}
    raw = tiff.directory({**strip, 0xC5D8: (LONG, [1]), 0xC640: (SHORT, [0, 0, width])})
    tags = {tag: value for tag, value in picture(tiff, "Canon", "Canon EOS 400D DIGITAL").items() if tag != 254}
    whole = tiff.done(tiff.directory({**tags, 34665: (LONG, [exif])}, raw))
    return whole[:12] + struct.pack("<I", raw) + whole[16:]


def raf(samples):
    """Fujifilm: 14 bits in words behind an X-Trans array, whose letters stand in the file from the last to the first."""
    height, width = samples.shape
    about = Tiff("<")
    exif = about.exif(b"FUJIFILM" + struct.pack("<IHI", 12, 0, 0))
    camera = {271: (ASCII, "FUJIFILM"), 272: (ASCII, "X-T1"), 34665: (LONG, [exif])}
    about = about.done(about.directory(camera))
    jpeg = b"\xff\xd8\xff\xe1" + struct.pack(">H", len(about) + 8) + b"Exif\0\0" + about + b"\xff\xd9"
    letters = bytes("RGB".index(letter) for letter in reversed(X_TRANS))
    size = struct.pack(">HH", height, width)
    tags = [(0x100, size), (0x110, bytes(4)), (0x111, size), (0x121, size), (0x131, letters)]
    block = struct.pack(">I", len(tags)) + b"".join(struct.pack(">HH", tag, len(value)) + value for tag, value in tags)
    raw = Tiff("<")
    data = samples.astype("<u2").tobytes()
    values = {0xF001: [width], 0xF002: [height], 0xF003: [14], 0xF007: [raw.put(data)], 0xF008: [len(data)]}
    values |= {0xF00A: [1024] * 36, 0xF00E: [302, 600, 420]}
    below = raw.directory({tag: (LONG, value) for tag, value in values.items()})
    raw = raw.done(raw.directory({0xF000: (LONG, [below])}))
    out, places = b"FUJIFILMCCD-RAW 0201".ljust(28, b"\0") + b"X-T1".ljust(132, b"\0"), b""
    for part in (jpeg, block, raw):
        out += b"\0" * (-len(out) % 4)
        out, places = out + part, places + struct.pack(">II", len(out), len(part))
    return out[:84] + places + out[84 + len(places) :]


class Makers(ProgramCase):
    """What `import-raw` makes of such files, and what LibRaw makes of them."""

    def same_as_libraw(self, path, masked=None):
        """Compares all that is stored, the filter of each photosite, and black by site, or with the code of masked photosites.

        White levels are of different tables."""
        self.run_program(["import-raw", path, "--crop", "full", "-o", "full.exr", "-q"])
        full = self.planes((self.directory / "full.exr").read_bytes())["Y"]
        known = (self.directory / "full.exr.yaml").read_text(encoding="utf-8")
        value = {line.split(":")[0]: line.split(":", 1)[1].strip() for line in known.splitlines() if ":" in line}
        with rawpy.imread(str(path)) as raw:
            np.testing.assert_array_equal(full, raw.raw_image.astype(np.float32), str(path))
            letters = np.frombuffer(raw.color_desc, np.uint8)
            margin = raw.sizes.top_margin, raw.sizes.left_margin
            pattern = np.roll(raw.raw_pattern, margin, (0, 1))
            levels = np.array(raw.black_level_per_channel)
        period = 6 if len(pattern) == 6 else 2
        pattern = letters[pattern[:period, :period]].tobytes().decode()
        names = {"rggb": "RGGB", "bggr": "BGGR", "grbg": "GRBG", "gbrg": "GBRG"}
        cfa = value["cfa"].strip("'\"")
        self.assertEqual(names.get(cfa, cfa.split(":")[-1].upper()), pattern, str(path))
        black = value["black_level_adu"]
        text = known.split("black_level_adu:")[1].splitlines()[1:5]
        black = [float(black)] * 4 if black else [float(line.strip(" -")) for line in text]
        # LibRaw has them by its colors: R, G, B and the second G.
        expected = levels[[0, 1, 3, 2]] if period == 2 and pattern == "RGGB" else levels
        expected = expected if masked is None else [masked] * 4
        np.testing.assert_allclose(black, expected, atol=0.5, err_msg=str(path))
        return value

    def test_files_laid_out_as_makers_do(self):
        for make in (nef, pef, mef, cr2):
            # The areas of the cameras' tables need so much.
            samples = scene(12, height=96, width=128)
            path = self.directory / f"a.{make.__name__}"
            with self.subTest(make.__name__):
                # Of this camera rawler measures black in 40 columns that see no light, which LibRaw finds in files of full size.
                masked = 256 if make is cr2 else None
                if masked:
                    samples[:, :40] = masked
                path.write_bytes(make(samples))
                self.same_as_libraw(path, masked)

    def test_x_trans(self):
        samples = np.maximum(scene(14, height=60, width=120), 1024)
        path = self.directory / "a.raf"
        path.write_bytes(raf(samples))
        value = self.same_as_libraw(path)
        self.assertEqual(value["cfa"].strip("'\""), f"6x6:{X_TRANS}")

    def test_files_of_cameras(self):
        named = os.environ.get("CYANOMETER_RAWS")
        directory = pathlib.Path(named) if named else beside("data/raw/makers")
        for path in sorted(directory.iterdir()):
            with self.subTest(path.name):
                self.same_as_libraw(path)


if __name__ == "__main__":
    unittest.main()
