"""Real data made by others: found in a folder of yours, or downloaded once and checked.

Nothing of it comes with plycloth but one draft of its own (`example_draft`). A folder named by the
environment variable ``PLYCLOTH_DATA`` is looked into first; without one, a file is downloaded from
its source and kept in the user's cache once its checksum is right. ``datasets.toml`` lists every
file with source and licence.
"""

import os
import tomllib
import warnings
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache
from pathlib import Path, PurePosixPath
from urllib.parse import quote

from tqdm import TqdmWarning

with warnings.catch_warnings():
    # It loads tqdm's bar for notebooks, which warns where there is no ipywidgets.
    warnings.simplefilter("ignore", TqdmWarning)
    import pooch

from plycloth._check import hint

FOLDER_VARIABLE = "PLYCLOTH_DATA"

_download = pooch.HTTPDownloader(timeout=30)


class DatasetError(OSError):
    """A data file that could not be had: not in the folder, no download, or a wrong checksum."""


@dataclass(frozen=True)
class DataFile:
    """One file of the registry.

    Attributes
    ----------
    name : str
        Folder and file, as `path` takes it.
    sha256 : str
        Checksum, in hexadecimal.
    source : str
        Repository (owner/name) or package that it comes from.
    licence : str
        As the source states it.
    url : str or None
        Where it can be downloaded, if it can.
    """

    name: str
    sha256: str
    source: str
    licence: str
    url: str | None


@cache
def registry() -> dict[str, DataFile]:
    """Every known file by name.

    A source with a commit is downloaded from ``https://github.com/<source>/raw/<commit>/<file>``.
    One commit is abbreviated to 7 digits, as its full hash is not known to us; GitHub resolves
    abbreviations in such addresses as long as they are unambiguous, which we could not try for
    this one. The checksum holds in any case.
    """
    table = tomllib.loads(Path(__file__).with_name("datasets.toml").read_text("utf-8"))
    files = {}
    for folder, source in table.items():
        for file, entry in source["files"].items():
            name = f"{folder}/{file}"
            files[name] = DataFile(
                name=name,
                sha256=entry["sha256"],
                source=source["source"],
                licence=source["licence"],
                url=_url(source, entry.get("at", file)),
            )
    return files


def names(folder: str = "") -> tuple[str, ...]:
    """Names that `path` takes, those below `folder` only if one is named.

    With ``PLYCLOTH_DATA`` set these are the files in that folder, else those of the registry.

    Raises
    ------
    ValueError
        On a folder that holds nothing, naming the nearest one or those there are.
    DatasetError
        If ``PLYCLOTH_DATA`` names no folder.
    """
    everything = _on_disk() if _own_folder() else tuple(sorted(registry()))
    if not folder:
        return everything
    found = tuple(name for name in everything if name.startswith(folder.rstrip("/") + "/"))
    if not found:
        parents = {str(parent) for name in everything for parent in PurePosixPath(name).parents}
        raise _unknown("folder", folder, parents - {"."})
    return found


def path(name: str) -> Path:
    """Find a file, or download it.

    Parameters
    ----------
    name : str
        Such as ``"photos/satin1_R.png"``; `names` lists them.

    Returns
    -------
    pathlib.Path
        In the folder that ``PLYCLOTH_DATA`` names if it is set, else in the user's cache.

    Raises
    ------
    ValueError
        On an unknown name, naming the nearest one or those there are.
    DatasetError
        If ``PLYCLOTH_DATA`` names no folder or the folder lacks the file; without it, if the file
        cannot be downloaded or its checksum is not the registered one.
    """
    folder = _own_folder()
    if folder is None:
        if name not in registry():
            raise _unknown("name", name, registry())
        return _fetched(registry()[name])
    if name in _on_disk():
        return folder / name
    if name in registry():
        raise DatasetError(f"{name}: is not in the folder {folder} that {FOLDER_VARIABLE} names")
    raise _unknown("name", name, _on_disk())


def example_draft() -> Path:
    """Path of the draft that comes with plycloth: a herringbone of 48 ends in four colours."""
    return Path(__file__).with_name("data") / "herringbone.wif"


def photo_pairs() -> tuple[str, ...]:
    """Names that `photo_pair` takes."""
    photos = {PurePosixPath(name).stem for name in names("photos")}
    return tuple(
        sorted(stem[:-2] for stem in photos if stem.endswith("_R") and stem[:-2] + "_T" in photos)
    )


def photo_pair(name: str) -> tuple[Path, Path]:
    """One fabric photographed lit from the front and lit from behind, 512 x 512, 8 bit.

    The pairs are those of Tang et al. 2024, "Woven Fabric Capture with a
    Reflection-Transmission Photo Pair".

    Parameters
    ----------
    name : str
        Such as ``"satin1"``; `photo_pairs` lists them.

    Returns
    -------
    front, back : pathlib.Path

    Raises
    ------
    ValueError, DatasetError
        As `path` does.
    """
    if name not in photo_pairs():
        raise _unknown("photo pair", name, photo_pairs())
    return path(f"photos/{name}_R.png"), path(f"photos/{name}_T.png")


def hdri(name: str) -> Path:
    """Find an environment map (latitude-longitude, linear, OpenEXR) by its name, as ``"studio"``.

    Raises
    ------
    ValueError, DatasetError
        As `path` does.
    """
    known = {PurePosixPath(file).stem: file for file in names("hdr")}
    if name not in known:
        raise _unknown("environment map", name, known)
    return path(known[name])


def _own_folder() -> Path | None:
    named = os.environ.get(FOLDER_VARIABLE)
    if not named:
        return None
    folder = Path(named)
    if not folder.is_dir():
        raise DatasetError(f"{FOLDER_VARIABLE}: names {named!r}, which is not a folder")
    return folder


def _on_disk() -> tuple[str, ...]:
    folder = _own_folder()
    if folder is None:
        return ()
    files = (file.relative_to(folder) for file in folder.rglob("*") if file.is_file())
    return tuple(sorted(file.as_posix() for file in files))


def _fetched(file: DataFile) -> Path:
    if file.url is None:
        raise DatasetError(
            f"{file.name}: comes with {file.source} and cannot be downloaded by itself; "
            f"set {FOLDER_VARIABLE} to a folder that holds it"
        )
    cached = PurePosixPath(file.name)
    try:
        return Path(
            pooch.retrieve(
                file.url,
                known_hash=f"sha256:{file.sha256}",
                fname=cached.name,
                path=pooch.os_cache("plycloth") / cached.parent,
                downloader=_download,
            )
        )
    except ValueError as error:
        raise DatasetError(f"{file.name}: {file.url} has another checksum: {error}") from error
    except OSError as error:
        raise DatasetError(
            f"{file.name}: {file.url} could not be downloaded ({error}); "
            f"or set {FOLDER_VARIABLE} to a folder that holds it"
        ) from error


def _url(source: dict[str, str], file: str) -> str | None:
    if "commit" not in source:
        return None
    return f"https://github.com/{source['source']}/raw/{source['commit']}/{quote(file)}"


def _unknown(what: str, name: str, known: Iterable[str]) -> ValueError:
    return ValueError(f"{what}: {name!r} is unknown; {hint(name, sorted(known))}")
