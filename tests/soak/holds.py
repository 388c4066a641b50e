"""How often, why and how long a robot was held back or stopped.

`safety.decide` returns a cause with each command of zero. A cause with `stops` latches: the robot stands
until a person begins a new episode. Any other cause is a hold, which ends by itself. A hold of at most one
control period is the effect of one late reading; the policy acts again in the next period. A longer hold
looks like a stop to a person, so it counts as a stop.
"""

from collections.abc import Callable
from dataclasses import dataclass, field


@dataclass
class Holds:
    """Collects the decisions of a command loop.

    Attributes:
        now_s: returns the robot's time.
        period_s: one control period of the policy.
        found: for each hold or stop its cause, whether it latches, and its seconds so far.
    """

    now_s: Callable[[], float]
    period_s: float
    found: list = field(default_factory=list)
    _since_s: float | None = None

    def decided(self, situation, decision):
        """Take a decision of the command loop."""
        del situation
        name = None if decision.cause is None else (decision.cause.name, decision.cause.stops)
        now_s = self.now_s()
        if self._since_s is not None:
            self.found[-1][2] = now_s - self._since_s
        if name is None:
            self._since_s = None
        elif self._since_s is None or tuple(self.found[-1][:2]) != name:
            self.found.append([*name, 0.0])
            self._since_s = now_s

    def stops(self):
        """Return the number of stops of each cause: latched ones, and holds longer than a period."""
        causes = [name for name, latched, seconds in self.found if latched or seconds > self.period_s]
        return {name: causes.count(name) for name in causes}

    def report(self):
        """Return for each cause the number of holds and stops, and their seconds."""
        return {
            cause: {
                "latched": sum(latched for name, latched, _ in self.found if name == cause),
                "holds": sum(not latched for name, latched, _ in self.found if name == cause),
                "stops": self.stops().get(cause, 0),
                "longest_s": round(max(seconds for name, _, seconds in self.found if name == cause), 3),
                "total_s": round(sum(seconds for name, _, seconds in self.found if name == cause), 3),
            }
            for cause in sorted({name for name, _, _ in self.found})
        }
