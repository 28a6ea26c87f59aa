"""``vibsim judge``: decide whether the results of any solver converge, from a table or from netCDF files."""

from __future__ import annotations

import json
import math
import shutil
import sys
from argparse import Namespace
from collections.abc import Mapping, Sequence
from decimal import Decimal, InvalidOperation
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

from vibsim.cli.jobs.common import check_to_write
from vibsim.core.errors import Fault, InputError, nearest
from vibsim.core.vocabulary import FORMAT, worst
from vibsim.solver import level_tables
from vibsim.solver.level_tables import Study

if TYPE_CHECKING:
    from vibsim.convergence import LadderVerdict

_COMMAND = "vibsim judge"


def judge(options: Namespace) -> int:
    """Judge every quantity, print the verdicts, and write the report if the user requests it."""
    if options.order is not None and options.at_least is not None:
        _refuse("--at-least", f"{options.at_least:g}", "must not be given together with --order")
    if options.report:
        check_to_write("--report", options.report)
    studies = _studies(options)
    exact = _exact(options.exact, [study.quantity for study in studies])
    verdicts = [_judged(study, options, exact.get(study.quantity)) for study in studies]
    content = as_json(verdicts)
    if options.json:
        print(json.dumps(content, indent=1, ensure_ascii=False))
    else:
        print(*_text(verdicts), sep="\n")
    if options.report:
        from vibsim.report.page import study

        study.write(verdicts, [study.files for study in studies], options.report, content)
        if not options.json:
            print(f"report: {options.report / 'report.html'}")
    return 0 if all(verdict.status == "PASS" for verdict in verdicts) else 1


def as_json(verdicts: Sequence[LadderVerdict]) -> dict[str, Any]:
    """Return the verdicts as ``--json`` prints them."""
    return {"vibsim_format": FORMAT, "verdicts": [verdict.to_dict() for verdict in verdicts]}


def _refuse(key: str, value: str, rule: str, hint: str = "") -> NoReturn:
    raise InputError([Fault(_COMMAND, 0, key, value, rule, hint)])


def _studies(options: Namespace) -> list[Study]:
    """Read the results to be judged, from one table or from netCDF files."""
    from vibsim.solver import level_files

    paths: list[Path] = options.files
    quantities = options.quantity or []
    are_netcdf = [level_files.is_netcdf(path) for path in paths]
    if all(are_netcdf):
        return level_files.read(paths, options.h, quantities)
    first = paths[are_netcdf.index(False)]
    if len(paths) > 1:
        rule = "is not a netCDF file, and a table holds all levels itself"
        hint = "name one table, or a netCDF file for each level; an experiment file with `solver: {files: ...}` "
        hint += "takes a CSV file for each level"
        raise InputError([Fault(str(first), 0, "", "", rule, hint)])
    if options.restrict is not None:
        rule = "is for fields in netCDF files; a table holds numbers"
        _refuse("--restrict", options.restrict, rule)
    return level_tables.read(first, options.h.strip(), [name.strip() for name in quantities])


def _exact(entries: Sequence[str] | None, known: Sequence[str]) -> Mapping[str, Decimal]:
    """Return the exact values by quantity, from ``QUANTITY=VALUE``."""
    exact: dict[str, Decimal] = {}
    for entry in entries or ():
        name, has_value, text = entry.rpartition("=")
        name = name.strip()
        if not has_value or not name:
            _refuse("--exact", entry, "must be QUANTITY=VALUE", f"such as {known[0]}=1.5")
        if name not in known:
            _refuse("--exact", name, "is not a judged quantity", nearest(name, list(known)))
        if name in exact:
            _refuse("--exact", name, "is given twice")
        try:
            # a Decimal, since the number of digits shows how far the value may be rounded
            exact[name] = Decimal(text)
        except InvalidOperation:
            exact[name] = Decimal("nan")
        if not exact[name].is_finite() or not math.isfinite(float(exact[name])):
            _refuse("--exact", entry, "its value must be a finite number")
    return exact


def _judged(study: Study, options: Namespace, exact: Decimal | None) -> LadderVerdict:
    from vibsim.convergence.study.judge import verdicts

    try:
        (verdict,) = verdicts(
            study.h,
            study.values,
            quantity=study.quantity,
            order=options.order,
            at_least=options.at_least,
            exact=exact,
            noise=options.noise,
            restrict=options.restrict or "subset",
        )
    except InputError as error:
        # the library names its arguments; add the files that they come from
        more = len(study.files) - 1
        file = f"{study.files[0]} and {more} more" if more else study.files[0]
        faults = (
            Fault(file, 0, f"{study.quantity}: {fault.key}", fault.value, fault.rule, fault.hint)
            for fault in error.faults
        )
        raise InputError(faults) from None
    return verdict


def _text(verdicts: Sequence[LadderVerdict]) -> list[str]:
    from vibsim.convergence.study.terminal import COLUMNS, as_text

    columns = shutil.get_terminal_size().columns if sys.stdout.isatty() else COLUMNS
    lines = [f"{as_text(verdict, columns)}\n" for verdict in verdicts]
    statuses = [verdict.status for verdict in verdicts]
    total = "1 quantity" if len(verdicts) == 1 else f"{len(verdicts)} quantities"
    lines.append(f"{total}, {statuses.count('PASS')} passed: {worst(statuses)}")
    return lines
