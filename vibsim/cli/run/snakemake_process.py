"""The Snakemake process of a run: it reports its events to the run, ends with the run, and ends at once on a signal.

Events go through a pipe to the run, one JSON object per line (`LogHandler`, a logger plug-in of Snakemake). Snakemake's
own handler of SIGTERM waits for a lock that the interrupted thread may hold, possibly for ever. To kill it instead
loses nothing, because every file is written in one step.
"""

import json
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from importlib import import_module
from logging import LogRecord
from typing import Any

from snakemake_interface_common.plugin_registry import PluginRegistryBase
from snakemake_interface_executor_plugins.registry import ExecutorPluginRegistry
from snakemake_interface_logger_plugins.base import LogHandlerBase
from snakemake_interface_logger_plugins.common import LogEvent
from snakemake_interface_logger_plugins.registry import LoggerPluginRegistry
from snakemake_interface_logger_plugins.settings import LogHandlerSettingsBase
from snakemake_interface_report_plugins.registry import ReportPluginRegistry

from vibsim.cli import collect_seldom, supervise
from vibsim.cli.run import remote
from vibsim.core.processes import end_with

FIELDS = {
    LogEvent.RUN_INFO: ("stats",),
    LogEvent.PROGRESS: ("done", "total"),
    LogEvent.JOB_INFO: ("rule_name", "output", "log", "reason"),
    LogEvent.JOB_ERROR: ("rule_name", "output", "log", "rule_msg"),
    LogEvent.ERROR: ("exception", "msg"),
}
"""The events that a run follows, with the fields that it reads."""


@dataclass
class LogHandlerSettings(LogHandlerSettingsBase):
    """The option ``--logger-vibsim-pipe`` of Snakemake."""

    pipe: int = field(default=-1, metadata={"help": "descriptor that events are written to"})


class LogHandler(LogHandlerBase):
    """Writes events to the pipe; Snakemake's text output still goes to stderr."""

    writes_to_stream = False
    writes_to_file = False
    has_filter = True
    has_formatter = True
    needs_rulegraph = False
    settings: LogHandlerSettings

    def emit(self, record: LogRecord) -> None:
        """Write the event of a log record if it is one of `FIELDS`."""
        event = getattr(record, "event", None)
        if event in FIELDS:
            content = {"event": event, **{name: getattr(record, name) for name in FIELDS[event]}}
            os.write(self.settings.pipe, f"{json.dumps(content)}\n".encode())


def main() -> None:
    """Run Snakemake. Arguments: the process to end with; ``remote``, ``extended`` or ``here``; those of Snakemake."""
    parent, where = int(sys.argv.pop(1)), sys.argv.pop(1)
    if where == "remote":
        supervise.end_in_order()
    else:
        supervise.end_at_once()
    end_with(parent)
    collect_seldom()
    # Snakemake searches all installed packages five times for plug-ins, and imports them. A local run needs none,
    # but for those that the user may name, which are no executors.
    if where == "remote":
        ExecutorPluginRegistry()
        remote.ask_by_age()
        remote.cancel_all()
        remote.tell_reasons()
        remote.report_submissions()
    elif where == "extended":
        ExecutorPluginRegistry.module_prefix = "none of them"
    else:
        setattr(PluginRegistryBase, "collect_plugins", _collect_none)  # noqa: B010
    # It starts in half the time without modules that no run of vibsim uses: NumPy numbers in profiles, web addresses,
    # Snakemake's reports, and tables as parameters of rules.
    with _absent("numpy", "requests", "snakemake.report"):
        for name in ("smart_open", "yte"):
            import_module(name)
        ReportPluginRegistry()
    with _absent("pandas"):
        from snakemake.cli import main as snakemake

        module = sys.modules[__name__]
        LoggerPluginRegistry().register_plugin("snakemake_logger_plugin_vibsim", module)
        snakemake()


def _collect_none(registry: PluginRegistryBase[Any]) -> None:
    registry.plugins = {}


@contextmanager
def _absent(*names: str) -> Iterator[None]:
    """Within the context, mark modules as not installed, except those already imported."""
    names = tuple(name for name in names if name not in sys.modules)
    sys.modules.update(dict.fromkeys(names))  # type: ignore[arg-type]
    try:
        yield
    finally:
        for name in names:
            del sys.modules[name]


if __name__ == "__main__":
    main()
