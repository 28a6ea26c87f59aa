#!/bin/sh
# Make the pictures of docs/exercises.md: figures of the experiments that answer the notes. Run it from the root of the
# repository.
set -eu
results=$(mktemp -d)
trap 'rm -rf "$results"' EXIT
.venv/bin/vibsim run damped_frequency two_time_steps general_problem_solvers washing_machine_over_speed -q --results "$results"
text="$results/vibration_text"
cp "$text/damped_frequency/figures/local_frequency.svg" docs/images/exercises-frequency.svg
cp "$text/two_time_steps/figures/motion_u_0_central.svg" docs/images/exercises-two-steps.svg
cp "$text/general_problem_solvers/figures/work_precision_0.svg" docs/images/exercises-solvers.svg
cp "$results/showcase/washing_machine_over_speed/figures/amplitude.svg" docs/images/exercises-resonance.svg
