"""Build the client with roscpp from headers of gencpp: one program for all types of the interface.

As a program, this module writes the headers: `python roscpp_build.py FOLDER PACKAGE FILE...`. It runs as a
separate process, because the template engine of gencpp replaces sys.stdout.
"""

import subprocess
import sys
from pathlib import Path

import genmsg.template_tools

from palaestra_sim.message_package.package_writer import write

PROGRAM = Path(__file__).with_name("roscpp_client.cpp")
TEMPLATES = "/usr/share/gencpp"
MESSAGES = Path("/usr/share")  # Debian's message definitions, in one folder per package
NESTED = ("std_msgs", "geometry_msgs", "sensor_msgs")
LIBRARIES = ("roscpp", "roscpp_serialization", "rosconsole", "rostime", "boost_thread")
DEADLINE_S = 240.0  # the compiler may need minutes on a slow and busy machine


def build(folder, services, topics):
    """Build the program in `folder` for these service and topic types, and return its path."""
    ours = sorted(name for name in {*services, *topics} if name.startswith("webots_ros/"))
    package = write(folder)
    kinds = {name: "srv" if name in services else "msg" for name in ours}
    files = [package / kinds[name] / f"{name.partition('/')[2]}.{kinds[name]}" for name in ours]
    # These messages are nested in services and in other messages of the package.
    nested = [*(package / "msg").glob("*.msg")]
    includes = folder / "include"
    _run(sys.executable, __file__, includes / "webots_ros", package, *{*files, *nested})
    (includes / "interface.inc").write_text(_interface(services, topics))
    program = folder / "roscpp_client"
    libraries = [f"-l{name}" for name in LIBRARIES]
    _run("g++", "-std=c++17", "-O0", f"-I{includes}", PROGRAM, "-o", program, *libraries)
    return program


def _interface(services, topics):
    names = sorted({*services, *topics})
    includes = "".join(f"#include <{name}.h>\n" for name in names)
    types = [
        f"  {kind}({name.replace('/', ', ')})"
        for kind, group in (("SERVICE", services), ("TOPIC", topics))
        for name in sorted(set(group))
    ]
    return includes + "#define ALL_TYPES \\\n" + " \\\n".join(types) + "\n"


def _run(*words):
    done = subprocess.run(
        [str(word) for word in words], capture_output=True, text=True, timeout=DEADLINE_S, check=False
    )
    assert done.returncode == 0, done.stderr[-4000:]


def make_headers(folder, package, files):
    """Write the C++ header of each definition; for a service, write two more for request and response."""
    paths = [f"webots_ros:{package}/msg", *(f"{name}:{MESSAGES / name / 'msg'}" for name in NESTED)]
    for file in files:
        genmsg.template_tools.generate_from_file(
            file,
            "webots_ros",
            folder,
            TEMPLATES,
            paths,
            {"msg.h.template": "@NAME@.h"},
            {"srv.h.template": "@NAME@.h"},
        )


if __name__ == "__main__":
    make_headers(sys.argv[1], sys.argv[2], sys.argv[3:])
