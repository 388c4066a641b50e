"""A candidate for a lease in a process of its own: `candidate.py KUBECONFIG NAMESPACE IDENTITY`.

Writes a line for each change: `leads` and `follows`, and with each line whether `leads()` agrees. A line on
its standard input makes it say what `leads()` is now; the end of its input makes it end and give the lease
back.
"""

import sys

import structlog

from palaestra.cluster import Leadership, connect

DURATION_S, RENEW_S = 3, 0.3


def main(kubeconfig: str, namespace: str, identity: str) -> None:
    """Stand for election until the input ends."""

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
