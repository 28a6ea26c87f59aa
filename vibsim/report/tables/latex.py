r"""Tables as LaTeX for the package ``booktabs``, in ASCII, so that pdflatex can print every character.

All text is escaped, never run. Greek letters, mathematical signs, superscripts and subscripts become mathematics,
accented letters LaTeX accents. Any other character becomes its code, such as ``U+4E2D``.
Source: The Unicode Standard, chapter 4 (names, categories and decompositions of characters).
"""

from __future__ import annotations

import re
import unicodedata
from itertools import groupby

from vibsim.report.tables.table import Table

LATEX = r"""\begin{table}
\centering
\caption{%s}
\begin{tabular}{%s}
\toprule
%s
\bottomrule
\end{tabular}
\end{table}
"""
_SPECIAL = {
    "\\": r"\textbackslash{}", "~": r"\textasciitilde{}", "^": r"\textasciicircum{}", "&": r"\&", "%": r"\%",
    "$": r"\$", "#": r"\#", "_": r"\_", "{": r"\{", "}": r"\}", "<": r"\textless{}", ">": r"\textgreater{}",
    "|": r"\textbar{}", '"': "''", "\n": " ", "\r": " ", "\t": " ",
    "\N{NO-BREAK SPACE}": "~", "\N{NARROW NO-BREAK SPACE}": r"\,", "\N{THIN SPACE}": r"\,",
    "–": "--", "—": "---", "‘": "`", "’": "'", "“": "``", "”": "''", "„": ",,", "…": r"\ldots{}",
    "ß": r"\ss{}", "æ": r"\ae{}", "Æ": r"\AE{}", "œ": r"\oe{}", "Œ": r"\OE{}", "ø": r"\o{}", "Ø": r"\O{}",
    "ł": r"\l{}", "Ł": r"\L{}", "ı": r"\i{}", "§": r"\S{}", "¶": r"\P{}", "©": r"\copyright{}", "£": r"\pounds{}",
    "\N{FRACTION SLASH}": "/",
}  # fmt: skip
_MATHEMATICS = {
    "−": "-", "±": r"\pm", "∓": r"\mp", "·": r"\cdot", "⋅": r"\cdot", "×": r"\times", "÷": r"\div", "√": r"\surd",
    "≤": r"\leq", "≥": r"\geq", "≠": r"\neq", "≈": r"\approx", "≡": r"\equiv", "∼": r"\sim", "∝": r"\propto",
    "≪": r"\ll", "≫": r"\gg", "∞": r"\infty", "∂": r"\partial", "∇": r"\nabla", "∫": r"\int", "∑": r"\sum",
    "∏": r"\prod", "∈": r"\in", "→": r"\rightarrow", "←": r"\leftarrow", "↔": r"\leftrightarrow",
    "⇒": r"\Rightarrow", "°": r"^{\circ}", "′": "'", "″": "''", "‴": "'''", "✓": r"\surd", "✗": r"\times",
    "¬": r"\neg", "µ": r"\mu", "ℓ": r"\ell", "ϑ": r"\vartheta", "ϕ": r"\varphi", "ϵ": r"\epsilon",
}  # fmt: skip
_SMALL = {
    "BETA", "GAMMA", "DELTA", "ZETA", "ETA", "THETA", "IOTA", "KAPPA", "MU", "NU", "XI", "PI", "RHO", "SIGMA", "TAU",
    "UPSILON", "PHI", "CHI", "PSI", "OMEGA", "ALPHA",
}  # fmt: skip
_GREEK = {name: rf"\{name.lower()}" for name in _SMALL} | {
    "EPSILON": r"\varepsilon", "LAMDA": r"\lambda", "FINAL SIGMA": r"\varsigma", "OMICRON": "o",
}  # fmt: skip
"""Unicode name of a small letter to its command."""
_CAPITALS = {
    name: rf"\{name.capitalize()}"
    for name in ("GAMMA", "DELTA", "THETA", "XI", "PI", "SIGMA", "UPSILON", "PHI", "PSI", "OMEGA")
} | {
    "ALPHA": "A", "BETA": "B", "EPSILON": "E", "ZETA": "Z", "ETA": "H", "IOTA": "I", "KAPPA": "K", "MU": "M",
    "NU": "N", "OMICRON": "O", "RHO": "P", "TAU": "T", "CHI": "X", "LAMDA": r"\Lambda",
}  # fmt: skip
"""Unicode name of a capital letter to its command, or to the Latin letter that looks the same."""
_ACCENTS = {
    "\u0300": "`", "\u0301": "'", "\u0302": "^", "\u0303": "~", "\u0304": "=", "\u0306": "u", "\u0307": ".",
    "\u0308": '"', "\u030a": "r", "\u030b": "H", "\u030c": "v", "\u0323": "d", "\u0327": "c", "\u0331": "b",
}  # fmt: skip
_SHIFTS = {"<super>": "^", "<sub>": "_"}
_ROOT = re.compile("√([A-Za-z0-9]+)")
_HARMLESS = re.compile("[A-Za-z0-9 .,:;+()/=-]*")  # text that needs no escaping
_OPTION = ("[", "*")  # beginnings of a row that ``\\`` before it would take as its option


