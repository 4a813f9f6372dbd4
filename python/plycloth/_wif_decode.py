"""From the bytes of a WIF to its text, whatever the encoding."""

import codecs

# UTF-32's mark begins with that of UTF-16.
_MARKS = {
    codecs.BOM_UTF8: "utf-8",
    codecs.BOM_UTF32_LE: "utf-32-le",
    codecs.BOM_UTF32_BE: "utf-32-be",
    codecs.BOM_UTF16_LE: "utf-16-le",
    codecs.BOM_UTF16_BE: "utf-16-be",
}


def decode(data: bytes) -> str:
    """Decode UTF-8, UTF-16 or UTF-32 by its byte-order mark or its zeros, else UTF-8 or Latin-1.

    Raises
    ------
    UnicodeDecodeError
        If UTF-16 or UTF-32 breaks off within a character, or is none.
    """
    mark = next((mark for mark in _MARKS if data.startswith(mark)), b"")
    data = data.removeprefix(mark)
    encoding = _MARKS[mark] if mark else _unmarked(data)
    if encoding != "utf-8":
        return data.decode(encoding)
    try:
        return data.decode("utf-8")
    except UnicodeDecodeError:
        return data.decode("latin-1")


def _unmarked(data: bytes) -> str:
    """Return the encoding that a text of mostly ASCII has: every other byte of UTF-16 is 0."""
    even, odd = data[::2], data[1::2]
    for encoding, zeros, letters in (("utf-16-le", odd, even), ("utf-16-be", even, odd)):
        if 2 * zeros.count(0) > len(zeros) and not letters.count(0):
            return encoding
    return "utf-8"
