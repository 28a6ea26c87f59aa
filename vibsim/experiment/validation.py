"""From the content of a file to a `Document`, value by value: what is faulty is noted and left out, the rest is kept.

The annotations of the classes of the schema say what may stand where. A mapping that one of them describes is read key
by key, a list of such mappings entry by entry; pydantic validates every other value, once.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache, cached_property
from types import NoneType, UnionType
from typing import Annotated, Any, Union, get_args, get_origin

from pydantic import Discriminator, Tag, TypeAdapter, ValidationError

from vibsim.experiment.faults import MISSING, Report
from vibsim.experiment.schema.document import Document, OneOf
from vibsim.experiment.schema.fields import STAND_IN, Section
from vibsim.experiment.units import Units
from vibsim.experiment.yaml.parse import Path_

_FAULTY: Any = object()
"""In place of a value that is left out."""


def read_document(report: Report, kind: type[Section] = Document) -> Any:
    """Return the content of the file that `report` speaks of, and note the faults of its values.

    Returns
    -------
    Document
        Or another `kind`, in which no number has a unit. It is without what is faulty. A section that cannot be left
        out is then None, and so is an entry of `schemes`, `checks` and `published`; of a check and of a sweep, what
        has no fault is kept (`Section.stand_ins`).
    """
    fields = kind.model_fields
    # a section without content is one that is left out, where it may be
    optional = {key for key, field in fields.items() if not field.is_required()}
    data = {k: v for k, v in report.source.data.items() if v is not None or k not in optional}
    if kind is not Document:
        return _Reader(report, None).section((), data, kind)
    units = Units(data, report)
    if isinstance(data.get("units"), dict):
        data["units"] = units.defined
    return _Reader(report, units).section((), data, Document)


def read_value(path: Path_, written: Any, annotation: Any, report: Report) -> Any:
    """Return a value that stands in no file, and note its faults; None where it has any."""
    reader = _Reader(report, Units({}, report))
    found = reader.value(path, written, _Form(annotation), keeps_rest=False)
    return None if found is _FAULTY else found


class _Reader:
    def __init__(self, report: Report, units: Units | None) -> None:
        self.report, self.units = report, units

    def section(self, path: Path_, written: Mapping[str, Any], kind: type[Section]) -> Any:
        """Return the section of a `kind` that a mapping describes."""
        given, broken_rule = kind.normal(written)
        if broken_rule:
            self.report.add_malformed(path, broken_rule, value=written)
        fields, others = _fields(kind), _others(kind)
        found: dict[str, Any] = {}
        is_sound = True
        for key, value in given.items():
            form = fields[key][0] if key in fields else others
            if form is None:
                self.report.add_unknown_key((*path, key), value, list(fields))
                is_sound = False
                continue
            part = self.value((*path, key), value, form, kind.stand_ins is not None)
            if part is _FAULTY:
                is_sound = False
            else:
                found[key] = part
        for key in (key for key, (_, is_required) in fields.items() if is_required):
            if key not in given:
                self.report.add_malformed((*path, key), MISSING)
            if key not in found:
                found[key] = (kind.stand_ins or {}).get(key, _FAULTY)
                is_sound = False
        if _FAULTY in found.values() or (kind.stand_ins is None and not is_sound):
            return _FAULTY
        return kind.model_construct(**found)

    def value(self, path: Path_, written: Any, form: _Form, keeps_rest: bool) -> Any:
        """Return a value of a `form`; `keeps_rest`: of a list or a mapping with faulty entries the others are kept."""
        if path in self.report.faulty:
            return _FAULTY
        form = form.of(written)
        if form.one_of and (made := form.one_of.section_of(written, self.report.kinds)):
            form = _form_of(made)
        if form.section is not None and isinstance(written, Mapping):
            return self.section(path, written, form.section)
        if form.entries is None or (written is None and form.is_optional):
            return self.single(path, written, form, keeps_rest)
        if self.single(path, written, form.shell, False) is _FAULTY:
            return _FAULTY
        if not isinstance(written, Mapping):
            items = (self.value((*path, i), x, form.entries, True) for i, x in enumerate(written))
            return tuple(None if item is _FAULTY else item for item in items)
        parts = {key: self.value((*path, key), x, form.entries, True) for key, x in written.items()}
        return {key: part for key, part in parts.items() if part is not _FAULTY} or _FAULTY

    def single(self, path: Path_, written: Any, form: _Form, keeps_rest: bool) -> Any:
        """Return a value that is no section and holds none."""
        written, refused = self._as_printed(path, written), set[str | int]()
        if self.units is not None:
            written, refused = self.units.plain(path, written)
        if path in self.report.faulty:
            return _FAULTY
        try:
            found = form.validator.validate_python(written)
        except ValidationError as error:
            places = self.report.add_invalid(error, path)
            refused |= {place[len(path)] for place in places if len(place) > len(path)}
        else:
            if not refused:
                return found
        if not (keeps_rest and refused):
            return _FAULTY
        rest: Any = [STAND_IN if i in refused else value for i, value in enumerate(written)]
        if isinstance(written, Mapping):
            rest = {key: value for key, value in written.items() if key not in refused}
        try:
            return form.validator.validate_python(rest)
        except ValidationError:
            return _FAULTY

    def _as_printed(self, path: Path_, written: Any) -> Any:
        """Return a number of a printed table as text: its digits count, not its value."""
        is_number = isinstance(written, int | float) and not isinstance(written, bool)
        is_printed = is_number and path[0] == "published" and path[-1] == "printed"
        place = self.report.source.place(path) if is_printed else None
        return place.text if place else written


class _Form:
    """What may stand in a place: an annotation, taken apart once."""

    def __init__(self, annotation: Any) -> None:
        self.annotation = annotation
        self.is_optional = False
        bare, metadata = annotation, tuple[Any, ...]()
        while True:
            origin: Any = get_origin(bare)
            parts = get_args(bare)
            if origin is Annotated:
                bare, metadata = parts[0], parts[1:]
            elif origin in (Union, UnionType) and NoneType in parts and len(parts) == 2:
                self.is_optional = True
                bare = next(part for part in parts if part is not NoneType)
            else:
                break
        self.section: Any = bare if _is_section(bare) else None
        """The class of the mapping that may stand there."""
        which: Any = next((m for m in metadata if isinstance(m, Discriminator)), None)
        self.one_of = next((m for m in metadata if isinstance(m, OneOf)), None)
        self.tag_of = which.discriminator if which else None
        marked = ((m, mark) for m in (parts if which else ()) for mark in m.__metadata__)
        self.members = {mark.tag: _Form(m) for m, mark in marked if isinstance(mark, Tag)}
        """Of a union."""
        self.entries: _Form | None = None
        """Of a list, or of a mapping with any keys, of sections."""
        if origin in (tuple, dict) and any(map(_names_section, parts)):
            self.entries = _Form(parts[0 if origin is tuple else 1])
            shell: Any = tuple[Any, ...] if origin is tuple else dict[str, Any]
            self.shell = _Form(Annotated[(shell, *metadata)] if metadata else shell)

    @cached_property
    def validator(self) -> TypeAdapter[Any]:
        """Made on first use: most of what may be written is not."""
        return _adapter_of(self.annotation)

    def of(self, written: Any) -> _Form:
        """Return what of a union describes what is written; the union itself where nothing does."""
        if self.tag_of is None or (written is None and self.is_optional):
            return self
        member = self.members.get(self.tag_of(written))
        return member.of(written) if member else self


_form_of = cache(_Form)
_adapter_of = cache(TypeAdapter)


@cache
def _fields(kind: type[Section]) -> dict[str, tuple[_Form, bool]]:
    """Return what may stand under each key of a section, and whether it must."""
    return {
        field.alias or name: (_Form(field.rebuild_annotation()), field.is_required())
        for name, field in kind.model_fields.items()
    }


@cache
def _others(kind: type[Section]) -> _Form | None:
    """Return what may stand under further keys of a section; None where it has none."""
    return None if kind.other_values is None else _Form(kind.other_values)


def _is_section(kind: Any) -> bool:
    return isinstance(kind, type) and issubclass(kind, Section)


def _names_section(annotation: Any) -> bool:
    return _is_section(annotation) or any(map(_names_section, get_args(annotation)))
