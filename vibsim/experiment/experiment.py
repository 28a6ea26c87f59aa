"""`Experiment`: the public class, with methods to read an experiment, to derive another one, and to store it as JSON.

Methods import their modules when called: a job, which restores its experiment, needs none of them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

from vibsim.experiment.collection import ADHOC
from vibsim.experiment.data import ExperimentSpec
from vibsim.experiment.schema.checks import as_data, without_kind

if TYPE_CHECKING:
    from vibsim.models import Model
    from vibsim.schemes import Scheme


class Experiment(ExperimentSpec):
    """An experiment. Build it from a file, from the content of a file, or from models and schemes of your own."""

    def __init__(
        self,
        *,
        model: Model | Mapping[str, Any] | str,
        schemes: Sequence[Scheme | Mapping[str, Any] | str],
        parameters: Mapping[str, Any] | None = None,
        title: str = "",
        name: str = "experiment",
        collection: str = ADHOC,
        **sections: Any,
    ) -> None:
        """Build an experiment in memory; it is validated like a file.

        Parameters
        ----------
        model
            A model, the name of a registered one, or the content of a section ``model``, whose ``kind`` may be a model.
        schemes
            A list of schemes, each given in the same way.
        parameters
            Further content of the section ``model``: parameters that differ from their default.
        title
            A line for pages and messages.
        sections
            The other sections of a file by name: ``initial``, ``time``, ``levels``, ``sweep``, ``checks``, ...

        Raises
        ------
        InputError
            With all faults.
        """
        from vibsim.experiment.reading import from_objects

        section = dict(model) if isinstance(model, Mapping) else {"kind": model}
        content = {
            "title": title or "An experiment in memory",
            "model": {**section, **(parameters or {})},
            "schemes": schemes,
            **sections,
        }
        self.__setstate__(from_objects(content, name, collection).__getstate__())

    @classmethod
    def made_of(cls, spec: ExperimentSpec) -> Self:
        """Return an experiment of this class with the content of `spec`, which is already validated."""
        experiment = cls.__new__(cls)
        experiment.__setstate__(spec.__getstate__())
        return experiment

    @classmethod
    def from_yaml(
        cls,
        path: str | Path,
        *,
        collection: str | None = None,
        configs: Path | None = None,
        settings: Sequence[str] = (),
    ) -> Self:
        """Read an experiment file, whose name without the ending is the name of the experiment.

        Parameters
        ----------
        path
            A YAML file.
        collection
            Name of the collection; by default the result of `vibsim.experiment.collection.collection_of`.
        configs
            The folder of collections; by default that of vibsim.
        settings
            Overrides of values of the file, each as ``KEY=VALUE`` with a dotted key and a value in YAML:
            ``model.g=1.62``, ``schemes[0].start=first_order``.

        Raises
        ------
        InputError
            With all faults of the file.
        """
        from vibsim.experiment.reading import from_file

        return cls.made_of(from_file(Path(path), collection, configs, settings))

    @classmethod
    def from_dict(
        cls, data: Mapping[str, Any], *, name: str = "experiment", collection: str = ADHOC
    ) -> Self:
        """Build an experiment from the content of a file; raise `InputError` with all its faults."""
        from vibsim.experiment.reading import from_content

        return cls.made_of(from_content(data, name, collection))

    def alone(self, case: int) -> Self:
        """Return the experiment of one member, without a sweep; see `vibsim.experiment.derived.alone`."""
        from vibsim.experiment.derived import alone

        return alone(self, case)

    def with_levels(self, levels: Sequence[int]) -> Self:
        """Return the experiment with `levels` chosen for its tolerance; see `vibsim.experiment.derived.with_levels`."""
        from vibsim.experiment.derived import with_levels

        return with_levels(self, levels)


def canonical(experiment: Experiment) -> dict[str, Any]:
    """Return `experiment` as JSON data, which is the same for files with the same meaning.

    Sections are separate, so that a digest can cover those that a job uses: ``collection``, ``name``, ``title``,
    ``source``, ``model``, ``initial``, ``time``, ``levels``, ``schemes``, ``sweep``, ``samples``, ``output``,
    ``tolerance``, ``checks``, and, if present, ``follow``, ``published``, ``figures``, ``units`` and ``scaling``.
    """
    data = experiment.model_dump(mode="json", exclude={"checks"})
    sweep = data["sweep"]
    data["sweep"] = sweep and sweep["axes"]
    if sweep and sweep["follow"]:
        data["follow"] = sweep["follow"]
    data["checks"] = [as_data(check) for check in experiment.checks]
    for name in ("published", "figures", "units", "scaling"):
        if not getattr(experiment, name):
            del data[name]
    for name in ("tables", "structure"):
        if not getattr(experiment.model, name):
            del data["model"][name]
    return data


def restore(
    content: Mapping[str, Any], file: Path | None = None, settings: tuple[str, ...] = ()
) -> Experiment:
    """Return the experiment described by `content`, a result of `canonical`.

    `file` is the file from which it was read, if known, and `settings` are the overrides of the command line.

    Raises
    ------
    InputError
        If a table cannot be read, or its numbers have changed.
    """
    data = dict(content)
    follow = data.pop("follow", None)
    data["sweep"] = data["sweep"] and {"axes": data["sweep"], "follow": follow}
    data["checks"] = [without_kind(check) for check in data["checks"]]
    experiment = Experiment.made_of(ExperimentSpec.model_validate(data))
    experiment._file, experiment._settings = file, settings
    if experiment.model.tables:
        from vibsim.experiment.tables.file import attach

        attach(experiment)
    if experiment.model.structure is not None:
        from vibsim.experiment.tables.structure import attach as attach_structure

        attach_structure(experiment)
    return experiment
