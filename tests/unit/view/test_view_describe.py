"""The lines about a job that `palaestra describe` prints."""

from datetime import timedelta

from palaestra.client import Event
from palaestra.view import describe, happened
from tests.unit.view.jobs import CREATED, NOW, running_job


def told(job):
    """Return the lines about a job, without their indentation."""
    return [line.strip() for line in describe(job, CREATED, NOW)]


def test_a_running_job_is_described_from_spec_to_last_attempt():
    """A person reads first what the job is, then how far it is, and last how its previous attempt ended."""
    lines = told(running_job())

    assert "Algorithm:     DQN, 50,000 steps, seed 1" in lines
    assert "Step:           12,000 of 50,000 (24%), 50 a second, about 12m40s to go" in lines
    assert "Checkpoint:     step 11,000, 2m ago" in lines
    assert "Restarts:       trainer 1, simulator 3" in lines
    assert "Time spent:     stepping 75%, learning 25%" in lines
    assert "Running   True     1m      Because   so it is" in lines
    assert lines[-3:] == ["last lines of its log:", "first", "last"]


def test_a_success_rate_has_its_interval_and_that_of_an_older_trainer_has_none():
    """Without the interval, a rate over twenty episodes looks as certain as a rate over a thousand."""
    interval = {"low": 0.91, "high": 0.99, "episodes": 100}

    assert "Success rate:   40% in the last evaluation" in told(running_job())
    assert "Success rate:   97% (95% interval 91% to 99%, 100 episodes)" in told(
        running_job(successRate=0.97, successInterval=interval)
    )


def test_the_last_evaluation_has_its_own_return_next_to_that_of_training():
    """The mean return of training episodes includes exploration, so the two returns may differ much."""
    evaluation = {"step": 10_000, "meanReturn": 4.5}

    lines = told(running_job(lastEvaluation=evaluation))
    successful = told(running_job(lastEvaluation=evaluation | {"successRate": 0.35}))
    program = told(running_job(lastEvaluation={"step": 10_000, "successRate": 0.35}))

    assert "Mean return:    3.25" in lines
    assert "Evaluation:     step 10,000, mean return 4.5" in lines
    assert "Evaluation:     step 10,000, success rate 35%, mean return 4.5" in successful
    assert "Evaluation:     step 10,000, success rate 35%" in program


def test_simulators_have_a_line_each_with_what_is_wrong_with_them():
    """A simulator that the trainer has given up shows `given up` in place of its last state."""
    lines = told(running_job())

    assert "collect-0    Collect    ready      3          -         did not answer" in lines
    assert "evaluate-0   Evaluate   given up   0          -         -" in lines


def test_what_simulators_leave_out_has_lines_of_its_own():
    """A success rate means less if the simulators left out parts of the world."""
    line = "collect: the stub simulates no Drone: 1 node left out (line 7)"
    job = running_job()
    status = job.status.model_copy(update={"left_out": (line,)})

    lines = told(job.model_copy(update={"status": status}))

    assert lines[lines.index("Left out of the worlds:") + 1] == line
    assert "Left out of the worlds:" not in told(job)


def test_what_is_not_known_is_left_out():
    """A job that no operator has reconciled has a name, but no progress to show."""
    lines = told(running_job(phase="Pending", step=None, target=None, goodput=None, lastAttempt=None))

    assert not [line for line in lines if line.startswith(("Step", "Time spent", "Last attempt"))]
    assert "none yet" in lines


def test_a_time_ledger_of_no_seconds_is_left_out():
    """The first poll of a trainer comes before the trainer has counted a whole second."""
    assert not [line for line in told(running_job(goodput={})) if line.startswith("Time spent")]


def test_slow_steps_are_listed_apart_from_faults():
    """People searched for a broken simulator when they read `Faults: slow 1`."""
    both = told(running_job(faults={"dead": 2, "slow": 1}))

    assert "Faults:         dead 2" in both
    assert "Slow steps:     1 (not faults)" in both
    assert not [line for line in told(running_job(faults={"slow": 1})) if line.startswith("Faults")]


def test_recycling_is_listed_apart_from_recovering():
    """Recycling is a planned restart, so nobody has to look for a fault."""
    lines = told(running_job(goodput={"stepping": 75, "recycling": 25}))

    assert "Time spent:     stepping 75%, recycling 25%" in lines


def test_the_storage_of_the_run_is_shown():
    """The storage decides which files are left after the job is deleted."""
    assert "Storage:       in the pod, deleted with it" in told(
        running_job(spec={"storage": {"ephemeral": True}})
    )
    assert "Storage:       claim mine" in told(running_job(spec={"storage": {"existingClaim": "mine"}}))


def test_events_have_an_age_and_a_count():
    """A message may have several lines, and an event may recur, but each event is one line with a count."""
    event = Event(
        time=NOW - timedelta(minutes=3),
        warning=True,
        about="Pod/job-0-x7k2p",
        reason="BackOff",
        message="back-off\nrestarting",
        count=4,
    )

    lines = happened([event], NOW)

    assert " ".join(lines[1].split()) == "3m (x4) Warning BackOff Pod/job-0-x7k2p back-off restarting"


def test_an_event_about_a_container_names_it():
    """Without the name, a pod with five containers would have five equal lines `Container created`."""
    event = Event(
        time=NOW,
        warning=False,
        about="Pod/job-0-x7k2p",
        reason="Created",
        message="Container created",
        count=1,
        container="sim-collect-0",
    )

    line = happened([event], NOW)[1]

    assert " ".join(line.split()) == "0s Normal Created Pod/job-0-x7k2p (sim-collect-0) Container created"


def test_a_line_says_that_there_are_no_events():
    """A cluster deletes events after an hour, so an old job has none."""
    assert happened([], NOW) == ["none that the cluster still has"]
