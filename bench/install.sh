# What bench/run and bench/scale share; they source it in the root of the repository.

step() { printf '\n== %s\n' "$*" >&2; }

install_packages() {
    local missing=() package
    for package in "$@"; do
        dpkg-query -W -f '${Status}' "$package" 2>/dev/null | grep -q 'ok installed' || missing+=("$package")
    done
    ((${#missing[@]})) || return 0
    step "installing ${missing[*]}"
    apt-get update -q >&2
    DEBIAN_FRONTEND=noninteractive apt-get install -y -q --no-install-recommends "${missing[@]}" >&2
}

install_requirements() { # install_requirements FILE: unless this very file is installed already
    cmp -s "$1" "bench/.venv/$(basename "$1")" && return
    step "installing $1"
    bench/.venv/bin/pip install -q --disable-pip-version-check --only-binary=:all: -r "$1" >&2
    cp "$1" bench/.venv/
}

build_peer() { # build_peer NAME FLAG...: bench/peers/NAME.cpp, unless it is built already
    local name=$1
    shift
    mkdir -p bench/.build
    [[ "bench/peers/$name.cpp" -nt "bench/.build/$name" ]] || return 0
    step "building $name"
    g++ -std=c++17 -O3 -march=native -DNDEBUG -I/usr/include/eigen3 "bench/peers/$name.cpp" -o "bench/.build/$name" "$@" >&2
}

# A peer must choose its instruction set and threads by itself: variables that hold it back would flatter us.
unset "${!OPENBLAS_@}" "${!OMP_@}" "${!MKL_@}" "${!RAYON_@}" "${!GRAMIAN_@}" RUST_LOG
