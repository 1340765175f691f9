"""Tags of a DNG of ours: their values, and others put in their place."""

import struct

import numpy as np

SIZES = {1: 1, 2: 1, 3: 2, 4: 4, 5: 8, 7: 1, 10: 8, 12: 8}
LETTERS = {1: "B", 3: "H", 4: "I", 5: "I", 7: "B", 10: "i", 12: "d"}

DESCRIPTION, SUB_IFDS, STRIPS, CFA_PATTERN, BLACK_LEVEL, WHITE_LEVEL = 270, 330, 273, 33422, 50714, 50717
CROP_ORIGIN, CROP_SIZE, COLOR_MATRIX, NEUTRAL, ACTIVE_AREA = 50719, 50720, 50721, 50728, 50829
NOISE_PROFILE, DIGEST, WIDTH, LENGTH = 51041, 51111, 256, 257
EXIF, EXPOSURE_TIME, F_NUMBER = 34665, 33434, 33437


class Tags:
    """The directories of a little-endian file: the first, and those of the raw image and of Exif below it."""

    def __init__(self, path):
        self.path = path
        self.bytes = bytearray(path.read_bytes())
        (place,) = struct.unpack_from("<I", self.bytes, 4)
        self.entries = self.directory(place)
        for tag in (SUB_IFDS, EXIF):
            self.entries |= self.directory(self.value(tag)[0])

    def directory(self, place):
        """Type, number of values and place of the value of each tag."""
        (count,) = struct.unpack_from("<H", self.bytes, place)
        found = {}
        for at in range(place + 2, place + 2 + 12 * count, 12):
            tag, kind, number = struct.unpack_from("<HHI", self.bytes, at)
            inline = SIZES[kind] * number <= 4
            found[tag] = kind, number, at + 8 if inline else struct.unpack_from("<I", self.bytes, at + 8)[0]
        return found

    def raw(self, tag):
        """The numbers of a tag as they stand: of ratios dividends and divisors."""
        kind, number, place = self.entries[tag]
        count = number * SIZES[kind] // struct.calcsize(LETTERS[kind])
        return struct.unpack_from(f"<{count}{LETTERS[kind]}", self.bytes, place)

    def value(self, tag):
        """The numbers of a tag."""
        found = self.raw(tag)
        return [a / b for a, b in zip(found[::2], found[1::2])] if self.entries[tag][0] in (5, 10) else list(found)

    def put(self, tag, values):
        """As many numbers in place of those that stand there; of ratios dividends and divisors."""
        kind, _, place = self.entries[tag]
        assert len(values) == len(self.raw(tag)), tag
        struct.pack_into(f"<{len(values)}{LETTERS[kind]}", self.bytes, place, *values)

    def samples(self, kind="<u2"):
        """The raw image, uncompressed, in one strip or several that follow each other; what is changed there is changed here."""
        (width,), (height,), (start, *_) = self.value(WIDTH), self.value(LENGTH), self.value(STRIPS)
        return np.frombuffer(self.bytes, kind, width * height, start).reshape(height, width)

    def forget_metadata(self):
        """Makes the metadata of ours a text that nobody knows, so that the tags alone count."""
        self.bytes[self.entries[DESCRIPTION][2]] = ord("x")

    def write(self, path=None):
        (path or self.path).write_bytes(self.bytes)
