"""A candidate for a lease in a separate process: `candidate.py KUBECONFIG NAMESPACE IDENTITY`.

It writes a line for each change, `leads` or `follows`, and on each line whether `leads()` agrees. After a
line on its standard input it writes the value of `leads()` now. At the end of its input it ends and releases
the lease.
"""

import sys

import structlog

from palaestra.cluster import Leadership, connect

DURATION_S, RENEW_S = 3, 0.3


def main(kubeconfig: str, namespace: str, identity: str) -> None:
    """Take part in the election until the input ends."""

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
