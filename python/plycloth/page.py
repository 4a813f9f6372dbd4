"""One HTML page that holds all it shows: text, pictures, plots and tables."""

import base64
import html
import io
from collections.abc import Iterable, Sequence
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING

from plycloth.image import Image

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_STYLE = """
body { font: 16px/1.5 system-ui, sans-serif; max-width: 70rem; margin: 2rem auto; padding: 0 1rem;
       color: #222; background: #fff; }
h1, h2 { line-height: 1.2; font-weight: 600; }
h2 { margin-top: 2.5rem; }
.pictures { display: flex; flex-wrap: wrap; gap: 1rem; }
figure { margin: 0; flex: 0 1 auto; }
figure img { max-width: 100%; height: auto; display: block; border-radius: 4px; }
figcaption { color: #555; font-size: 0.9rem; margin-top: 0.3rem; }
table { border-collapse: collapse; font-variant-numeric: tabular-nums; }
th, td { text-align: left; padding: 0.2rem 1.2rem 0.2rem 0; border-bottom: 1px solid #ddd; }
""".strip()


class Page:
    """A page in the making, from top to bottom.

    All text is escaped; pictures are part of the file, so that it can be mailed and refers to
    nothing else.

    Parameters
    ----------
    title
        Heading of the page.
    """

    def __init__(self, title: str) -> None:
        self._title = html.escape(title)
        self._parts = [f"<h1>{self._title}</h1>"]

    def heading(self, text: str) -> None:
        """Add a heading."""
        self._parts.append(f"<h2>{html.escape(text)}</h2>")

    def text(self, text: str) -> None:
        """Add a paragraph."""
        self._parts.append(f"<p>{html.escape(text)}</p>")

    def pictures(
        self, pictures: Iterable[tuple[str, Image | bytes]], *, gamma: float | None = None
    ) -> None:
        """Add pictures side by side.

        Parameters
        ----------
        pictures
            Pairs of a caption and a picture: an Image, or the bytes of a PNG file.
        gamma
            How Images are encoded, as in `Image.save`; None: by the sRGB curve.
        """
        figures = "\n".join(
            f'<figure><img src="{_data_uri(picture, gamma)}" alt="{html.escape(caption)}">'
            f"<figcaption>{html.escape(caption)}</figcaption></figure>"
            for caption, picture in pictures
        )
        self._parts.append(f'<div class="pictures">\n{figures}\n</div>')

    def plot(self, caption: str, figure: "Figure") -> None:
        """Add a matplotlib figure."""
        data = io.BytesIO()
        figure.savefig(data, format="png", dpi=110)
        self.pictures([(caption, data.getvalue())])

    def table(self, head: Sequence[str], rows: Iterable[Sequence[object]]) -> None:
        """Add a table; numbers are shown with four digits."""
        lines = [_row("th", head), *(_row("td", row) for row in rows)]
        self._parts.append("<table>\n" + "\n".join(lines) + "\n</table>")

    def __str__(self) -> str:
        body = "\n".join(self._parts)
        return (
            '<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
            '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
            f"<title>{self._title}</title>\n<style>\n{_STYLE}\n</style>\n</head>\n"
            f"<body>\n{body}\n</body>\n</html>\n"
        )

    def save(self, path: str | PathLike[str]) -> None:
        """Write the page to a file, in UTF-8.

        Raises
        ------
        OSError
            If the file cannot be written.
        """
        Path(path).write_text(str(self), encoding="utf-8")


def _row(tag: str, cells: Iterable[object]) -> str:
    shown = (f"{cell:.4g}" if isinstance(cell, float) else str(cell) for cell in cells)
    return "<tr>" + "".join(f"<{tag}>{html.escape(cell)}</{tag}>" for cell in shown) + "</tr>"


def _data_uri(picture: Image | bytes, gamma: float | None) -> str:
    data = picture if isinstance(picture, bytes) else picture.to_png(gamma)
    return "data:image/png;base64," + base64.b64encode(data).decode("ascii")
