"""All calls of the conformance program, made by a client of any library."""

from palaestra_trainer.ros.conformance.player import Player
from tools.interface.everything import ROBOT


def play(asked, client, files):
    """Return the responses by path, and the messages by topic; the last call ends the simulator."""
    answers, heard = Player(client, ROBOT, asked.step_ms, files).play(asked, ending=True)
    return {"answers": answers, "heard": heard}
