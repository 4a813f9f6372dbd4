"""Which picture files there are, and what can be wrong with one."""

from os import PathLike, fspath
from pathlib import Path

PathOrStr = str | PathLike[str]

HEIC = (".heic", ".heif")
WRITABLE = (".exr", ".png", ".tif", ".tiff", ".jpg", ".jpeg")
READABLE = (*WRITABLE, ".hdr", ".webp", *HEIC)


class ImageError(ValueError):
    """A file that is not a picture, or a picture that cannot be written."""


class ImageWarning(UserWarning):
    """A picture was read, but not just as its file has it."""


def checked_suffix(path: PathOrStr, valid: tuple[str, ...]) -> str:
    """Return the suffix of a file in lower case if it is one of the `valid` ones, else raise."""
    suffix = Path(path).suffix.lower()
    if suffix in valid:
        return suffix
    raise ImageError(
        f"{fspath(path)}: has the suffix {suffix!r}, but must be one of {', '.join(valid)}"
    )
