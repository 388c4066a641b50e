"""Generate the files of the package webots_ros: a manifest, the definitions, and genpy's Python modules.

Two details make the package work next to an installed webots_ros and on a plain Debian:

- `src/webots_ros` has no `__init__.py`. Python uses such a folder only if no entry of `sys.path` has a
  regular package of the same name. So if another webots_ros is installed, Python imports that one.
- The manifest is a `manifest.xml`, because roslib adds `src` to the path of ROS's tools only for such a
  package. The manifest names no dependencies, because roslib requires a manifest of each dependency. Debian
  installs the manifests of std_msgs, geometry_msgs and sensor_msgs only with their C++ packages.

Only this module imports genpy and genmsg. Programs that use the generated modules have both packages, because
rospy depends on them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from functools import cache
from typing import Any

import genmsg
import genmsg.msg_loader
import genpy.generator

from palaestra_protocol.ros import definitions

NAME = "webots_ros"
MANIFEST = "manifest.xml"

_MANIFEST_TEXT = """\
<package>
  <description brief="Messages and services of the ros controller of Webots">
    Messages and services of the `ros` controller of Webots, as Palaestra's simulators use them.
  </description>
  <author>Palaestra</author>
  <license>Apache-2.0</license>
</package>
"""


def package_files() -> Iterator[tuple[str, str]]:
    """Yield the path in the package and the text of every file."""
    messages, services = definitions.type_names()
    yield MANIFEST, _MANIFEST_TEXT
    yield from _of_one_kind("msg", messages, _message_module)
    yield from _of_one_kind("srv", services, _service_module)


def _of_one_kind(kind: str, types: Iterable[str], module: Callable[[str], str]) -> Iterator[tuple[str, str]]:
    modules, prefix = f"src/{NAME}/{kind}", f"{NAME}/"
    bases = [name.removeprefix(prefix) for name in types if name.startswith(prefix)]
    for base in bases:
        yield f"{kind}/{base}.{kind}", definitions.text(prefix + base)
        yield f"{modules}/_{base}.py", module(prefix + base)
    yield f"{modules}/__init__.py", "".join(f"from ._{base} import *\n" for base in bases)


def _message_module(name: str) -> str:
    context = _context()
    return _text(genpy.generator.msg_generator(context, context.get_registered(name), {}))


def _service_module(name: str) -> str:
    context = _context()
    spec = genmsg.msg_loader.load_srv_from_string(context, definitions.text(name), name)
    genmsg.msg_loader.load_depends(context, spec, {})
    return _text(genpy.generator.srv_generator(context, spec, {}))


@cache
def _context() -> Any:
    """Return genmsg's `MsgContext` with every message of the interface."""
    context = genmsg.MsgContext.create_default()
    names, _ = definitions.type_names()
    specs = [genmsg.msg_loader.load_msg_from_string(context, definitions.text(name), name) for name in names]
    for spec in specs:
        genmsg.msg_loader.load_depends(context, spec, {})
    return context


def _text(lines: Iterable[str]) -> str:
    # genpy numbers its variables across modules. After a reset, the text of a module does not depend on the
    # modules that were generated before it.
    genpy.generator.reset_var()
    return "".join(f"{line}\n" for line in lines)
