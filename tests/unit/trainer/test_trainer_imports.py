"""Imports at the start of a trainer: each attempt of each pod spends time on them."""

import json
import subprocess
import sys

IMPORT = """
import json, sys
import palaestra_trainer.cli.train, palaestra_trainer.run.attempt, palaestra_trainer.simulators.connect
imported = sorted(sys.modules)
"""
USE = """
from stable_baselines3.common import callbacks, logger, monitor
folder = sys.argv[1]
log = logger.configure(folder, ["csv", "tensorboard"])
log.record("figure", 7.0)
log.record("hyperparameters", logger.HParam({"gamma": 0.9}, {"figure": 7.0}), exclude="csv")
log.dump(1)
log.close()
monitor.Monitor(__import__("gymnasium").make("CartPole-v1"), folder).reset()
results = monitor.load_results(folder)
import pandas
read = pandas.read_csv(folder + "/progress.csv")
bar = callbacks.tqdm(total=3, disable=True)
used = list(read["figure"]), isinstance(results, pandas.DataFrame), type(bar).__module__
"""


def _run(program: str, *arguments: object):
    command = [sys.executable, "-c", program, *map(str, arguments)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout.splitlines()[-1])


def test_a_trainer_imports_no_library_before_it_uses_it(tmp_path):
    """The imports of pandas, Matplotlib, TensorBoard and rich took 40 % of the trainer's start.

    The libraries still work when a program uses them.
    """
    imported, used = _run(IMPORT + USE + "print(json.dumps([imported, used]))", tmp_path)

    assert "stable_baselines3.common.logger" in imported
    unused = {"matplotlib", "mlflow", "onnx", "optuna", "pandas", "rich", "tensorboard", "uv", "wandb"}
    assert unused.intersection(imported) == set()
    assert used == [[7.0], True, "tqdm.rich"]
    assert list(tmp_path.glob("events.out.tfevents.*"))


OPTIMIZE = """
import json, sys
import palaestra_trainer, torch
module = torch.nn.Linear(2, 1)
optimizer = torch.optim.Adam(module.parameters())
def learn():
    optimizer.zero_grad()
    module(torch.ones(3, 2)).sum().backward()
    optimizer.step()
learn()
before = "sympy" in sys.modules
"""
COMPILE = """
compiled = torch.compile(lambda x: x + 1, backend="eager")(torch.ones(1)).item()
learn()
answer = getattr(torch.optim.Optimizer.zero_grad.__wrapped__, "__dynamo_disable")
real = type(torch._dynamo).__name__ == "module" and torch._dynamo is sys.modules["torch._dynamo"]
print(json.dumps([before, compiled, real, hasattr(answer, "_torchdynamo_disable")]))
"""


def test_an_optimizer_brings_no_compiler_before_a_program_compiles():
    """The import of PyTorch's compiler took a third of the trainer's start.

    Functions that PyTorch excludes from compiling stay excluded.
    """
    assert _run(OPTIMIZE + COMPILE) == [False, 2.0, True, True]


def test_what_a_user_keeps_from_being_compiled_is_kept_from_it():
    """PyTorch marks a function that must not be compiled, and looks for the mark when it compiles another."""
    program = OPTIMIZE + "kept = torch._dynamo.disable(lambda x: x)\n"

    assert _run(program + "print(json.dumps([before, hasattr(kept, '_torchdynamo_disable')]))") == [
        False,
        True,
    ]


def test_a_part_of_the_compiler_can_be_imported_first():
    """A module that is executed twice would have two copies of its state."""
    program = OPTIMIZE + "import torch._dynamo.config as part\nfrom torch._dynamo import optimize\n"

    assert _run(program + "print(json.dumps(part is torch._dynamo.config))") is True


def test_a_library_that_a_user_imports_first_is_the_real_one_everywhere():
    """If a placeholder were imported later, the library would exist twice under one name."""
    first = "import matplotlib.figure, pandas\n"
    # From Stable-Baselines3 2.9 on, its logger imports neither Matplotlib nor pandas at module level.
    real = "{'matplotlib': matplotlib, 'pandas': pandas}"
    same = f"[getattr(logger, name, library) is library for name, library in {real}.items()]"
    program = first + IMPORT + f"from stable_baselines3.common import logger\nprint(json.dumps({same}))"

    assert _run(program) == [True, True]
