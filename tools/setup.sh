#!/usr/bin/env bash
# Install what Palaestra needs on a Debian 12 or 13 machine: ROS and OpenGL from the distribution, the rest
# into .venv.
# Safe to repeat; a failed run leaves no .venv/ready behind, so the next one starts over.
set -euo pipefail
cd "$(dirname "$0")/.."

# rospy's own service proxies import netifaces, on which its package forgets to depend.
packages=(python3-rospy python3-rosmaster python3-netifaces python3-venv)
# ROS's command line, and the messages that those of webots_ros hold, as Python modules and as definitions.
packages+=(python3-rosmsg python3-rosservice python3-rostopic python3-sensor-msgs ros-sensor-msgs)
# A compiler and the headers of roscpp: a test builds a client in C++.
packages+=(g++ libroscpp-dev libsensor-msgs-dev python3-gencpp)
# OpenGL on the processor: MuJoCo's cameras draw with it.
packages+=(libegl1 libgl1-mesa-dri libopengl0)

all_installed() {
  local libraries modules
  libraries=$(/sbin/ldconfig -p)
  modules='ensurepip, netifaces, rosmaster, rosmsg, rospy, rosservice, rostopic, sensor_msgs, gencpp'
  /usr/bin/python3 -c "import $modules" 2>/dev/null && command -v g++ >/dev/null &&
    [[ -d /usr/share/sensor_msgs/msg && -f /usr/include/ros/ros.h && -f /usr/include/sensor_msgs/Imu.h ]] &&
    [[ $libraries == *libEGL.so.1* && $libraries == *libOpenGL.so.0* ]]
}

if ! all_installed; then
  install="apt-get install -y --no-install-recommends ${packages[*]}"
  if [[ $EUID -ne 0 ]]; then
    echo "Packages are missing. Type this line, then repeat the command:"
    echo "  sudo apt-get update && sudo $install"
    exit 1
  fi
  echo "setup: installing ${packages[*]}"
  apt-get update -qq
  DEBIAN_FRONTEND=noninteractive $install -qq >/dev/null
fi

# Debian's rospy lives in /usr/lib/python3, so the environment is made from Debian's interpreter and sees it.
uv_pin=$(grep -oE '^uv==[0-9.]+' requirements.lock)
rm -f .venv/ready
if [[ ! -x .venv/bin/uv ]]; then
  echo "setup: making .venv"
  /usr/bin/python3 -m venv --clear --system-site-packages .venv
  .venv/bin/python -m pip install --quiet --disable-pip-version-check "$uv_pin"
fi
echo "setup: installing the locked packages (PyTorch with CUDA is 3 GB; the first time takes minutes)"
export VIRTUAL_ENV="$PWD/.venv" UV_LINK_MODE="${UV_LINK_MODE:-hardlink}"
.venv/bin/uv pip install --quiet --require-hashes -r requirements.lock
.venv/bin/uv pip install --quiet --no-deps --no-build-isolation -e operator -e trainer -e sim_image
.venv/bin/palaestra-webots-ros --importable .venv/share
touch .venv/ready
