#!/bin/sh
# The driver, from a public snapshot of projectchrono/chrono: build.sh CHRONO.git FOLDER
#
# CHRONO.git is a clone's git directory (measured: 7689fbc, 2026-08-19); FOLDER takes sources, objects and `driver`.
# Debian packages: g++, cmake, ninja-build, libeigen3-dev. Called again it goes on where it was. About half an hour on
# one core.
set -eu
here=$(cd "$(dirname "$0")" && pwd)
git_dir=$(cd "$1" && pwd)
mkdir -p "$2"
cd "$2"
if [ ! -e build/build.ninja ]; then
    mkdir -p source
    git --git-dir="$git_dir" archive HEAD src/chrono src/chrono_thirdparty cmake CMakeLists.txt src/CMakeLists.txt \
        src/ChConfig.h.in src/ChVersion.h.in | tar -x -C source
    mkdir -p source/data source/template_project source/contrib
    # The core alone.
    sed -i '/^ *add_subdirectory(chrono_[a-z]/d' source/src/CMakeLists.txt
    sed -i 's/^include(CPack)/#&/' source/CMakeLists.txt
    cmake -G Ninja -S source -B build -DCMAKE_BUILD_TYPE=Release -DBUILD_DEMOS=OFF -DBUILD_TESTING=OFF \
        -DBUILD_BENCHMARKING=OFF -DCH_ENABLE_MODULE_FEA=OFF -DCH_ENABLE_YAML=OFF -DCMAKE_DISABLE_FIND_PACKAGE_MPI=ON
fi
nice -n 5 ninja -C build -j "${JOBS:-1}" Chrono_core
rm -f libchrono.a
find build -name '*.o' -path '*Chrono_core*' -exec ar rcs libchrono.a {} +
g++ -O3 -march=native -std=c++17 -fopenmp -DEIGEN_DONT_PARALLELIZE -DNDEBUG -DBP_USE_FIXEDPOINT_INT_32 \
    -DBT_THREADSAFE -DBT_USE_OPENMP -Isource/src -Isource/src/chrono -Isource/src/chrono_thirdparty \
    -Isource/src/chrono/collision/bullet -Ibuild -Ibuild/src -I/usr/include/eigen3 \
    "$here/driver.cpp" libchrono.a -o driver
