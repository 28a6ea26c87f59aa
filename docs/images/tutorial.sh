#!/bin/sh
# Make the pictures of the tutorial from the results of its own files. Run it from the root of the repository.
set -eu
results=$(mktemp -d)
trap 'rm -rf "$results"' EXIT
for name in my_pendulum sweep; do
    sed "1,/to \`$name.yaml\`/d" docs/tutorial.md | sed '1,/^```yaml$/d; /^```$/,$d' >"$results/$name.yaml"
done
.venv/bin/vibsim run "$results/my_pendulum.yaml" --set 'schemes[0].start=first_order' -q --results "$results" || [ $? = 1 ]
.venv/bin/vibsim run "$results/sweep.yaml" -q --results "$results"
cp "$results/adhoc/my_pendulum/figures/hero_differences.svg" docs/images/tutorial-trap.svg
cp "$results/adhoc/sweep/figures/sweep_error_theta.svg" docs/images/tutorial-sweep.svg
