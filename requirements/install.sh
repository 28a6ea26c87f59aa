#!/bin/sh
# Make .venv hold what requirements/<set>.txt pins, and vibsim itself; with nothing to do this costs milliseconds.
#
#   sh requirements/install.sh run|dev|fuzz   (.venv: `dev` holds everything that `run` holds; `fuzz` adds to either)
#   sh requirements/install.sh lowest         (.venv-lowest: the oldest versions that pyproject.toml allows)
#   sh requirements/install.sh peers          (.venv-peers: other solvers, without vibsim, for bench/run.py alone)
#   sh requirements/install.sh docs           (.venv-docs: Sphinx, which imports vibsim from .venv, for `make docs` alone)
#
# .venv/vibsim-<set> is written last and holds what that environment was made of: the place of the checkout (the scripts
# of an environment carry absolute paths, so a moved checkout needs a new one), pyproject.toml and the pinned versions. Where it
# is missing or says something else, the environment is not trusted: an interrupted set-up is done again from the start.
set -eu
cd "$(dirname "$0")/.."
chosen=$1
[ -f "requirements/$chosen.txt" ] || { echo "no such set of requirements: $chosen" >&2; exit 2; }
case $chosen in
    run | dev | fuzz) environment=.venv base_set=run ;;
    *) environment=.venv-$chosen base_set=$chosen ;;
esac

wanted() {
    pwd -P
    cksum pyproject.toml "requirements/$1.txt"
}

is_ready() {
    [ -x $environment/bin/python ] && [ -f "$environment/vibsim-$1" ] && [ "$(cat "$environment/vibsim-$1")" = "$(wanted "$1")" ]
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
    $environment/bin/python -m pip install --quiet --disable-pip-version-check --no-input --no-deps "$@"
}

# One pinned package comes as source only; it is built with the pinned setuptools, not with what a build of its own fetches.
install_pinned() {
    install --require-hashes --no-build-isolation --only-binary :all: --no-binary connection-pool -r "requirements/$1.txt"
}

mark_ready() {
    wanted "$1" >"$environment/vibsim-$1.new"
    mv "$environment/vibsim-$1.new" "$environment/vibsim-$1"
}

make_environment() {
    base=$(find_python)
    echo "set-up: making $environment with $("$base" --version)"
    rm -rf $environment
    "$base" -m venv $environment
}

# numbalsoda has no wheel for CPython 3.11 and wants a Fortran compiler for solvers that are not compared. Its LSODA is two
# files of C++ and one module of Python, taken from the pinned source.
install_numbalsoda() {
    source=$environment/source
    target=$($environment/bin/python -c 'import sysconfig; print(sysconfig.get_path("purelib"))')/numbalsoda
    mkdir -p $source "$target" &&
        sed -n '/^numbalsoda==/,/[^\\]$/p' requirements/peers.txt >$source/pinned.txt &&
        $environment/bin/python -m pip download --quiet --disable-pip-version-check --no-input --no-deps --require-hashes \
            --no-build-isolation --no-binary :all: --dest $source --requirement $source/pinned.txt &&
        tar -xzf $source/numbalsoda-*.tar.gz -C $source --strip-components 1 &&
        c++ -O3 -DNDEBUG -std=c++11 -fPIC -shared $source/src/LSODA.cpp $source/src/wrapper.cpp -o "$target/liblsoda.so" &&
        cp $source/numbalsoda/driver.py "$target/driver.py" &&
        echo "from .driver import address_as_void_pointer, lsoda, lsoda_sig" >"$target/__init__.py"
}

if [ "$chosen" = peers ]; then
    make_environment
    echo "set-up: installing what requirements/peers.txt pins"
    sed '/^numbalsoda==/,/[^\\]$/d' requirements/peers.txt >$environment/wheels.txt
    install --require-hashes --only-binary :all: -r $environment/wheels.txt
    # the other solvers are measured without it
    install_numbalsoda || echo "numbalsoda could not be built from its source" >&2
    mark_ready peers
    echo "set-up: done"
    exit
fi

if [ "$chosen" = docs ]; then
    make_environment
    echo "set-up: installing what requirements/docs.txt pins"
    install --require-hashes --only-binary :all: -r requirements/docs.txt
    mark_ready docs
    echo "set-up: done"
    exit
fi

if ! is_ready $base_set; then
    make_environment
    echo "set-up: installing what requirements/$base_set.txt pins (about half a minute; longer on a slow line)"
    install --require-hashes --only-binary :all: -r requirements/build.txt
    install_pinned $base_set
    # `compat` is a plain path; the default finder would add 9 ms to the start of every job.
    install --no-build-isolation --config-settings editable_mode=compat --editable .
    # Where the environment keeps Python from writing compiled modules, every job would compile all of vibsim again: 0.15 s.
    $environment/bin/python -m compileall -q vibsim
    mark_ready $base_set
fi
# Adding changes nothing of what is there: interrupted here, the environment still serves a run.
if [ "$chosen" != $base_set ]; then
    echo "set-up: adding what requirements/$chosen.txt pins"
    install_pinned "$chosen"
    mark_ready "$chosen"
fi
echo "set-up: done"
