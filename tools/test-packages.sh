#!/usr/bin/env bash
# Install what only the tests and measurements need, on a Debian 12 or 13 machine: ROS, a compiler, OpenGL and a
# browser from the distribution. You can repeat this script safely: a failed run leaves no .venv/test-packages behind.
set -euo pipefail
cd "$(dirname "$0")/.."

# rospy's service proxies import netifaces, but Debian's package of rospy does not depend on it.
packages=(python3-rospy python3-rosmaster python3-netifaces)
# ROS's command line, and the message types that webots_ros uses, as Python modules and as definitions.
packages+=(python3-rosmsg python3-rosservice python3-rostopic python3-sensor-msgs ros-sensor-msgs)
# The definitions of ROS's other common packages, with which a test compares ours.
packages+=(ros-nav-msgs ros-std-srvs)
# A compiler and the headers of roscpp: a test builds a client in C++.
packages+=(g++ libroscpp-dev libsensor-msgs-dev python3-gencpp)
# MuJoCo's cameras draw with OpenGL on the processor.
packages+=(libegl1 libgl1-mesa-dri libopengl0)
# A test opens the report of a run in a browser.
packages+=(chromium)

all_installed() {
  local libraries modules
  libraries=$(/sbin/ldconfig -p)
  modules='netifaces, rosmaster, rosmsg, rospy, rosservice, rostopic, sensor_msgs, gencpp'
  /usr/bin/python3 -c "import $modules" 2>/dev/null && command -v g++ >/dev/null &&
    command -v chromium >/dev/null &&
    [[ -d /usr/share/sensor_msgs/msg && -d /usr/share/nav_msgs/msg && -d /usr/share/std_srvs/srv ]] &&
    [[ -f /usr/include/ros/ros.h && -f /usr/include/sensor_msgs/Imu.h ]] &&
    [[ $libraries == *libEGL.so.1* && $libraries == *libOpenGL.so.0* ]]
}

if ! all_installed; then
  install="apt-get install -y --no-install-recommends ${packages[*]}"
  if [[ $EUID -ne 0 ]]; then
    echo "Packages for the tests are missing. Type this line, then repeat the command:"
    echo "  sudo apt-get update && sudo $install"
    exit 1
  fi
  echo "test-packages: installing ${packages[*]}"
  apt-get update -qq
  DEBIAN_FRONTEND=noninteractive $install -qq >/dev/null
fi
.venv/bin/palaestra-webots-ros --importable .venv/share
touch .venv/test-packages