def to_latex(table: Table) -> str:
    r"""Return a table as LaTeX for the package ``booktabs``: ``\input`` it into a document."""
    alignment = "".join("l" if column.form == "text" else "r" for column in table.columns)
    texts = [[column.title for column in table.columns], *table.text_rows()]
    head, *body = [_row(row) for row in texts]
    rows = "\n".join([head, r"\midrule", *body])
    return LATEX % (escape(table.caption), alignment, rows)


def _row(cells: list[str]) -> str:
    line = " & ".join(map(escape, cells))
    return f"{'{}' if line.lstrip().startswith(_OPTION) else ''}{line} \\\\"


def escape(text: str) -> str:
    """Escape text in ASCII so that LaTeX prints it as it stands."""
    if _HARMLESS.fullmatch(text):
        return text
    pieces, end = [], 0
    for root in _ROOT.finditer(text):
        pieces += [_plain(text[end : root.start()]), rf"$\sqrt{{\mathrm{{{root[1]}}}}}$"]
        end = root.end()
    return "".join([*pieces, _plain(text[end:])])


def _plain(text: str) -> str:
    """Escape characters one by one, and runs of superscripts or subscripts together."""
    parts = []
    for shift, group in groupby(text, _shift):
        if shift:
            parts.append(f"${_SHIFTS[shift]}{{{''.join(map(_on_line, group))}}}$")
        else:
            parts += map(_character, group)
    return "".join(parts)


def _shift(character: str) -> str:
    """Return the shift of a superscript or subscript that LaTeX can print; empty for other characters."""
    kind = unicodedata.decomposition(character).partition(" ")[0]
    return kind if kind in _SHIFTS and _on_line(character) else ""


def _on_line(character: str) -> str:
    """Return the base character of a superscript or subscript, in ASCII; in mathematics a minus is a hyphen."""
    plain = unicodedata.normalize("NFKD", character).replace("−", "-")
    return plain if plain.isascii() else ""


def _character(character: str) -> str:
    if character in _SPECIAL:
        return _SPECIAL[character]
    if character in _MATHEMATICS:
        return f"${_MATHEMATICS[character]}$"
    if character.isascii():
        return character if character.isprintable() else ""
    name = unicodedata.name(character, "")
    greek = re.fullmatch(r"GREEK (SMALL|CAPITAL) LETTER ([A-Z ]+?)(?: WITH .*)?", name)
    letter = {"SMALL": _GREEK, "CAPITAL": _CAPITALS}[greek[1]].get(greek[2]) if greek else None
    if letter:
        return f"${letter}$"
    # invisible: controls, joiners, combining marks without a letter
    if unicodedata.category(character) in {"Cc", "Cf", "Cs", "Mn", "Me"}:
        return ""
    decomposed = unicodedata.normalize("NFD", character)
    base, marks = decomposed[0], decomposed[1:]
    if marks and base.isascii() and base.isalpha():
        accent = next((_ACCENTS[mark] for mark in marks if mark in _ACCENTS), "")
        return f"\\{accent}{{{base}}}" if accent else base
    compatible = unicodedata.normalize("NFKD", character)
    if compatible != character:
        return "".join(map(_character, compatible))
    return " " if unicodedata.category(character) == "Zs" else f"U+{ord(character):04X}"
