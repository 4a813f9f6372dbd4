"""A colour profile written by hand, byte by byte, as ICC.1:2010 has it."""

import struct
from itertools import product

import numpy as np

# Red, green and blue of Adobe RGB (1998), adapted to D50, as its own profile has them.
ADOBE_RGB = (
    (0.60974, 0.31111, 0.01947),
    (0.20528, 0.62567, 0.06087),
    (0.14919, 0.06322, 0.74457),
)
D50 = (0.9642, 1.0, 0.8249)


def profile(colorants=ADOBE_RGB, gamma=563 / 256):
    """The bytes of a matrix profile for a display with these colorants and one gamma."""
    curve = b"curv" + struct.pack(">IIH", 0, 1, round(gamma * 256)) + b"\0\0"
    tags = {b"wtpt": _xyz(D50), b"desc": _description("test"), b"cprt": b"text" + bytes(4) + b"\0"}
    for name, colorant in zip((b"r", b"g", b"b"), colorants, strict=True):
        tags |= {name + b"XYZ": _xyz(colorant), name + b"TRC": curve}
    return _file(b"RGB ", tags)


def grey_profile(gamma):
    curve = b"curv" + struct.pack(">IIH", 0, 1, round(gamma * 256)) + b"\0\0"
    return _file(
        b"GRAY",
        {
            b"wtpt": _xyz(D50),
            b"desc": _description("grey"),
            b"cprt": b"text" + bytes(4) + b"\0",
            b"kTRC": curve,
        },
    )


def ink_profile():
    """A profile for four inks: a table of colours with nine amounts of each."""
    lab = b"".join(
        bytes(
            [
                round(255 * (1 - black) * (1 - 0.3 * cyan - 0.35 * magenta - 0.1 * yellow)),
                128 + round((30 * magenta - 20 * cyan) * (1 - black)),
                128 + round((30 * yellow - 20 * cyan) * (1 - black)),
            ]
        )
        for cyan, magenta, yellow, black in product(np.linspace(0, 1, 9), repeat=4)
    )
    matrix = b"".join(_fixed(value) for value in (1, 0, 0, 0, 1, 0, 0, 0, 1))
    straight = bytes(range(256))
    table = b"mft1" + bytes(4) + bytes([4, 3, 9, 0]) + matrix + 4 * straight + lab + 3 * straight
    tags = {b"wtpt": _xyz(D50), b"desc": _description("inks"), b"A2B0": table}
    return _file(b"CMYK", tags | {b"cprt": b"text" + bytes(4) + b"\0"}, b"prtr", b"Lab ")


def _file(space, tags, device=b"mntr", connection=b"XYZ "):
    table, body = b"", b""
    start = 128 + 4 + 12 * len(tags)
    for name, content in tags.items():
        content += bytes(-len(content) % 4)
        table += name + struct.pack(">II", start + len(body), len(content))
        body += content
    head = struct.pack(">I4sI4s4s4s", 0, bytes(4), 0x02400000, device, space, connection)
    head += struct.pack(">6H", 2020, 1, 1, 0, 0, 0) + b"acsp" + bytes(24) + bytes(4)
    head += b"".join(_fixed(value) for value in D50)
    head += bytes(128 - len(head))
    whole = head + struct.pack(">I", len(tags)) + table + body
    return struct.pack(">I", len(whole)) + whole[4:]


def _fixed(value):
    return struct.pack(">i", round(value * 65536))


def _xyz(values):
    return b"XYZ " + bytes(4) + b"".join(map(_fixed, values))


def _description(text):
    ascii_text = text.encode() + b"\0"
    counted = struct.pack(">I", len(ascii_text)) + ascii_text
    return b"desc" + bytes(4) + counted + bytes(4 + 4 + 2 + 1 + 67)
