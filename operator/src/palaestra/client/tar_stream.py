"""Write parts of a folder to standard output as one tar: run as `python3 -I -c TEXT FOLDER NAME...`.

The text of this file is sent to a container, so it uses the standard library only. The run may continue in
the meantime. Each file is opened before its size is read: a growing file is truncated at that size, and a
replaced file is complete. Missing files are skipped.
"""

import os
import sys
import tarfile


def files(folder: str, name: str) -> list[str]:
    """Return the paths of the file `name`, or of all files below it, sorted and relative to the folder."""
    path = os.path.join(folder, name)
    if os.path.isfile(path):
        return [name]
    found = [
        os.path.relpath(os.path.join(where, name), folder)
        for where, _, names in os.walk(path)
        for name in names
    ]
    return sorted(found)


def pack(folder: str, names: list[str]) -> None:
    """Write the tar."""
    with tarfile.open(fileobj=sys.stdout.buffer, mode="w|") as tar:
        for name in names:
            for file in files(folder, name):
                with open(os.path.join(folder, file), "rb") as content:
                    tar.addfile(tar.gettarinfo(arcname=file, fileobj=content), content)


if __name__ == "__main__":
    pack(sys.argv[1], sys.argv[2:])
