# Functions that record the id and the start time of a process, and find the process again after the starting script has ended.
# Source this file after settings.sh.
# shellcheck shell=bash

# Print the start time of a process, in ticks since the boot of this machine, and the id of this boot.
start_of() {
  local stat
  stat=$(cat "/proc/$1/stat" 2>/dev/null) || return 1
  # The second field, the name, may contain spaces and brackets, so the fields are counted after its last bracket.
  echo "$(cut -d' ' -f20 <<<"${stat##*) }") $(cat /proc/sys/kernel/random/boot_id)"
}

# Write the id and the start time of the calling shell or subshell into a file.
record_process() {
  local self=$BASHPID # inside $(…), BASHPID would be the id of another process
  echo "$self $(start_of "$self")" >"$1.part"
  mv "$1.part" "$1"
}

# Print the id in a file of record_process if the recorded process still runs; otherwise fail.
recorded_process() {
  local pid start
  read -r pid start 2>/dev/null <"$1" || return 1
  [[ $(start_of "$pid") == "$start" ]] && echo "$pid"
}

is_gone() { [[ ! -d /proc/$1 ]]; }

# Repeat a command until it succeeds; fail after the given number of seconds.
wait_until() {
  local deadline=$((SECONDS + $1))
  shift
  until "$@"; do
    ((SECONDS < deadline)) || return 1
    sleep 0.1
  done
}
