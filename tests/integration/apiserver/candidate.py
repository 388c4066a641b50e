"""A candidate for a lease in a separate process: `candidate.py KUBECONFIG NAMESPACE IDENTITY`.

When it gains or loses the leadership, it writes a line with `leads` or `follows`, and with the value of
`leads()`. For each line on standard input, it writes `now` and the value of `leads()`. When standard input
ends, it releases the lease and ends.
"""

import sys

import structlog

from palaestra.cluster import Leadership, connect

DURATION_S, RENEW_S = 3, 0.3


def main(kubeconfig: str, namespace: str, identity: str) -> None:
    """Take part in the election until standard input ends."""

    def say(word: str) -> None:
        sys.stdout.write(f"{word} {leadership.leads()}\n")
        sys.stdout.flush()

    structlog.configure(logger_factory=structlog.PrintLoggerFactory(sys.stderr))
    leadership = Leadership(
        connect(kubeconfig), namespace, "operator", identity, duration_s=DURATION_S, renew_s=RENEW_S
    )
    leadership.start(lambda: say("leads"), lambda: say("follows"))
    for _ in sys.stdin:
        say("now")
    leadership.stop()


if __name__ == "__main__":
    main(*sys.argv[1:])
