"""`Experiment`: an experiment with the ways to read one, to make another one of it, and to store it as JSON.

The modules behind the ways are imported when they are taken: a job, which restores its experiment, needs none of them.
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
    """One experiment. Build it from a file, from what a file would hold, or from models and schemes of your own."""

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
        """Build an experiment in memory; everything is checked as in a file.

        Parameters
        ----------
        model
            A model, the name of a registered one, or what a file has under ``model``, whose ``kind`` may be a model.
        schemes
            A list of schemes, each likewise.
        parameters
            What a file has under ``model`` beside ``kind``: parameters that are not to have their default.
        title
            A line for pages and messages.
        sections
            The other sections of a file by their names: ``initial``, ``time``, ``levels``, ``sweep``, ``checks``, ...

        Raises
        ------
        InputError
            With every fault.
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
        """Return the experiment of this class with all that `spec` holds, which is checked already."""
        made = cls.__new__(cls)
        made.__setstate__(spec.__getstate__())
        return made

    @classmethod
    def from_yaml(
        cls,
        path: str | Path,
        *,
        collection: str | None = None,
        configs: Path | None = None,
        settings: Sequence[str] = (),
    ) -> Self:
        """Read an experiment file, whose name without the ending is the experiment's.

        Parameters
        ----------
        path
            A YAML file.
        collection
            Name of the collection; by default that of `vibsim.experiment.collection.collection_of`.
        configs
            The folder of collections; by default that of the checkout.
        settings
            Values in place of those of the file, each as ``KEY=VALUE`` with a dotted key and YAML behind it:
            ``model.g=1.62``, ``schemes[0].start=first_order``.

        Raises
        ------
        InputError
            With every fault of the file.
        """
        from vibsim.experiment.reading import from_file

        return cls.made_of(from_file(Path(path), collection, configs, settings))

    @classmethod
    def from_dict(
        cls, data: Mapping[str, Any], *, name: str = "experiment", collection: str = ADHOC
    ) -> Self:
        """Build an experiment from what a file would hold; InputError with every fault of it."""
        from vibsim.experiment.reading import from_content

        return cls.made_of(from_content(data, name, collection))

    def alone(self, case: int) -> Self:
        """Return the experiment of one member, without a sweep; see `vibsim.experiment.derived`."""
        from vibsim.experiment.derived import alone

        return alone(self, case)

    def with_levels(self, levels: Sequence[int]) -> Self:
        """Return the experiment with the `levels` chosen by its tolerance; see `vibsim.experiment.derived`."""
        from vibsim.experiment.derived import with_levels

        return with_levels(self, levels)


def canonical(experiment: Experiment) -> dict[str, Any]:
    """Return `experiment` as JSON-able data: the same for files that mean the same.

    The sections stand apart, so that a digest can take those that a job uses: ``collection``, ``name``, ``title``,
    ``source``, ``model``, ``initial``, ``time``, ``levels``, ``schemes``, ``sweep``, ``samples``, ``output``,
    ``tolerance``, ``checks``, and ``follow``, ``published``, ``figures``, ``units`` and ``scaling`` where there is any.
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
    """Return the experiment that `content`, made by `canonical`, describes.

    `file` is where it was read, if known, and `settings` are what a command line gave in place of its values.

    Raises
    ------
    InputError
        Where a table of it cannot be read, or has other numbers than it had.
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
