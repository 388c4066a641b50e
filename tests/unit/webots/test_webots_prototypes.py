"""The types with which the controller calls libController equal those of the C functions in the tests."""

from palaestra_sim.webots.library import PROTOTYPE_OF
from tests.fake_webots.wire import RESULTS, functions

# The words of functions.h, and the words of the controller for the same type.
SAME = {
    "none": {"void"},
    "number": {"int"},
    "flag": {"bool"},
    "real": {"double"},
    "doubles": {"doubles", "vec2", "vec3", "vec4", "vec6", "mat3", "mat4"},
    "points": {"LidarPoint"},
    "targets": {"RadarTarget"},
    "objects": {"RecognitionObject"},
    "contacts": {"NodeContact"},
}


def test_the_library_of_the_tests_has_every_function():
    """A function that the library lacks would be called by no test."""
    assert sorted(PROTOTYPE_OF.keys() - RESULTS.keys()) == ["robot_cleanup"]


def test_each_function_has_the_types_of_the_headers():
    """Ctypes does not know the types in C: a wrong type would be a wrong value, or a crash."""
    wrong = {name: PROTOTYPE_OF[name] for name, declared in functions().items() if not _fits(name, declared)}

    assert wrong == {}


def _fits(name, declared):
    found, wanted = PROTOTYPE_OF[name], [declared[0], *declared[1]]
    pairs = zip((found.result, *found.arguments), wanted, strict=False)
    return len(found.arguments) + 1 == len(wanted) and all(it in SAME.get(like, {like}) for it, like in pairs)
