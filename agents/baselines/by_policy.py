"""What a policy chooses, tried a few times: a trained agent that is given physics calls.

Proposals are arms of a bandit without end, and calls go to them by Thompson sampling (Thompson,
*Biometrika* 25, 1933): every known choice, and the next proposal, draws its share of successes from
what is known of it, and the largest has the call.
"""

import numpy as np

from agents.baselines.calls import Calls
from agents.evaluation.policies import Policy


class PolicySearch:
    """Watches a policy, first at its best, then as it explores, and tries what it chose again.

    Parameters
    ----------
    greedy : Policy
        Plays what it thinks best.
    exploring : Policy
        Plays as in training, so that it proposes something else each time.
    """

    def __init__(self, greedy: Policy, exploring: Policy) -> None:
        self._greedy, self._exploring = greedy, exploring

    def run(self, calls: Calls, rng: np.random.Generator) -> None:
        """Watch the greedy policy, then propose or try again, call by call."""
        proposals = [calls.watch(self._greedy, rng)]
        while True:
            known = calls.standings()
            drawn = [
                rng.beta(1 + each.successes, 1 + len(each.scores) - each.successes)
                for each in known
            ]
            new = rng.beta(1 + sum(proposals), 1 + len(proposals) - sum(proposals))
            if drawn and max(drawn) >= new:
                calls.again(known[int(np.argmax(drawn))].choice)
            else:
                proposals.append(calls.watch(self._exploring, rng))
