#!/usr/bin/env bash
# Install everything the project needs: Debian's packages, then the environment .venv.
#
#     setup/install.sh [--no-dev] [--mpi]        --no-dev: without the tools for tests and checks
#                                                --mpi: with LAMMPS and Open MPI, for engine: lammps
#
# A second call finds everything in place and does nothing. Traps and reasons: environment.md.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
exec 9<setup/install.sh && flock 9 # two calls at once: the second waits

fail() {
    echo "setup: $*" >&2
    exit 1
}

install_debian_packages() {
    command -v dpkg-query >/dev/null || fail "this is not Debian; see environment.md, 'Other systems'"
    local package missing=() lists=(setup/debian-packages.txt)
    [ -n "$no_dev" ] || lists+=(setup/debian-packages-dev.txt)
    [ -z "$mpi" ] || lists+=(setup/debian-packages-mpi.txt)
    for package in $(sed 's/#.*//' "${lists[@]}"); do
        case $(dpkg-query -W -f='${db:Status-Status}' "$package" 2>/dev/null) in
        installed*) ;;
        *) missing+=("$package") ;;
        esac
    done
    [ ${#missing[@]} -gt 0 ] || return 0

    local as_root=()
    if [ "$(id -u)" -ne 0 ]; then
        command -v sudo >/dev/null ||
            fail "missing Debian packages, and neither root nor sudo to install them:" \
                "${missing[*]}; see environment.md, 'Without root'"
        as_root=(sudo)
    fi
    echo "setup: installing Debian packages (minutes): ${missing[*]}"
    local apt=("${as_root[@]}" env DEBIAN_FRONTEND=noninteractive
        apt-get -qq -o DPkg::Lock::Timeout=600 -o Dpkg::Use-Pty=0)
    local install=("${apt[@]}" install --yes --no-install-recommends "${missing[@]}")
    # Fresh lists only if there are none, or if the present ones lead to packages that are gone.
    apt-cache show "${missing[@]}" >/dev/null 2>&1 || "${apt[@]}" update
    local log
    log=$(mktemp)
    "${install[@]}" >"$log" 2>&1 || { "${apt[@]}" update && "${install[@]}" >"$log" 2>&1; } || {
        cat "$log" >&2
        fail "apt-get could not install: ${missing[*]}; see environment.md, 'Other systems'"
    }
    rm -f "$log"
}

install_environment() {
    local requirements=(-r requirements.txt) key
    [ -n "$no_dev" ] || requirements+=(-r requirements-dev.txt)
    key=$(pwd && /usr/bin/python3 --version && echo "${requirements[*]}" &&
        sha256sum setup/install.sh requirements.txt requirements-dev.txt pyproject.toml)
    [ "$key" != "$(cat .venv/installed 2>/dev/null)" ] || return 0

    echo "setup: installing Python packages into .venv (a minute)"
    # An environment cannot be moved: one that was made elsewhere is made anew.
    grep -qs -- " $(pwd)/.venv\$" .venv/pyvenv.cfg || rm -rf .venv
    rm -f .venv/installed
    /usr/bin/python3 -m venv --system-site-packages .venv
    local pip=(.venv/bin/python -m pip -qq --disable-pip-version-check --no-input)
    "${pip[@]}" install "${requirements[@]}"
    # Python asks a finder, the usual mode, only after the working directory, where this clone may be a folder smarticles.
    "${pip[@]}" install --no-deps --no-build-isolation --config-settings editable_mode=compat --editable .
    # Keeps Debian's mpl_toolkits from taking the place of the environment's.
    local packages
    packages=$(.venv/bin/python -c 'import sysconfig; print(sysconfig.get_path("purelib"))')
    echo "import mpl_toolkits" >"$packages/mpl_toolkits.pth"
    echo "$key" >.venv/installed
    echo "setup: done; '.venv/bin/smarticles doctor' shows what works"
}

no_dev='' mpi=''
for option in "$@"; do
    case $option in
    --no-dev) no_dev=yes ;;
    --mpi) mpi=yes ;;
    *) fail "unknown option $option; there are --no-dev and --mpi" ;;
    esac
done
install_debian_packages
install_environment
