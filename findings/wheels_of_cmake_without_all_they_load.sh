#!/usr/bin/env bash
# ROS 2 Kilted as wheels: pip installs ament_cmake and finds no broken requirement, and no CMake project can find it.
#
# ros-kilted-ament-cmake 2.7.3 brings 15 wheels. CMake's find_package(ament_cmake) loads ament_cmake_core, which executes Python
# with `import ament_package`: that wheel is required by none of them. With ros-ament-package 0.17.2 the next one is missing,
# ament_cmake_include_directories, which ament_cmake_target_dependencies loads. Both exist as wheels of their own; with both a
# package is configured. Who builds messages on these wheels lists the two himself: `pip check` says nothing of them.
#
# Needs cmake. Exit status 0 while the output is the one below.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf -- "$folder"' EXIT
python3 -m venv "$folder/venv"
mkdir "$folder/nothing"
cat >"$folder/nothing/CMakeLists.txt" <<'CMAKE'
cmake_minimum_required(VERSION 3.8)
project(nothing NONE)
find_package(ament_cmake REQUIRED)
ament_package()
CMAKE
cat >"$folder/nothing/package.xml" <<'XML'
<package format="3">
  <name>nothing</name>
  <version>0.0.0</version>
  <description>A package without anything in it</description>
  <maintainer email="somebody@example.com">Somebody</maintainer>
  <license>MIT</license>
</package>
XML

install() {
    "$folder/venv/bin/pip" install --quiet --disable-pip-version-check "$@"
    printf '%s\n' "$*"
}

configure() {
    rm -rf "$folder/build"
    local code=0
    PATH=$folder/venv/bin:$PATH cmake -S "$folder/nothing" -B "$folder/build" -DCMAKE_PREFIX_PATH="$folder/venv" \
        -DPython3_EXECUTABLE="$folder/venv/bin/python" >"$folder/said" 2>&1 || code=$?
    grep -o -m 1 -E "No module named .*|By not providing \"[^\"]*\"|Build files have been written" "$folder/said"
    printf 'cmake: %d\n' "$code"
}

{
    install ros-kilted-ament-cmake==2.7.3 catkin_pkg==1.1.1
    "$folder/venv/bin/pip" check
    configure
    install ros-ament-package==0.17.2
    configure
    install ros-ament-cmake-include-directories==2.7.3
    configure
} | tee "$folder/seen"
diff - "$folder/seen" <<'SEEN'
ros-kilted-ament-cmake==2.7.3 catkin_pkg==1.1.1
No broken requirements found.
No module named 'ament_package'
cmake: 1
ros-ament-package==0.17.2
By not providing "Findament_cmake_include_directories.cmake"
cmake: 1
ros-ament-cmake-include-directories==2.7.3
Build files have been written
cmake: 0
SEEN
