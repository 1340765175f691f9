"""Writes an uncompressed scanline EXR of 32-bit planes: dictionary of channel names to arrays of one shape."""

import struct

import numpy as np


def write(path, planes, attributes=None):
    names = sorted(planes)
    height, width = planes[names[0]].shape
    channels = b"".join(name.encode() + b"\0" + struct.pack("<iB3xii", 2, 0, 1, 1) for name in names) + b"\0"
    window = struct.pack("<4i", 0, 0, width - 1, height - 1)
    header = [
        ("channels", "chlist", channels),
        ("compression", "compression", b"\0"),
        ("dataWindow", "box2i", window),
        ("displayWindow", "box2i", window),
        ("lineOrder", "lineOrder", b"\0"),
        ("pixelAspectRatio", "float", struct.pack("<f", 1)),
        ("screenWindowCenter", "v2f", struct.pack("<2f", 0, 0)),
        ("screenWindowWidth", "float", struct.pack("<f", 1)),
    ]
    header += [(name, "string", text.encode()) for name, text in (attributes or {}).items()]
    row_bytes = 4 * width * len(names)
    with open(path, "wb") as file:
        # Version 2; the flag of long names where one is longer than 31 bytes is not needed here.
        file.write(struct.pack("<II", 20000630, 2))
        for name, kind, value in header:
            file.write(name.encode() + b"\0" + kind.encode() + b"\0" + struct.pack("<i", len(value)) + value)
        file.write(b"\0")
        first = file.tell() + 8 * height
        file.write(struct.pack(f"<{height}Q", *(first + y * (8 + row_bytes) for y in range(height))))
        for y in range(height):
            file.write(struct.pack("<ii", y, row_bytes))
            file.write(np.concatenate([planes[name][y] for name in names]).astype("<f4").tobytes())
