"""Text for LaTeX: nothing in it is a command, and symbols of the field are set as mathematics."""

import re
import unicodedata

_SPECIAL = {
    "\\": r"\textbackslash{}", "&": r"\&", "%": r"\%", "$": r"\$", "#": r"\#", "_": r"\_",
    "{": r"\{", "}": r"\}", "~": r"\textasciitilde{}", "^": r"\textasciicircum{}",
    "<": r"\textless{}", ">": r"\textgreater{}", '"': "''", "|": r"\textbar{}", "[": "{[}", "]": "{]}",
    "±": r"$\pm$", "\N{MULTIPLICATION SIGN}": r"$\times$", "≤": r"$\le$", "≥": r"$\ge$", "°": r"$^\circ$",
    "²": "$^2$", "³": "$^3$",
    "µ": r"$\mu$", "\N{GREEK SMALL LETTER RHO}": r"$\rho$", "\N{EN DASH}": "--", "—": "---",
    "\N{MINUS SIGN}": "$-$",
}  # fmt: skip

_SYMBOLS = (
    (re.compile(r"\bQ([123])\b"), r"$Q_\1$"),
    (re.compile(r"\bk\\_cm\b"), "$k_{cm}$"),
    (re.compile(r"\brho\b"), r"$\\rho$"),
)


def escape_latex(text: str) -> str:
    """Return text in which LaTeX's special characters stand for themselves.

    A letter that pdfLaTeX has no font for becomes its Unicode number, as in U+4E2D.
    """
    return "".join(_escaped(character) for character in text)


def latex_prose(text: str) -> str:
    """Return escaped text in which Q1 to Q3 and k_cm are symbols, and negative numbers have a minus."""
    written = escape_latex(text)
    for pattern, symbol in _SYMBOLS:
        written = pattern.sub(symbol, written)
    return re.sub(r"(?<![\w-])-(?=\d)", "$-$", written)


def _escaped(character: str) -> str:
    if character in _SPECIAL:
        return _SPECIAL[character]
    if character.isspace() or unicodedata.category(character).startswith("C"):
        return " "
    if ord(character) < 0x180:  # Latin, which LaTeX's own fonts have
        return character
    return f"U+{ord(character):04X}"
