"""Tables as LaTeX: plain ASCII that prints what it says, and that pdflatex compiles."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import pytest
import samples
from hypothesis import given
from hypothesis import strategies as st

from vibsim import report
from vibsim.experiment import Experiment
from vibsim.report.tables import latex
from vibsim.report.tables.table import Column, Table

CONFIGS = Path(__file__).parents[2] / "configs"
WRITTEN = re.compile(
    r"""[ !'()*+,./0-9:;=?@A-Z\[\]`a-z~-]"""  # a character as it is; ~ is a space that does not break
    r"""|\\[&%$#_{},]|\\['`^~=."urHvdcb]\{[A-Za-z]\}"""
    r"""|\\(?:text[a-z]+|ldots|ss|ae|AE|oe|OE|o|O|l|L|i|S|P|copyright|pounds)\{\}"""
    r"""|\$[_^]\{[-+=()A-Za-z0-9]+\}\$|\$(?:\\[A-Za-z]+|[-'A-Zo]+|\^\{\\circ\})\$"""
    r"""|\$\\sqrt\{\\mathrm\{[A-Za-z0-9]+\}\}\$"""
)
"""All that the text of a cell may become."""
LAST = 0x1FFFF  # what lies beyond are private and rare characters
WITHOUT_PDFLATEX = (
    "no pdflatex is on the PATH, so nothing tells whether the LaTeX tables compile: install it "
    "(`apt-get install texlive-latex-base texlive-latex-recommended`)"
)


def table(*rows: tuple[str, ...]) -> Table:
    columns = (Column("scheme"), Column("difference", "rad", "norm"), Column("order", form="order"))
    return Table("orders", "Orders of 100 % & more", columns, rows)


def test_a_table_is_booktabs_and_escaped() -> None:
    text = latex.to_latex(table((r"a_b & \input{x} 50% #1 $x^2~", 1.5e-12, 2.0)))
    assert r"\toprule" in text
    assert r"\caption{Orders of 100 \% \& more}" in text
    assert (
        r"a\_b \& \textbackslash{}input\{x\} 50\% \#1 \$x\textasciicircum{}2\textasciitilde{}"
        in text
    )
    assert r"1.500$\cdot$10$^{-12}$" in text
    assert r"\begin{tabular}{lrr}" in text


@pytest.mark.parametrize(
    ("text", "written"),
    [
        ("rad √s", r"rad $\sqrt{\mathrm{s}}$"),
        ("m s⁻²", r"m s$^{-2}$"),
        ("[D₂ₜu]", r"[D$_{2t}$u]"),
        ("θ₇ − θ₈", r"$\theta$$_{7}$ $-$ $\theta$$_{8}$"),
        ("Ω, Λ, µ, μ, Α", r"$\Omega$, $\Lambda$, $\mu$, $\mu$, $A$"),
        ("a ≤ 2·10⁻³ ± ∞", r"a $\leq$ 2$\cdot$10$^{-3}$ $\pm$ $\infty$"),
        ("Störmer, Ångström, naïve, Erdős", r"St\"{o}rmer, \r{A}ngstr\"{o}m, na\"{i}ve, Erd\H{o}s"),
        ("40° → ½", r"40$^{\circ}$ $\rightarrow$ 1/2"),
        ("“a” – b…", r"``a'' -- b\ldots{}"),
        ("1\N{NARROW NO-BREAK SPACE}000", r"1\,000"),
        ("a\N{ZERO WIDTH SPACE}b\x00", "ab"),
        ("中", "U+4E2D"),
    ],
)
def test_signs_are_printed(text: str, written: str) -> None:
    assert latex.escape(text) == written


@given(st.text())
def test_whatever_a_text_contains_is_printed_in_ascii(text: str) -> None:
    written = latex.escape(text)
    assert written.isascii()
    assert WRITTEN.sub("", written) == ""


def written_characters() -> list[str]:
    """Return what the characters of Unicode become."""
    return sorted({latex.escape(chr(i)) for i in range(LAST + 1)})


@pytest.mark.slow
def test_every_character_is_printed_in_ascii() -> None:
    for written in written_characters():
        assert written.isascii()
        assert WRITTEN.sub("", written) == "", written


def test_no_row_begins_with_an_option_of_the_row_before() -> None:
    text = latex.to_latex(table(("[1pt]", "a", "b"), ("* c", "d", "e"), (" [x]", "f", "g")))
    assert not re.search(r"\\\\\s*[\[*]", text)


def compiled(folder: Path, body: str) -> None:
    """Compile a document, which ends at the first fault."""
    program = shutil.which("pdflatex")
    if program is None:
        pytest.skip(WITHOUT_PDFLATEX)
    head = "\\documentclass{article}\n\\usepackage{booktabs}\n\\begin{document}\n"
    (folder / "all.tex").write_text(f"{head}{body}\n\\end{{document}}\n", encoding="ascii")
    command = [program, "-interaction=nonstopmode", "-halt-on-error", "-draftmode", "all.tex"]
    ended = subprocess.run(command, cwd=folder, capture_output=True, timeout=300)
    told = ended.stdout.decode(errors="replace")
    assert ended.returncode == 0, told[-2000:]
    assert "Missing character" not in (folder / "all.log").read_text(errors="replace")


@pytest.mark.slow
def test_every_character_compiles(tmp_path: Path) -> None:
    compiled(tmp_path, "\n".join(written_characters()))


SHIPPED = (
    "pendulum_lab/theta_convergence",
    "vibration_text/bouncing_ball",
    "vibration_text/energy_tables",
    "vibration_text/exact_degrees_cubic_spring",
    "vibration_text/just_unstable",
    "vibration_text/simple_pendulum",
)
"""Experiments that together have every kind of table."""


TABLES = {
    "best", "checks", "energy", "events", "exact", "members", "orders", "published", "scalars", "scales", "schemes",
    "theory", "work",
}  # fmt: skip
"""How the names of their files begin."""


@pytest.mark.slow
@pytest.mark.usefixtures("unrendered")
def test_the_tables_of_pages_compile(tmp_path: Path) -> None:

    for word in SHIPPED:
        exp = Experiment.from_yaml(CONFIGS / f"{word}.yaml")
        record = samples.record(exp)
        report.write(samples.plan(exp), record, samples.summary(exp, record), tmp_path / word)
    files = sorted(tmp_path.glob("*/*/tables/*.tex"))
    names = {path.stem.partition("_")[0] for path in files}
    assert names >= TABLES
    # so many floats wait for no page
    body = "\n".join(f"\\input{{{path.relative_to(tmp_path)}}}\\clearpage" for path in files)
    compiled(tmp_path, body)
