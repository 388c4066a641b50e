"""Find URLs with a password in a TrainingJob: each user who may read the job could read the password."""

import re
from collections.abc import Mapping, Sequence

from palaestra.api.model import Rule

# This expression matches user information with a password, between the scheme and the host of a URL. Shell
# variables and placeholders, such as ${TOKEN} and {token}, are not passwords. API servers use this expression
# too.
PASSWORD = r"://[^\s/?#:@]*:[^\s/?#@${][^\s/?#@]*@"
_PASSWORD = re.compile(PASSWORD)

_VALUE = "contains a password in an address; put the value into a Secret and use secretKeyRef"
_ELSEWHERE = "contains a password in an address; pass it in an environment variable with secretKeyRef"


def has_password(value: object) -> bool:
    """Return whether a text, or any text in a list or mapping, contains a URL with a password."""
    if isinstance(value, str):
        return _PASSWORD.search(value) is not None
    if isinstance(value, Mapping):
        return any(has_password(item) for item in (*value, *value.values()))
    return isinstance(value, Sequence) and any(map(has_password, value))


NO_PASSWORD_IN_VALUE = Rule(
    field="value",
    holds=lambda variable: not has_password(variable.value),
    cel=f"!has(self.value) || !self.value.matches(r'{PASSWORD}')",
    message=_VALUE,
)
NO_PASSWORD_IN_COMMAND = Rule(
    field="command",
    holds=lambda owner: not has_password(owner.command),
    cel=f"!self.command.exists(word, word.matches(r'{PASSWORD}'))",
    message=_ELSEWHERE,
)
NO_PASSWORD_IN_WORDS = Rule(
    field="options",
    holds=lambda group: not has_password(group.options),
    cel=f"!self.options.exists(word, word.matches(r'{PASSWORD}'))",
    message=_ELSEWHERE,
)
NO_PASSWORD_IN_OPTIONS = Rule(  # `options` may have any content, so an API server cannot check it
    field="options",
    holds=lambda owner: not has_password(owner.options),
    reads=("options",),
    message=_ELSEWHERE,
)
