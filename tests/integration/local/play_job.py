"""Run a planned Job as `palaestra run` does: `python play_job.py JOB.json DIRECTORY [DEADLINE_S]`.

The tests start this program as a separate process, because they kill it.
"""

import asyncio
import json
import sys
from pathlib import Path

from palaestra.local.container import BackOff
from palaestra.local.replica import Setting, run_replica
from palaestra.plan import ReplicaPlan

job = json.loads(Path(sys.argv[1]).read_text())
planned = ReplicaPlan(config_map={"data": {}}, claim=None, job=job)
deadline_s = float(sys.argv[3]) if len(sys.argv) > 3 else None
setting = Setting(directory=Path(sys.argv[2]), backoff=BackOff(first_s=0.02), deadline_s=deadline_s)
outcome = asyncio.run(run_replica(planned, setting))
sys.stdout.write(json.dumps({"code": outcome.exit_code, "pods": outcome.pods, "steps": outcome.steps}))
