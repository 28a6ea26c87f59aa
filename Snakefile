# From experiment files to results/index.html. The rules name files and call vibsim; nothing is decided here.
import sys
from pathlib import Path
from shlex import quote

from vibsim.cli.lock import hold
from vibsim.cli.plans import resolve
from vibsim.plan import Names

root = Path(workflow.basedir)
results = config.get("results", root / "results")
names = Names.of(config.get("experiments", []), results, root, resolve)


# Jobs run the vibsim that stands beside this Python, whatever else is installed.
shell.prefix(f"export PATH={quote(str(Path(sys.executable).parent))}:$PATH; ")


# Every path below is relative to the results folder, and so are Snakemake's own records.
workdir: str(names.results)


wildcard_constraints:
    experiment=names.experiment_pattern,
    shard=r"\d\d\d\d+",


rule all:
    input:
        "index.html",
        names.files,
        # Of what a job writes, Snakemake misses only what is asked for.
        expand("{name}/{part}", name=list(names.plans), part=["figures", "tables"]),


onstart:
    hold(names.results)


include: "workflow/rules/report.smk"
include: "workflow/rules/analyse.smk"
include: "workflow/rules/extrapolate.smk"
include: "workflow/rules/simulate.smk"
