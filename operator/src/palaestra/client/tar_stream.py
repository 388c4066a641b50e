"""Write files of a folder to standard output as one tar: run as `python3 -I -c TEXT FOLDER NAME...`.

The client sends the text of this file to a container, so the program imports only the standard library. The
run may write to its files meanwhile. Each file is opened before its size is read. So a growing file is
truncated at that size, and the old content of a replaced file is complete. Missing files are skipped.
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
    """Write the tar with the named files and folders."""
    with tarfile.open(fileobj=sys.stdout.buffer, mode="w|") as tar:
        for name in names:
            for file in files(folder, name):
                with open(os.path.join(folder, file), "rb") as content:
                    tar.addfile(tar.gettarinfo(arcname=file, fileobj=content), content)


if __name__ == "__main__":
    pack(sys.argv[1], sys.argv[2:])
