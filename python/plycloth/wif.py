"""Weaving drafts in WIF files (Weaving Information File): reading and writing them.

Of the private modules behind this one, `_wif_text` takes the text apart, `_wif_shed` works out
the pattern, `_wif_yarns` the colours and lengths, `_wif_read` and `_wif_write` join the parts.
"""

from plycloth._wif_read import read_wif
from plycloth._wif_text import WifError, WifWarning
from plycloth._wif_write import write_wif

__all__ = ["WifError", "WifWarning", "read_wif", "write_wif"]
