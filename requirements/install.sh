#!/bin/sh
# Make .venv hold what requirements/<set>.txt pins, and vibsim itself; with nothing to do this costs milliseconds.
#
#   sh requirements/install.sh run|dev        (`dev` holds everything that `run` holds)
#
# .venv/vibsim-<set> is written last and holds what that environment was made of: the place of the checkout (the scripts
# of an environment carry absolute paths, so a moved checkout needs a new one), pyproject.toml and the pinned versions. Where it
# is missing or says something else, the environment is not trusted: an interrupted set-up is done again from the start.
set -eu
cd "$(dirname "$0")/.."
chosen=$1
[ -f "requirements/$chosen.txt" ] || { echo "no such set of requirements: $chosen" >&2; exit 2; }

wanted() {
    pwd -P
    cksum pyproject.toml "requirements/$1.txt"
}

is_ready() {
    [ -x .venv/bin/python ] && [ -f ".venv/vibsim-$1" ] && [ "$(cat ".venv/vibsim-$1")" = "$(wanted "$1")" ]
}

find_python() {
    for name in python3.11 python3; do
        if "$name" -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null; then
            echo "$name"
            return
        fi
    done
    echo "vibsim needs CPython 3.11 or newer: neither python3.11 nor such a python3 is on the PATH" >&2
    return 1
}

is_ready "$chosen" && exit 0

# Two makes at once would install into one environment; the lock goes with the process that holds it.
if command -v flock >/dev/null; then
    exec 9<requirements
    flock 9
    is_ready "$chosen" && exit 0
fi

install() {
    .venv/bin/python -m pip install --quiet --disable-pip-version-check --no-input --no-deps "$@"
}

# One pinned package comes as source only; it is built with the pinned setuptools, not with what a build of its own fetches.
install_pinned() {
    install --require-hashes --no-build-isolation --only-binary :all: --no-binary connection-pool -r "requirements/$1.txt"
}

mark_ready() {
    wanted "$1" >".venv/vibsim-$1.new"
    mv ".venv/vibsim-$1.new" ".venv/vibsim-$1"
}

if ! is_ready run; then
    base=$(find_python)
    echo "set-up: making .venv with $("$base" --version)"
    rm -rf .venv
    "$base" -m venv .venv
    echo "set-up: installing what requirements/run.txt pins (about half a minute; longer on a slow line)"
    install --require-hashes --only-binary :all: -r requirements/build.txt
    install_pinned run
    # `compat` is a plain path; the default finder would add 9 ms to the start of every job.
    install --no-build-isolation --config-settings editable_mode=compat --editable .
    mark_ready run
fi
# Adding changes nothing of what is there: interrupted here, the environment still serves a run.
if [ "$chosen" != run ]; then
    echo "set-up: adding what requirements/$chosen.txt pins"
    install_pinned "$chosen"
    mark_ready "$chosen"
fi
echo "set-up: done"
