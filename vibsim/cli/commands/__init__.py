"""The commands beside ``vibsim run`` and the jobs of the workflow, a file each."""
