"""Validate the content of a file value by value into a `Document`: report faulty values and leave them out.

The annotations of the schema classes define what is valid. A mapping that a `Section` class describes is read key by
key, a list of such mappings entry by entry. Pydantic validates every other value, once.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache, cached_property
from types import NoneType, UnionType
from typing import Annotated, Any, Union, get_args, get_origin

from pydantic import Discriminator, Tag, TypeAdapter, ValidationError

from vibsim.experiment.faults import MISSING, Report
from vibsim.experiment.schema.document import OF_KIND, Document, section_of_kind
from vibsim.experiment.schema.fields import STAND_IN, Section
from vibsim.experiment.units import Units
from vibsim.experiment.yaml.parse import Path_

_FAULTY: Any = object()  # marks a value that is left out


def read_document(report: Report, kind: type[Section] = Document) -> Any:
    """Return the content of the file of `report`, and report the faults of its values.

    Another `kind` than `Document` has no units. Faulty values are left out. A faulty required section is None, and so
    is a faulty entry of `schemes`, `checks` and `published`. Checks and the sweep keep their valid values
    (`Section.stand_ins`).
    """
    fields = kind.model_fields
    # an empty optional section counts as missing
    optional = {key for key, field in fields.items() if not field.is_required()}
    data = {k: v for k, v in report.source.data.items() if v is not None or k not in optional}
    if kind is not Document:
        return _Reader(report, None).section((), data, kind)
    units = Units(data, report)
    if isinstance(data.get("units"), dict):
        data["units"] = units.defined
    return _Reader(report, units).section((), data, Document)


def read_value(path: Path_, raw: Any, annotation: Any, report: Report) -> Any:
    """Return a validated value that comes from no file; report its faults and return None if it has any."""
    value = _Reader(report, None).value(path, raw, _Expected(annotation), keep_valid=False)
    return None if value is _FAULTY else value


class _Reader:
    def __init__(self, report: Report, units: Units | None) -> None:
        self.report, self.units = report, units

    def section(self, path: Path_, raw: Mapping[str, Any], kind: type[Section]) -> Any:
        """Return a mapping validated as a section of class `kind`."""
        content, broken_rule = kind.normal(raw)
        if broken_rule:
            self.report.add_malformed(path, broken_rule, value=raw)
        fields, extra = _fields(kind)
        values: dict[str, Any] = {}
        is_sound = True
        for key, value in content.items():
            expected = fields[key][0] if key in fields else extra
            if expected is None:
                self.report.add_unknown_key((*path, key), value, list(fields))
                is_sound = False
                continue
            valid = self.value((*path, key), value, expected, kind.stand_ins is not None)
            if valid is _FAULTY:
                is_sound = False
            else:
                values[key] = valid
        for key in (key for key, (_, is_required) in fields.items() if is_required):
            if key not in content:
                self.report.add_malformed((*path, key), MISSING)
            if key not in values:
                values[key] = (kind.stand_ins or {}).get(key, _FAULTY)
                is_sound = False
        if _FAULTY in values.values() or (kind.stand_ins is None and not is_sound):
            return _FAULTY
        return kind.model_construct(**values)

    def value(self, path: Path_, raw: Any, expected: _Expected, keep_valid: bool) -> Any:
        """Return a validated value; `keep_valid`: keep the valid entries of a list or mapping that has faulty ones."""
        if path in self.report.faulty:
            return _FAULTY
        expected = expected.member_for(raw)
        if expected.is_of_kind:
            if path[0] == "schemes" and isinstance(raw, str):
                return raw
            if section := section_of_kind(path[0], raw, self.report.kinds):
                return self.section(path, raw, section)
            self.report.add_kind(path, raw)
            return _FAULTY
        if expected.section is not None and isinstance(raw, Mapping):
            return self.section(path, raw, expected.section)
        if expected.entries is None or (raw is None and expected.is_optional):
            return self.single(path, raw, expected, keep_valid)
        if self.single(path, raw, expected.container, False) is _FAULTY:
            return _FAULTY
        if not isinstance(raw, Mapping):
            items = (self.value((*path, i), x, expected.entries, True) for i, x in enumerate(raw))
            return tuple(None if item is _FAULTY else item for item in items)
        valid = {key: self.value((*path, key), x, expected.entries, True) for key, x in raw.items()}
        return {key: item for key, item in valid.items() if item is not _FAULTY} or _FAULTY

    def single(self, path: Path_, raw: Any, expected: _Expected, keep_valid: bool) -> Any:
        """Return a validated value that neither is a section nor contains one."""
        raw, refused = self._as_printed(path, raw), set[str | int]()
        if self.units is not None:
            raw, refused = self.units.plain(path, raw)
        if path in self.report.faulty:
            return _FAULTY
        try:
            value = expected.validator.validate_python(raw)
        except ValidationError as error:
            places = self.report.add_invalid(error, path)
            refused |= {place[len(path)] for place in places if len(place) > len(path)}
        else:
            if not refused:
                return value
        if not (keep_valid and refused):
            return _FAULTY
        valid: Any = [STAND_IN if i in refused else value for i, value in enumerate(raw)]
        if isinstance(raw, Mapping):
            valid = {key: value for key, value in raw.items() if key not in refused}
        try:
            return expected.validator.validate_python(valid)
        except ValidationError:
            return _FAULTY

    def _as_printed(self, path: Path_, raw: Any) -> Any:
        """Return a number of a printed table as text, since its digits matter, and any other value unchanged."""
        is_number = isinstance(raw, int | float) and not isinstance(raw, bool)
        is_printed = is_number and path[0] == "published" and path[-1] == "printed"
        place = self.report.source.place(path) if is_printed else None
        return place.text if place else raw


class _Expected:
    """The type expected of a value: an annotation, parsed once."""

    def __init__(self, annotation: Any) -> None:
        self.annotation = annotation
        self.is_optional = False
        bare, metadata = annotation, tuple[Any, ...]()
        while True:
            origin: Any = get_origin(bare)
            arguments = get_args(bare)
            if origin is Annotated:
                bare, metadata = arguments[0], arguments[1:]
            elif origin in (Union, UnionType) and NoneType in arguments and len(arguments) == 2:
                self.is_optional = True
                bare = next(part for part in arguments if part is not NoneType)
            else:
                break
        self.section: Any = bare if _is_section(bare) else None
        """The `Section` class, if the value is a mapping described by one."""
        discriminator: Any = next((m for m in metadata if isinstance(m, Discriminator)), None)
        self.is_of_kind = any(m is OF_KIND for m in metadata)
        self.tag_for = discriminator.discriminator if discriminator else None
        members = arguments if discriminator else ()
        tagged = ((member, tag) for member in members for tag in member.__metadata__)
        self.members = {tag.tag: _Expected(m) for m, tag in tagged if isinstance(tag, Tag)}
        """The types of a tagged union, by tag."""
        self.entries: _Expected | None = None
        """The type of the entries, if a list of sections, or a mapping with arbitrary keys to sections, is expected."""
        if origin in (tuple, dict) and any(map(_names_section, arguments)):
            self.entries = _Expected(arguments[0 if origin is tuple else 1])
            container: Any = tuple[Any, ...] if origin is tuple else dict[str, Any]
            self.container = _Expected(Annotated[(container, *metadata)] if metadata else container)

    @cached_property
    def validator(self) -> TypeAdapter[Any]:
        """The pydantic validator, made on first use because a file uses few of them."""
        return _adapter_of(self.annotation)

    def member_for(self, raw: Any) -> _Expected:
        """Return the union member whose tag `raw` has; the union itself if there is none."""
        if self.tag_for is None or (raw is None and self.is_optional):
            return self
        member = self.members.get(self.tag_for(raw))
        return member.member_for(raw) if member else self


_adapter_of = cache(TypeAdapter)


@cache
def _fields(kind: type[Section]) -> tuple[dict[str, tuple[_Expected, bool]], _Expected | None]:
    """Return the expected type of each key of a section and whether it is required, and the type of all other keys."""
    fields = {
        field.alias or name: (_Expected(field.rebuild_annotation()), field.is_required())
        for name, field in kind.model_fields.items()
    }
    return fields, None if kind.other_values is None else _Expected(kind.other_values)


def _is_section(kind: Any) -> bool:
    return isinstance(kind, type) and issubclass(kind, Section)


def _names_section(annotation: Any) -> bool:
    is_one = annotation is OF_KIND or _is_section(annotation)
    return is_one or any(map(_names_section, get_args(annotation)))
