"""A draft as the text of a WIF, to be changed, and a fixture that reads it."""

import plycloth as pc
import pytest

# A complete draft that nothing is odd about: a 2/2 twill, which `changed` files depart from.
TWILL = {
    "WIF": "Version=1.1",
    "WEAVING": "Shafts=4\nTreadles=4\nRising Shed=true",
    "WARP": "Threads=4\nColor=1\nUnits=Centimeters\nSpacing=0.1\nThickness=0.08",
    "WEFT": "Threads=4\nColor=2\nUnits=Centimeters\nSpacing=0.2\nThickness=0.16",
    "COLOR PALETTE": "Range=0,255\nEntries=3",
    "COLOR TABLE": "1=255,0,0\n2=0,255,0\n3=51,102,204",
    "THREADING": "1=1\n2=2\n3=3\n4=4",
    "TIEUP": "1=1,2\n2=1,4\n3=3,4\n4=2,3",
    "TREADLING": "1=1\n2=2\n3=3\n4=4",
}
LIFTPLAN = {"TIEUP": None, "TREADLING": None, "LIFTPLAN": "1=1,2\n2=1,4\n3=3,4\n4=2,3"}
RED, GREEN, BLUE = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.2, 0.4, 0.8)


def text_of(changes=None) -> str:
    sections = {**TWILL, **(changes or {})}
    return "".join(f"[{name}]\n{rows}\n" for name, rows in sections.items() if rows is not None)


@pytest.fixture
def read(tmp_path):
    """Read a file of this text, of these bytes, or of the twill with these sections changed."""

    def read(content, *, trim=False, strict=False) -> pc.Draft:
        if not isinstance(content, bytes):
            content = (content if isinstance(content, str) else text_of(content)).encode()
        path = tmp_path / "draft.wif"
        path.write_bytes(content)
        return pc.read_wif(path, trim=trim, strict=strict)

    return read
