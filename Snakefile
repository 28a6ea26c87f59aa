# The workflow from experiment files to results/index.html. The rules only name files and call vibsim.
import sys
from pathlib import Path
from shlex import quote

from vibsim.cli.run.lock import hold
from vibsim.cli.workflow import names_of
from vibsim.cli.supervise import children_end_with_this

# Permission to run users' programs comes from the command line alone, never from a file.
names = names_of(config, workflow.config_settings.config)


# Jobs run the vibsim in the environment of this Python, whatever else is on the PATH.
# They replace their shell (`exec`), so that they are children of Snakemake and end with it.
children_end_with_this()
shell.prefix(f"export PATH={quote(str(Path(sys.executable).parent))}:$PATH; ")


# Every path below is relative to the results folder, which also has Snakemake's own records. Jobs change to another
# working directory, so that libraries load no files that came with the results.
workdir: str(names.results)


report: "workflow/report/workflow.rst"


wildcard_constraints:
    experiment=names.experiment_pattern,
    shard=r"\d\d\d\d+",


rule all:
    input:
        "index.html",
        "summary.csv",
        names.files,
        # Listed here, since Snakemake notices only missing targets.
        expand("{name}/{part}", name=list(names.plans), part=["figures", "tables"]),


onstart:
    hold(names.results)


include: "workflow/rules/report.smk"
include: "workflow/rules/analyse.smk"
include: "workflow/rules/extrapolate.smk"
include: "workflow/rules/simulate.smk"
