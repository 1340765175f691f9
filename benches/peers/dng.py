"""Writes the smallest DNG that raw converters open: one strip of 16-bit codes behind R G / G B."""

import struct

ASCII, BYTE, SHORT, LONG, SRATIONAL = 2, 1, 3, 4, 10
LETTERS = {ASCII: "s", BYTE: "B", SHORT: "H", LONG: "I"}


def write(path, codes, black, white):
    height, width = codes.shape
    # The identity as color matrix: XYZ of D65 to the camera's own colors. Nothing here depends on it.
    identity = [number for i in range(3) for j in range(3) for number in (int(i == j), 1)]
    entries = [
        (254, LONG, [0]),  # a full-resolution image
        (256, LONG, [width]),
        (257, LONG, [height]),
        (258, SHORT, [16]),
        (259, SHORT, [1]),  # not compressed
        (262, SHORT, [32803]),  # a color filter array
        (271, ASCII, b"none\0"),
        (272, ASCII, b"plane\0"),
        (273, LONG, [0]),  # where the strip is, filled in below
        (277, SHORT, [1]),
        (278, LONG, [height]),
        (279, LONG, [2 * width * height]),
        (33421, SHORT, [2, 2]),
        (33422, BYTE, [0, 1, 1, 2]),
        (50706, BYTE, [1, 4, 0, 0]),
        (50708, ASCII, b"none plane\0"),
        (50714, SHORT, [black]),
        (50717, LONG, [white]),
        (50721, SRATIONAL, identity),
        (50778, SHORT, [21]),
    ]
    after = 8 + 2 + 12 * len(entries) + 4
    strip = after + 256
    directory, extra = struct.pack("<H", len(entries)), b""
    for tag, kind, values in entries:
        if tag == 273:
            values = [strip]
        if kind == ASCII:
            count, data = len(values), values
        elif kind == SRATIONAL:
            count, data = len(values) // 2, struct.pack(f"<{len(values)}i", *values)
        else:
            count, data = len(values), struct.pack(f"<{len(values)}{LETTERS[kind]}", *values)
        if len(data) > 4:
            place = struct.pack("<I", after + len(extra))
            extra += data + b"\0" * (len(data) % 2)
        else:
            place = data.ljust(4, b"\0")
        directory += struct.pack("<HHI", tag, kind, count) + place
    with open(path, "wb") as file:
        file.write(b"II*\0" + struct.pack("<I", 8) + directory + struct.pack("<I", 0))
        file.write(extra.ljust(256, b"\0"))
        file.write(codes.astype("<u2").tobytes())
