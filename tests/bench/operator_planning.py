"""The time that the operator needs to plan a large job.

Each world is checked once, and is stored once per group.
"""

import json
import time

from palaestra.api import validate
from palaestra.plan import ClusterLayout, Images, identified, plan
from palaestra_sim.world import builtin, check
from tests.bench.sizes import scaled
from tests.jobs import make_job

REPLICAS = 30
SIMULATORS = 17  # one replica has 16 simulators that collect, and one that evaluates
WORLD_BYTES = 45_000
UID = "0d1f3e5a-7c2b-4d68-9a40-c3b2a1908f7e"
POST = """DEF POST_{0} Solid {{
  translation {0} 1.5 0.2
  name "post {0}"
  children [
    Shape {{
      appearance PBRAppearance {{
        baseColor 0.2 0.35 0.7
        roughness 1
        metalness 0
      }}
      geometry DEF POST_{0}_SHAPE Cylinder {{
        height 0.4
        radius 0.1
      }}
    }}
  ]
  boundingObject USE POST_{0}_SHAPE
}}
"""


def measure(scale=1.0):
    """Return the processor seconds to plan all replicas, to plan one replica, and to check the world."""
    text = world()
    replicas = scaled(REPLICAS, scale)
    job = identified(validate(request(text, replicas)), UID)
    layout = ClusterLayout(images=Images.of_release("0"))
    planned = plan(job, layout)
    return {
        "replicas": replicas,
        "simulators_a_replica": SIMULATORS,
        "world_kb": round(len(text) / 1000),
        "config_map_kb": round(len(json.dumps(planned.replicas[0].config_map)) / 1000),
        "seconds_for_all": cpu_s(lambda: plan(job, layout)),
        "seconds_for_one": cpu_s(lambda: plan(job, layout, replicas=[0])),
        "seconds_for_the_check": cpu_s(lambda: check(text.encode())),
    }


def world():
    """Return the arena with enough posts to make the file large."""
    text = builtin("arena").decode()
    posts = (WORLD_BYTES - len(text)) // len(POST.format(10)) + 1
    return text + "".join(POST.format(number) for number in range(posts))


def request(text, replicas):
    """Return a large TrainingJob with this world."""
    groups = (("collect", "Collect", SIMULATORS - 1), ("evaluate", "Evaluate", 1))
    simulators = [
        {"name": name, "role": role, "count": count, "world": {"inline": text}}
        for name, role, count in groups
    ]
    return make_job("large", replicas=replicas, simulators=simulators)


def cpu_s(work, rounds=3):
    """Return the processor seconds of `work`: the minimum of several rounds."""
    return round(min(one_round_s(work) for _ in range(rounds)), 3)


def one_round_s(work):
    """Return the processor seconds of one call of `work`."""
    began = time.process_time()
    work()
    return time.process_time() - began
