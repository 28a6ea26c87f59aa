"""The commands other than ``vibsim run`` and the jobs of the workflow, one file each."""
