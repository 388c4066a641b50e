"""One test for all rows of a table, where hundreds of tests would each need their own set-up."""

import functools
import inspect
from collections.abc import Callable, Iterable
from typing import Any


def for_each(names: str, rows: Callable[[], Iterable[Any]] | Iterable[Any]) -> Callable[..., Any]:
    """Call a test for each row, as `pytest.mark.parametrize` does, but as one test with one set-up.

    A failing row does not stop the others, and the error lists every failing row. All rows share their
    fixtures, so a row must not change a fixture.

    Args:
        names: the names of the row's parameters, separated by commas.
        rows: values, or tuples of them if there are several names; a function makes them when the test runs.

    Raises:
        ExceptionGroup: some rows fail; each error has a note with its row.
    """
    keys = [name.strip() for name in names.split(",")]

    def decorate(test: Callable[..., None]) -> Callable[..., None]:
        signature = inspect.signature(test)
        fixtures = [each for name, each in signature.parameters.items() if name not in keys]

        @functools.wraps(test, updated=())
        def every(**given: Any) -> None:
            wrong: list[Exception] = []
            tried = list(rows() if callable(rows) else rows)
            assert tried, "the table is empty"
            for row in tried:
                values = row if len(keys) > 1 else (row,)
                try:
                    test(**given, **dict(zip(keys, values, strict=True)))
                except Exception as error:  # noqa: BLE001 - the errors of all rows are raised together below
                    error.add_note(f"{names}: {', '.join(map(str, values))}")
                    wrong.append(error)
            if wrong:
                raise ExceptionGroup(f"{len(wrong)} of {len(tried)} rows fail", wrong)

        every.__signature__ = signature.replace(parameters=fixtures)  # type: ignore[attr-defined]
        return every

    return decorate
