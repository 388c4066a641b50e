#!/bin/sh
# Start Webots in a container: give it a display, its assets and its preferences. The arguments are those of Webots.
set -eu
home=${WEBOTS_HOME:-/usr/local/webots}
assets=${WEBOTS_ASSETS:-/usr/local/webots-assets}
cache=${XDG_CACHE_HOME:-$HOME/.cache}/Cyberbotics/Webots
preferences=${XDG_CONFIG_HOME:-$HOME/.config}/Cyberbotics/Webots-$(head -n 1 "$home/resources/version.txt" | cut -d' ' -f1).conf

# Webots searches a PROTO's address in this folder before it uses the network. The links keep the folder writable for
# new files. Another Webots of this container may make the folder at the same time.
if [ -d "$assets" ] && [ ! -e "$cache/assets" ]; then
  mkdir -p "$cache"
  cp --recursive --symbolic-link "$assets" "$cache/assets.$$"
  mv --no-target-directory "$cache/assets.$$" "$cache/assets" 2>/dev/null || rm -rf "$cache/assets.$$"
fi

# Without this size, Webots deletes the oldest files of a folder with all assets.
if [ ! -e "$preferences" ]; then
  mkdir -p "${preferences%/*}"
  cat >"$preferences.$$" <<'PREFERENCES'
[%General]
checkWebotsUpdateOnStartup=false
telemetry=false

[Internal]
firstLaunch=false

[Network]
cacheSize=8192
PREFERENCES
  mv "$preferences.$$" "$preferences"
fi

# Webots needs an X server, even if it shows no window. The server itself chooses a free number, because the containers
# of a pod share the names of X servers but not the lock files, by which xvfb-run would choose. It is in a session of
# its own, so that a SIGTERM to the simulator's process group does not end it before Webots.
if [ -z "${DISPLAY:-}" ]; then
  folder=$(mktemp -d)
  mkfifo "$folder/number"
  setsid Xvfb -displayfd 3 -screen 0 1280x1024x24 -nolisten tcp -noreset 3>"$folder/number" >/dev/null 2>"$folder/log" &
  number=
  read -r number <"$folder/number" || true
  if [ -z "$number" ]; then
    echo "webots: Xvfb did not start: $(tail -n 1 "$folder/log"); set DISPLAY to a running X server, or look for a full /tmp" >&2
    exit 1
  fi
  rm -rf "$folder"
  export DISPLAY=":$number"
fi
exec "$home/webots" "$@"
