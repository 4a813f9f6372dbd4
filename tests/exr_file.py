"""An OpenEXR file written by hand, byte by byte, as its file layout document has it."""

import struct


def exr(channels, attributes=b"", sampling=1):
    """The bytes of a picture of one row; `channels` are lists of floats by name.

    All but the longest hold one sample for `sampling` pixels.
    """
    channels = dict(sorted(channels.items()))
    width = max(map(len, channels.values()))
    named = b"".join(
        name.encode() + b"\0" + struct.pack("<iB3xii", 2, 0, sampling if len(row) < width else 1, 1)
        for name, row in channels.items()
    )
    window = struct.pack("<4i", 0, 0, width - 1, 0)
    head = struct.pack("<II", 20000630, 2) + attributes
    for name, kind, value in (
        ("channels", "chlist", named + b"\0"),
        ("compression", "compression", b"\0"),
        ("dataWindow", "box2i", window),
        ("displayWindow", "box2i", window),
        ("lineOrder", "lineOrder", b"\0"),
        ("pixelAspectRatio", "float", struct.pack("<f", 1)),
        ("screenWindowCenter", "v2f", bytes(8)),
        ("screenWindowWidth", "float", struct.pack("<f", 1)),
    ):
        head += attribute(name, kind, value)
    row = b"".join(struct.pack(f"<{len(values)}f", *values) for values in channels.values())
    start = len(head) + 1 + 8
    return head + b"\0" + struct.pack("<QiI", start, 0, len(row)) + row


def attribute(name, kind, value):
    return f"{name}\0{kind}\0".encode() + struct.pack("<I", len(value)) + value
