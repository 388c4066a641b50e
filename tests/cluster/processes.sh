# Processes that outlive the script that started them, found again by id and start time. Sourced, after settings.sh.
# shellcheck shell=bash

# Print when a process was started, in ticks since this machine booted, with the boot's own id.
start_of() {
  local stat
  stat=$(cat "/proc/$1/stat" 2>/dev/null) || return 1
  # The name, second field, may hold spaces and brackets: count from behind its last bracket.
  echo "$(cut -d' ' -f20 <<<"${stat##*) }") $(cat /proc/sys/kernel/random/boot_id)"
}

# Write the calling (sub)shell's id and start into a file.
record_process() {
  local self=$BASHPID # inside $(…) it would be another one
  echo "$self $(start_of "$self")" >"$1.part"
  mv "$1.part" "$1"
}

# Print the id in such a file if that very process still runs; fail if not.
recorded_process() {
  local pid start
  read -r pid start 2>/dev/null <"$1" || return 1
  [[ $(start_of "$pid") == "$start" ]] && echo "$pid"
}

is_gone() { [[ ! -d /proc/$1 ]]; }

# Run a command again and again until it succeeds; fail after so many seconds.
wait_until() {
  local deadline=$((SECONDS + $1))
  shift
  until "$@"; do
    ((SECONDS < deadline)) || return 1
    sleep 0.1
  done
}
