#!/bin/sh
# Make the pictures of docs/exercises.md: figures of the experiments that answer the exercises and the notes. Run it from
# the root of the repository. `make mutation` makes exercises-faults.svg.
set -eu
results=$(mktemp -d)
trap 'rm -rf "$results"' EXIT
.venv/bin/vibsim run at_the_limit finite_difference_accuracy amplitude_errors resonance sliding_box bouncing_ball simple_pendulum \
    elastic_pendulum elastic_pendulum_drag damped_frequency two_time_steps general_problem_solvers washing_machine_over_speed \
    -q --results "$results"
picture() {
    cp "$results/$1.svg" "docs/images/exercises-$2.svg"
}
text=vibration_text
picture $text/at_the_limit/figures/source_1 highest-frequency
picture $text/finite_difference_accuracy/figures/second_difference second-difference
picture $text/amplitude_errors/figures/extrema_0 amplitudes
picture $text/resonance/figures/source_1_0 oscillator
picture $text/sliding_box/figures/spring springs
picture $text/bouncing_ball/figures/source_1 ball
picture $text/simple_pendulum/figures/source_1_1 pendulum
picture $text/elastic_pendulum/figures/path elastic
picture $text/elastic_pendulum_drag/figures/path drag
picture $text/damped_frequency/figures/local_frequency frequency
picture $text/two_time_steps/figures/motion_u_0_central two-steps
picture $text/general_problem_solvers/figures/work_precision_0 solvers
picture showcase/washing_machine_over_speed/figures/amplitude resonance
