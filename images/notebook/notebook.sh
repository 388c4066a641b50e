#!/bin/sh
# Serve the working folder with JupyterLab on port 8888, and put the notebooks of the release there unless they already exist.
# The file $JUPYTER_TOKEN_FILE holds the access token; without such a file, the server creates a token and prints it.
set -eu
# If the folder is read-only, cp prints an error, and the server still starts.
cp --update=none /usr/local/share/palaestra/notebooks/* . || true
exec jupyter lab "--ip=*" --port=8888 --no-browser --ServerApp.root_dir="$PWD" --LabApp.extension_manager=readonly
